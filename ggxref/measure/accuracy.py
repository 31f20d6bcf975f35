"""How far a function, as compiled, is from the exact value of its formula: in ULPs, or for directions in units of ε/2.

A subject is a function of one point; a reference takes the same arguments as double-double components. The error is
split: what half an ulp of the inputs explains is ill-conditioning, the rest is the form's own (`excess`).
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import jax
import ml_dtypes
import numpy as np

from ggxref.measure.doubledouble import DD
from ggxref.measure.regions import REGIONS, Points, rounded

DTYPES: dict[str, Any] = {"f64": np.float64, "f32": np.float32, "bf16": ml_dtypes.bfloat16, "f16": np.float16}
BLOCK = 1 << 13  # double-double temporaries of one block stay in the second-level cache
EXAMINED = 512  # points with the largest errors whose input boxes are looked at


@dataclass(frozen=True)
class Accuracy:
    """Errors over one region: in ULPs of the exact value, or `unit = "half eps"` for the norm of a direction's error.

    `worst` is the largest error found by sampling and search, so a lower bound of the true maximum. `excess` is the
    largest error beyond the image of the inputs' ±1/2-ulp box (to first order) among the points examined, and
    `excess_bound` bounds it over all the points that were drawn.
    """

    quantity: str
    variant: str
    dtype: str
    region: str
    unit: str
    count: int
    median: float
    p999: float
    sampled: float
    worst: float
    worst_input: str
    excess: float
    excess_bound: float
    nan: int
    inf: int
    wrong_zero: int
    wrong_sign: int
    flushed: int


def arguments(function: Callable) -> tuple[str, ...]:
    """Names of the positional arguments."""
    parameters = inspect.signature(function).parameters.values()
    return tuple(p.name for p in parameters if p.kind is not p.KEYWORD_ONLY)


@cache
def compiled(function: Callable) -> Callable:
    """The function over points in the last axis of all its arguments, under `jit` with default flags."""
    mapped = jax.jit(jax.vmap(function, in_axes=-1, out_axes=-1))

    def run(*args):
        with jax.enable_x64(args[0].dtype == np.float64):
            return np.asarray(mapped(*args))

    return run


def _wide(a: np.ndarray):
    """Double-double components: an array per number, nested as the argument is."""
    return DD(a, np.zeros_like(a)) if a.ndim == 1 else tuple(_wide(row) for row in a)


def _blocks(args) -> list[list]:
    n = args[0].shape[-1]
    wide = [a.astype(np.float64) for a in args]
    return [[_wide(a[..., i : i + BLOCK]) for a in wide] for i in range(0, n, BLOCK)]


def _stacked(value, n) -> DD:
    parts = value if isinstance(value, tuple) else (value,)
    hi, lo = (np.stack([np.broadcast_to(getattr(p, side), n) for p in parts]) for side in ("hi", "lo"))
    return DD(hi, lo) if isinstance(value, tuple) else DD(hi[0], lo[0])


def exact(reference: Callable, args) -> DD:
    """The reference over points in the last axis; a direction's components become rows."""
    sizes = [min(BLOCK, args[0].shape[-1] - i) for i in range(0, args[0].shape[-1], BLOCK)]
    with np.errstate(all="ignore"):
        values = [_stacked(reference(*block), n) for block, n in zip(_blocks(args), sizes, strict=True)]
    return DD(*(np.concatenate([getattr(v, side) for v in values], axis=-1) for side in ("hi", "lo")))


def in_units(difference: np.ndarray, truth: np.ndarray, dtype) -> np.ndarray:
    """Scalars: ulps of the exact value, at least of the smallest normal number. Directions: the norm over ε/2."""
    info = ml_dtypes.finfo(dtype)
    if difference.ndim == 2:
        return np.sqrt((difference**2).sum(0)) * 2 / float(info.eps)
    size = np.maximum(np.abs(truth), float(info.smallest_normal))
    return np.ldexp(np.abs(difference), info.nmant + 1 - np.frexp(size)[1])


