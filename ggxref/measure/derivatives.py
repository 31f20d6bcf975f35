"""How far a derivative in float32, as compiled, is from the exact one, where the rounding of the inputs leaves it its digits.

The subject is the Jacobian by reverse mode, cut into a block for each argument; each α is a block by itself, as one may be 10⁴
times the other. An error is the norm of a block's error over that of the exact block. The library's own derivative in
float64 at the same inputs stands for the exact one: `proof` compares it with difference quotients of the oracle.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from flint import arb

from ggxref.measure.accuracy import arguments, compiled, described
from ggxref.measure.regions import DIRECTIONS, REGIONS, Points, rounded
from ggxref.oracle.precision import exact, lookup, raised

WELL = 1e-5  # a block that the inputs' ±1/2-ulp box moves by more is ill-conditioned
CORNERS = 4  # of that box, drawn at random
SUSPECTS = 64  # points of a batch, the worst, whose worst corner is looked for
FLOOR = 1e-30  # below, a value or components of a float32 block may be flushed
BLOCK = 1 << 14


@dataclass(frozen=True)
class Derivative:
    """Of one function in one region: errors are relative, of the well-conditioned blocks alone.

    `ill` counts points with an ill-conditioned block, `not_finite` those with a derivative that is not, where the value is,
    or with a reference that is not.
    """

    function: str
    region: str
    points: int
    ill: int
    p999: float
    worst: float
    worst_block: str
    worst_input: str
    not_finite: int
    fault_input: str


@cache
def jacobian(function: Callable) -> Callable:
    """All numbers of the result, (out, 1 + in): the value, then its derivatives by every number of the arguments."""

    def numbers(*args):
        parts = [x for x in jax.tree.leaves(function(*args)) if jnp.issubdtype(x.dtype, jnp.floating)]
        return jnp.concatenate([jnp.ravel(x) for x in parts])

    def both(*args):
        value, pull = jax.vjp(numbers, *args)
        parts = jax.vmap(pull)(jnp.eye(len(value), dtype=value.dtype))
        return jnp.concatenate([value[:, None], *(p.reshape(len(value), -1) for p in parts)], axis=1)

    return both


def blocks(names: tuple[str, ...], args) -> dict[str, slice]:
    """Columns of `jacobian` that are one block."""
    found, start = {}, 1
    for name, a in zip(names, args, strict=True):
        size = int(np.prod(a.shape[:-1]))
        if name in ("alpha", "factors"):
            found |= {f"{name}[{k}]": slice(start + k, start + k + 1) for k in range(size)}
        else:
            found[name] = slice(start, start + size)
        start += size
    return found


def points(region: str, rng: np.random.Generator, n: int) -> Points:
    """Those of the region and, made from them, what functions without a reference take."""
    p = REGIONS[region](rng, n)
    A = p["A"]
    shares = np.stack([p["u"][0], p["u"][1], p["x"], p["g1_i"], p["g1_o"], p["f0"]])
    (a, b), (_, d) = A[0, :2], A[1, :2]
    scatter = np.stack([a * a, a * b, a * b, b * b + d * d]).reshape(2, 2, -1)
    return p | {
        "u3": shares[:3],
        "rows": shares.reshape(3, 2, -1),
        "factors": p["alpha"],
        "angles": 6 * shares[:3] - 3,
        "mean": -A[2, :2],
        "scatter": scatter,
        "D": p["size"],
        "G2": p["g1_i"],
        "g2": p["g1_o"],
        "F": p["f0"],
    }


def _norms(jacobians: np.ndarray, cut: dict[str, slice]) -> np.ndarray:
    """Of each block at each point: (blocks, points). Scaled before it is squared."""
    parts = [np.abs(jacobians[:, s]) for s in cut.values()]
    scale = [np.where((k := p.max((0, 1))) > 0, k, 1) for p in parts]
    return np.stack([np.sqrt(((p / k) ** 2).sum((0, 1))) * k for p, k in zip(parts, scale, strict=True)])


def half_ulp(x: np.ndarray) -> np.ndarray:
    """In float64; 0 for 0."""
    return np.where(x == 0, 0, np.ldexp(1.0, np.frexp(x)[1] - np.finfo(x.dtype).nmant - 2))


def worst_corner(truth: Callable, args, which: np.ndarray, cut: dict[str, slice]) -> np.ndarray:
    """How far a corner of the inputs' ±1/2-ulp box moves each block at the points `which`, to first order: (blocks, which).

    Of the corners, those that move a number of the block the farthest.
    """
    total, each = args[0].shape[-1], len(which)
    flat = [a.reshape(-1, total)[:, which] for a in args]
    numbers, steps = np.concatenate(flat).astype(np.float64), np.concatenate([half_ulp(a) for a in flat])
    moved = numbers[:, None] + np.eye(len(numbers), len(numbers) + 1)[:, :, None] * steps[:, None]  # the last is not
    moved = np.pad(moved.reshape(len(numbers), -1), ((0, 0), (0, max(0, total - moved[0].size))), "edge")
    ends = np.cumsum([len(f) for f in flat])[:-1]
    jacobians = truth(*(part.reshape(*a.shape[:-1], -1) for part, a in zip(np.split(moved, ends), args, strict=True)))
    found = []
    for s in cut.values():
        part = jacobians[:, s, : (len(numbers) + 1) * each].reshape(-1, len(numbers) + 1, each)
        changes = part[:, :-1] - part[:, -1:]
        corners = np.einsum("cmp,dmp->cdp", np.sign(changes), changes)
        found.append(np.sqrt((corners**2).sum(1)).max(0))
    return np.stack(found)


def errors(run: Callable, truth: Callable, args, cut: dict[str, slice], rng: np.random.Generator):
    """Of each block at each point: relative error, −1 where it is not graded, and whether it is ill-conditioned; then
    whether, where the value is finite, a derivative or a number of the reference is not.
    """
    computed, wide = run(*args).astype(np.float64), [a.astype(np.float64) for a in args]
    with np.errstate(all="ignore"):
        exactly = truth(*wide)
        size = _norms(exactly, cut)
        change = np.zeros_like(size)
        for _ in range(CORNERS):
            moved = [w + half_ulp(a) * rng.choice([-1.0, 1.0], w.shape) for w, a in zip(wide, args, strict=True)]
            change = np.maximum(change, _norms(truth(*moved) - exactly, cut))  # NaN is ill-conditioned
        error = _norms(computed - exactly, cut) / size
        value = np.abs(exactly[:, 0]).max(0)
        seen = (size > FLOOR) & (size < float(np.finfo(args[0].dtype).max)) & ((value > FLOOR) | (value == 0))
        graded = np.where(change <= WELL * size, error, -1).max(0)
        which = np.argsort(graded)[: -min(SUSPECTS, len(graded)) - 1 : -1]
        change[:, which] = np.maximum(change[:, which], worst_corner(truth, args, which, cut))
        ill = seen & ~(change <= WELL * size)
    finite = np.isfinite(computed)
    fault = finite[:, 0].all(0) & ~(finite & np.isfinite(exactly)).all((0, 1))
    return np.where(seen & ~ill & finite[:, 0].all(0), np.where(np.isnan(error), np.inf, error), -1), ill, fault


def measure(
    name: str, function: Callable, draws: tuple[str, ...], region: str, count: int, exactly: Callable | None = None
) -> Derivative:
    """Grade float32 derivatives of `function` by those in float64 of `exactly`, which is the function itself unless given."""
    rng = np.random.default_rng([0, *region.encode()])
    names, run, truth = arguments(function), compiled(jacobian(function)), compiled(jacobian(exactly or function))
    every, ill, faults, worst, block, where, first = [], 0, 0, 0.0, "", "", ""
    for _ in range(0, count, BLOCK):
        drawn = rounded(points(region, rng, min(count, BLOCK)), np.float32)
        args = [drawn[d] for d in draws]
        cut = blocks(names, args)
        error, unsteady, fault = errors(run, truth, args, cut, rng)
        b, k = np.unravel_index(np.argmax(error), error.shape)
        if error[b, k] > worst:
            worst, block = float(error[b, k]), list(cut)[b]
            where = described(names, [a[..., k] for a in args])
        if fault.any() and not first:
            first = described(names, [a[..., np.argmax(fault)] for a in args])
        every.append(error.max(0))
        ill, faults = ill + int(unsteady.any(0).sum()), faults + int(fault.sum())
    found = np.sort(np.concatenate(every))
    found = found[found >= 0]
    p999 = float(found[int(0.999 * len(found))]) if len(found) else 0.0
    return Derivative(name, region, count, ill, p999, worst, block, where, faults, first)


STEP = arb(2) ** -80  # what it leaves of the third derivative is below 1e-48


def _moved(x, change, step):
    return (
        tuple(_moved(a, b, step) for a, b in zip(x, change, strict=True)) if isinstance(x, tuple) else x + step * change
    )


def _leaves(value) -> list:
    return [leaf for part in value for leaf in _leaves(part)] if isinstance(value, tuple) else [value]


def quotient(name: str, inputs: Mapping[str, Any], argument: str, change: np.ndarray) -> np.ndarray:
    """The oracle's central difference along a change of one argument: a float for each number of the result."""
    oracle, start, along = lookup(name), {a: exact(x) for a, x in inputs.items()}, exact(change)

    def difference():
        ends = (oracle(**start | {argument: _moved(start[argument], along, sign * STEP)}) for sign in (1, -1))
        above, below = (_leaves(end if not name.split(".")[-1].startswith("sample_rej") else end[0]) for end in ends)
        return np.array([float(((a - b) / (2 * STEP)).mid()) for a, b in zip(above, below, strict=True)])

    return raised(difference, 320, name, inputs)


