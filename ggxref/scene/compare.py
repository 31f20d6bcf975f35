"""How far one way to compute a picture is from another, with the error of that number, and what each costs."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from ggxref.scene import materials, render
from ggxref.scene.materials import Kind, Rows

SURE = 2.0
"""Standard errors that a deviation keeps from the tolerance."""
_LANES = 1 << 14


@dataclass(frozen=True)
class Deviation:
    """Root mean square of the difference over mean radiance, in a region; `error`: its standard error."""

    value: float
    error: float

    @property
    def most(self) -> float:
        """What the deviation is surely below."""
        return self.value + SURE * self.error

    @property
    def least(self) -> float:
        return max(self.value - SURE * self.error, 0.0)


def deviation(differences: np.ndarray, level: float) -> Deviation:
    """From independent estimates of the difference of two pictures, (batches, pixels), and the mean radiance.

    The square of a noisy difference is too large by its variance. Products of different batches are not: their mean over
    all pairs estimates the squared difference without bias. Its error is the jackknife's over the batches.
    """
    count = len(differences)
    if count < 2:
        raise ValueError(f"{count} batch of differences; the error needs two")

    def square(d):
        n = len(d)
        return float(np.mean(d.sum(axis=0) ** 2 - (d**2).sum(axis=0)) / (n * (n - 1)))

    whole = square(differences)
    if not differences.any():
        return Deviation(0.0, 0.0)
    if count == 2:
        error = abs(whole)
    else:
        left_out = np.array([square(np.delete(differences, k, axis=0)) for k in range(count)])
        error = math.sqrt((count - 1) / count * np.sum((left_out - left_out.mean()) ** 2))
    root = math.sqrt(max(whole, 0.0))
    # From the square's error to the root's: exact where they meet, finite where the square is 0.
    return Deviation(root / level, (math.sqrt(max(whole, 0.0) + SURE * error) - root) / SURE / level)


@dataclass(frozen=True)
class Batches:
    """Independent pictures of one scene, (batches, height, width); variance of one sample per pixel; time taken."""

    pictures: np.ndarray
    variance: np.ndarray
    ns_per_sample: float

    @property
    def mean(self) -> np.ndarray:
        return self.pictures.mean(axis=0)


def batches(kinds, world, settings: render.Settings, *, count: int, samples: int, seed: int) -> Batches:
    """`count` pictures of `samples` samples a pixel, seeds in turn: the same seeds give two models the same numbers."""
    render.render(kinds, world, settings, samples=2, seed=seed)  # compiles
    found = [render.render(kinds, world, settings, samples=samples, seed=seed + k) for k in range(count)]
    pixels = settings.width * settings.height
    # The least: what else the machine does only adds to it.
    fastest = min(each.seconds for each in found) / (samples * pixels) * 1e9
    variance = np.mean([each.variance for each in found], axis=0)
    return Batches(np.stack([each.mean for each in found]), variance, fastest)


def deviations(one: Batches, other: Batches, regions: Mapping[str, np.ndarray]) -> dict[str, Deviation]:
    """Of `one` from `other`, whose seeds were the same, in each region, (height, width), bool."""
    difference = one.pictures - other.pictures
    return {
        name: deviation(difference[:, region], float(other.mean[region].mean()))
        for name, region in regions.items()
        if region.any()
    }


def shading_cost(kind: Kind, rows: Rows, repeats: int = 15) -> float:
    """Processor nanoseconds that a bounce spends in a kind's formulas: one direction drawn, one evaluated. The least of repeats.

    - `rows`: of one material. Known directions are spread over the hemisphere.
    """
    row = Rows(*(field[0] for field in rows))

    def bounce(u, v):
        wi = materials.cosine_lobe(v[:2])
        drawn = materials.sample(kind, row, u, wi)
        value, pdf = materials.evaluate(kind, row, wi, materials.cosine_lobe(v[2:]))
        return drawn.value, drawn.pdf, drawn.wo, value, pdf

    keys = jax.random.split(jax.random.key(0))
    u, v = (jax.random.uniform(key, (4, _LANES), jnp.float32) for key in keys)
    compiled = jax.jit(jax.vmap(bounce, -1, -1)).lower(u, v).compile()
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        jax.block_until_ready(compiled(u, v))
        times.append(time.process_time() - begun)
    return min(times) / _LANES * 1e9
