"""How far one way to compute a picture is from another, with the error of that number, and what each costs."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from ggxref.scene import materials, render, shading
from ggxref.scene.materials import Kind, Rows

SURE = 2.0
"""Standard errors that a deviation keeps from the tolerance."""
_LANES = 1 << 14
_TURNS = 41
USES = {"g2": 2, "fresnel": 2, "trigonometry": 1}
"""How often a bounce needs a part: G2 and F of the direction drawn and of the light's, one azimuth."""


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
    if not np.isfinite(differences).all():  # half precision overflows
        return Deviation(math.inf, 0.0)

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
    """`count` pictures of `samples` samples a pixel: one seed gives two models the same numbers."""
    settings = replace(settings, batches=count)
    render.prepare(kinds, world, settings)
    found = render.render(kinds, world, settings, samples=samples, seed=seed)
    return Batches(found.mean, found.variance.mean(axis=0), found.seconds / (samples * settings.slots) * 1e9)


def deviations(one: Batches, other: Batches, regions: Mapping[str, np.ndarray]) -> dict[str, Deviation]:
    """Of `one` from `other`, whose seeds were the same, in each region, (height, width), bool."""
    difference = one.pictures - other.pictures
    return {
        name: deviation(difference[:, region], float(other.mean[region].mean()))
        for name, region in regions.items()
        if region.any()
    }


class Clock:
    """Processor time of kinds' formulas, each measured in turn with the first, so that what else the machine does hits both."""

    def __init__(self):
        keys = jax.random.split(jax.random.key(0))
        self._numbers = [jax.random.uniform(key, (4, _LANES), jnp.float32) for key in keys]
        self._first: Callable | None = None
        self._ns = 0.0

    def bounce(self, kind: Kind, rows: Rows) -> float:
        """Nanoseconds a bounce: one direction drawn, one evaluated. `rows`: of one material.

        Known directions are spread over the hemisphere.
        """

        def formulas(u, v):
            wi, light = (tuple(jax.vmap(materials.cosine_lobe, -1, -1)(pair)) for pair in (v[:2], v[2:]))
            return shading.bounce(kind, shading.row_of(rows, jnp.int32(0)), tuple(u), wi, light)

        return self._measure(formulas)

    def part(self, axis: str, option: str, rows: Rows) -> float:
        """Nanoseconds that a bounce spends in one form of G2, Fresnel or trigonometry."""
        row = Rows(*(field[0] for field in rows))
        forms: dict[str, Callable] = {
            "g2": lambda u: materials.G2_OF_G1[option](u[0], u[1]),
            "fresnel": lambda u: materials.FRESNEL_FORMS[option](row, u[0]),
            "trigonometry": lambda u: materials.TURNS[option](u[0]),
        }
        return USES[axis] * self._measure(lambda u, v: jax.vmap(forms[axis], -1)(u))

    def _measure(self, formulas: Callable) -> float:
        compiled = jax.jit(formulas).lower(*self._numbers).compile()
        if self._first is None:
            self._first, self._ns = compiled, min(self._time(compiled) for _ in range(_TURNS)) / _LANES * 1e9
            return self._ns
        ratios = [self._time(compiled) / self._time(self._first) for _ in range(_TURNS)]
        return float(np.median(ratios)) * self._ns

    def _time(self, compiled: Callable) -> float:
        begun = time.process_time()
        jax.block_until_ready(compiled(*self._numbers))
        return time.process_time() - begun