def proof(name: str, function: Callable, draws: tuple[str, ...], region: str, count: int, **options: str) -> np.ndarray:
    """Errors of the float64 derivative of the public function `name` against the oracle, relative to the block's size.

    `function` is the public one with the `options`, if there are any.

    Each block of each point is applied to one random change of its argument: a direction's in the plane perpendicular to
    it, as the oracle normalises and the library need not.
    """
    rng = np.random.default_rng([1, *region.encode()])
    drawn, names = points(region, rng, count), arguments(function)
    args = [drawn[d].astype(np.float64) for d in draws]
    jacobians, found = compiled(jacobian(function))(*args), []
    for block, cut in blocks(names, args).items():
        argument = block.partition("[")[0]
        a = names.index(argument)
        for k in range(count):
            x = args[a][..., k]
            change = np.cross(x, rng.normal(size=3)) if draws[a] in DIRECTIONS else x * rng.uniform(-1, 1, x.shape)
            change = np.asarray(change)
            if draws[a] == "scatter":
                change = (change + change.T) / 2
            if argument != block:  # one number of the argument
                change = np.where(np.arange(len(x)) == int(block[-2]), x, 0)
            inputs = {n: b[..., k] for n, b in zip(names, args, strict=True)} | options
            columns = jacobians[:, cut, k]
            along = np.ravel(change) if argument == block else change[int(block[-2])][None]
            expected = quotient(name, inputs, argument, change)
            size = max(np.linalg.norm(columns) * np.linalg.norm(along), np.abs(expected).max())
            if not size <= FLOOR:
                error = np.abs(columns @ along - expected).max() / size
                found.append(error if np.isfinite(error) else np.inf)
    return np.array(found)