def _leaves(wide):
    return [wide] if isinstance(wide, DD) else [leaf for part in wide for leaf in _leaves(part)]


def box(reference: Callable, args, dtype) -> np.ndarray:
    """Half width of the image of the inputs' ±1/2-ulp box, to first order, in the units of `in_units`."""
    return np.concatenate([_box(reference, block, dtype) for block in _blocks(args)])


def _box(reference, block, dtype):
    info = ml_dtypes.finfo(dtype)
    with np.errstate(all="ignore"):
        truth = _stacked(reference(*block), len(_leaves(block[0])[0].hi)).hi
        total = np.zeros(truth.shape[-1])
        for leaf in (leaf for arg in block for leaf in _leaves(arg)):
            # An eighth of the half ulp each way, carried by the low part: the image is linear at that scale.
            step = np.where(leaf.hi == 0, 0, np.ldexp(1.0, np.frexp(leaf.hi)[1] - info.nmant - 5))
            ends = []
            for leaf.lo in (step, -step):
                ends.append(_stacked(reference(*block), len(step)))
            leaf.lo = np.zeros_like(step)
            moved = (ends[0].hi - ends[1].hi) + (ends[0].lo - ends[1].lo)
            total += 4 * in_units(moved, truth, dtype)
    return total


# Smaller numbers have no double-double: their low part is subnormal.
FAINTEST = 1e-270


@dataclass(frozen=True)
class Faults:
    """Results that no rounding explains; `flushed` is the hardware's: 0 for an exact value below the normal range."""

    nan: int = 0
    inf: int = 0
    wrong_zero: int = 0
    wrong_sign: int = 0
    flushed: int = 0

    def __add__(self, other: "Faults") -> "Faults":
        return Faults(*(a + b for a, b in zip(vars(self).values(), vars(other).values(), strict=True)))


def errors(run: Callable, reference: Callable, args, dtype) -> tuple[np.ndarray, np.ndarray, Faults]:
    """Error of each point, whether it is graded, and the faults. A fault's error is infinite.

    Not graded: points whose exact value is infinite or beyond the dtype's range, or was flushed; in float64 also those
    below 1e-270, where a double-double has no low part left.
    """
    computed, truth = run(*args).astype(np.float64), exact(reference, args)
    info = ml_dtypes.finfo(dtype)
    size = np.abs(truth.hi)
    scalar = truth.hi.ndim == 1
    faint = (np.maximum(size, np.abs(computed)) < FAINTEST) & (computed != truth.hi) & scalar
    graded = np.isfinite(truth.hi) & (size <= float(info.max))
    nan, inf = np.isnan(computed) & graded, np.isinf(computed) & graded
    zero = (computed == 0) & (size >= float(info.smallest_normal)) & graded & scalar
    sign = (computed * truth.hi < 0) & graded & scalar
    with np.errstate(invalid="ignore"):
        error = in_units((computed - truth.hi) - truth.lo, truth.hi, dtype)
    flushed = (computed == 0) & (size > 0) & (size < float(info.smallest_normal)) & scalar
    flat = [f if scalar else f.any(0) for f in (nan, inf, zero, sign, flushed)]
    graded = graded & ~flushed & ~faint if scalar else graded.all(0)
    error = np.where(flat[0] | flat[1], np.inf, error)
    return error, graded, Faults(*(int(f.sum()) for f in flat))


def _mutated(points: Points, rng) -> Points:
    """Points near the given ones, each by its own relative step; `rounded` makes directions unit again."""
    n = next(iter(points.values())).shape[-1]
    scale = 2.0 ** rng.uniform(-24, -2, n)
    moved = {k: p.astype(np.float64) * (1 + scale * rng.normal(size=p.shape)) for k, p in points.items()}
    for name in moved:
        if name in ("u", "f0", "g1_i", "g1_o", "x"):
            moved[name] = np.clip(moved[name], 0, 1)
        if name == "cos_i":
            moved[name] = np.clip(moved[name], -1, 1)
    return moved


