"""Means over any number of samples in constant memory, on all devices of all processes.

Samples are numbered. A block of them is drawn from its own number, evaluated and summed in one compiled kernel; block sums
are added without rounding. So the result depends on neither the number of devices and processes nor on their order.
"""

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
from jax.experimental import multihost_utils
from jax.sharding import Mesh, PartitionSpec

BLOCK = 1 << 14
# Blocks that a device computes between two visits of the host: some 4 ms of work, against 0.2 ms for the visit, and few
# enough that their numbers stay in a core's cache.
BATCH = 16
# Doubles that carry a sum of up to 2^40 doubles of like size without rounding.
_PARTS = 8


@dataclass(frozen=True)
class Estimate:
    """A mean, its standard error by the samples' own spread, and their number."""

    mean: float
    error: float
    count: int


def mean(
    integrand: Callable, count: int, *, name: str, about: float = 0.0, numbers: int = 2, points: str = "random"
) -> Estimate:
    """Mean of `integrand` of `numbers` uniform float32 numbers over at least `count` samples, whole blocks of them.

    - `integrand`: of one point, in JAX; kept compiled while it lives.
    - `name`: seeds the random numbers.
    - `about`: a number near the mean, taken in float32: deviations from it are summed, so that their squares do not cancel.
    - `points`: "random" (SplitMix64), or "lattice" (Roberts' R2 sequence, two numbers), whose `error` is no bound.
    """
    blocks = -(-count // BLOCK)
    seed = zlib.crc32(name.encode())
    first, second = _shared(_block_sums(integrand, seed, about, numbers, points, blocks))
    n = blocks * BLOCK
    average, about = first / n, float(np.float32(about))
    spread = max(second / n - average**2, Fraction(0))
    return Estimate(float(average + Fraction(about)), float(spread / n) ** 0.5, n)


def _block_sums(integrand, seed, about, numbers, points, blocks) -> Iterator[np.ndarray]:
    """Sums of deviations and of their squares, (2,) each, of the blocks that fall to this process."""
    devices = jax.local_devices()
    kernel = _kernel(integrand, about, numbers, points, tuple(devices))
    step = BATCH * len(devices)
    with jax.enable_x64(True):
        for start in range(jax.process_index() * step, blocks, jax.process_count() * step):
            # All batches have one size, so that one kernel serves; blocks beyond the last are computed and left out.
            index = np.arange(start, start + step, dtype=np.uint32)
            yield from np.asarray(kernel(index, np.uint32(seed)))[: max(0, blocks - start)]


@cache
def _kernel(integrand, about, numbers, points, devices):
    draw = _random if points == "random" else _lattice

    def block(index, seed):
        u = draw(seed, index, numbers)
        # Rows: the order of additions is fixed, and short sums lose few digits.
        rows = (jax.vmap(integrand, in_axes=-1)(u) - jnp.float32(about)).reshape(-1, 128)
        # Two sums apart: for an array that holds both terms XLA computes the integrand twice, a number at a time.
        return jnp.stack([jnp.sum(x, axis=-1, dtype=jnp.float64).sum() for x in (rows, rows * rows)])

    def blocks(index, seed):
        # Not a loop: XLA's kernels within one are slower by a half.
        return jax.vmap(block, in_axes=(0, None))(index, seed)

    split, whole = PartitionSpec("block"), PartitionSpec()
    mesh = Mesh(np.array(devices), ("block",))
    return jax.jit(jax.shard_map(blocks, mesh=mesh, in_specs=(split, whole), out_specs=split))


def _random(seed, index, numbers):
    """SplitMix64 (Steele, Lea & Flood 2014, which passes BigCrush) of the number of a pair: two numbers of 24 bits.

    A seed owns 2³² pairs; beyond them come the next seed's.
    """
    pairs = -(-numbers // 2)
    place = jnp.arange(pairs * BLOCK, dtype=jnp.uint64) + index.astype(jnp.uint64) * jnp.uint64(pairs * BLOCK)
    z = (place + (seed.astype(jnp.uint64) << 32)) * jnp.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> 30)) * jnp.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> 27)) * jnp.uint64(0x94D049BB133111EB)
    z = (z ^ (z >> 31)).reshape(pairs, BLOCK)
    bits = jnp.stack([z >> 40, z & jnp.uint64(0xFFFFFF)], axis=1).reshape(2 * pairs, BLOCK)[:numbers]
    return bits.astype(jnp.uint32).astype(jnp.float32) * jnp.float32(2.0**-24)


def _lattice(seed, index, numbers):
    """Multiples of 2³²/φ and 2³²/φ² (φ³ = φ + 1), of which the top 24 bits are kept; shifted by the seed."""
    del numbers
    k = index * jnp.uint32(BLOCK) + jnp.arange(BLOCK, dtype=jnp.uint32)
    steps = jnp.array([[3242174889], [2447445414]], jnp.uint32)
    return ((k * steps + seed) >> 8).astype(jnp.float32) * jnp.float32(2.0**-24)


def _shared(sums: Iterator[np.ndarray]) -> tuple[Fraction, Fraction]:
    """Exact totals over the blocks of all processes."""
    totals = [Fraction(0), Fraction(0)]
    for pair in sums:
        totals = [t + Fraction(float(x)) for t, x in zip(totals, pair, strict=True)]
    if jax.process_count() > 1:
        parts = np.array([_split(t) for t in totals]).view(np.uint32)
        gathered = np.asarray(multihost_utils.process_allgather(parts)).view(np.float64)
        totals = [sum(map(Fraction, gathered[:, k].ravel().tolist()), Fraction(0)) for k in (0, 1)]
    return totals[0], totals[1]


def _split(total: Fraction) -> list[float]:
    """Doubles that add up to the total exactly."""
    parts = []
    for _ in range(_PARTS):
        parts.append(float(total))
        total -= Fraction(parts[-1])
    if total:
        raise ArithmeticError(f"a sum needs more than {_PARTS} doubles: {total}")
    return parts