def tied(points: Points) -> Points:
    """Isotropic: αy = αx."""
    alpha = points["alpha"]
    return points | {"alpha": np.stack([alpha[0], alpha[0]])}


def search(
    run, reference, names, worst: Points, dtype, rng, rounds: int, change: Callable = dict
) -> tuple[float, list[np.ndarray]]:
    """Climb from the worst points found, the worst first: mutate, keep the worst, again. The largest error and its input."""
    best, found = [worst[name] for name in names], 0.0
    keep = best[0].shape[-1]
    for _ in range(rounds):
        parents = {name: np.tile(a, 8) for name, a in zip(names, best, strict=True)}
        children = change(rounded(_mutated(parents, rng), dtype))
        pool = [np.concatenate([a, children[name]], axis=-1) for name, a in zip(names, best, strict=True)]
        error, graded, _ = errors(run, reference, pool, dtype)
        order = np.argsort(np.where(graded, error, -1))[::-1][:keep]
        best, found = [a[..., order] for a in pool], float(error[order[0]])
    return found, [a[..., 0] for a in best]


def measure(
    quantity: str,
    variant: str,
    function: Callable,
    reference: Callable,
    *,
    dtype: str = "f32",
    region: str = "typical",
    count: int = 1 << 20,
    seed: int = 0,
    rounds: int = 6,
    draws: tuple[str, ...] | None = None,
    isotropic: bool = False,
) -> Accuracy:
    """Grade `function` against `reference` on `count` seeded points of a region, then search for a worse one.

    `draws` names the region's points that serve as arguments, where they are not the arguments' own names.
    """
    rng = np.random.default_rng([seed, *region.encode()])
    kind = DTYPES[dtype]
    run, names = compiled(function), draws or arguments(function)
    chunk = min(count, 1 << 17)
    change = tied if isotropic else dict
    every, kept, faults = [], [], Faults()
    for _ in range(0, count, chunk):
        drawn = change(rounded(REGIONS[region](rng, chunk), kind))
        args = [drawn[name] for name in names]
        error, graded, found = errors(run, reference, args, kind)
        every.append(error[graded])
        top = np.argsort(np.where(graded, error, -1))[::-1][:EXAMINED]
        kept.append((error[top], [a[..., top] for a in args]))
        faults += found
    error = np.concatenate(every)
    top_error = np.concatenate([e for e, _ in kept])
    top = np.argsort(top_error)[::-1][:EXAMINED]
    args = [np.concatenate(parts, axis=-1)[..., top] for parts in zip(*(a for _, a in kept), strict=True)]
    own = top_error[top] - box(reference, args, kind)
    excess = max(0.0, float(np.nanmax(own)))
    rest = float(top_error[top][-1]) if len(error) > EXAMINED else 0.0
    seeds = {name: a[..., :64] for name, a in zip(names, args, strict=True)}
    worst, where = search(run, reference, names, seeds, kind, rng, rounds, change)
    return Accuracy(
        quantity=quantity,
        variant=variant,
        dtype=dtype,
        region=region,
        unit="ulp" if np.ndim(exact(reference, [a[..., :1] for a in args]).hi) == 1 else "half eps",
        count=len(error),
        median=float(np.sort(error)[len(error) // 2]),
        p999=float(np.sort(error)[int(0.999 * len(error))]),  # `quantile` would take inf - inf
        sampled=float(error.max()),
        worst=max(worst, float(error.max())),
        worst_input=described(names, where),
        excess=excess,
        excess_bound=max(excess, rest),
        **vars(faults),
    )


def described(names, values) -> str:
    """An input that can be typed in again: shortest decimals that round to the same number."""
    text = (f"{n}={np.array2string(np.asarray(v), separator=',')}" for n, v in zip(names, values, strict=True))
    return " ".join(" ".join(text).split())
