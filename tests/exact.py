"""How far a result is from the exact one for the very inputs that were given, and how far those inputs excuse it."""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from ggxref.oracle.precision import working

BITS = 256
# Relative step of the difference quotients: their own error is 2^-80 of a second derivative.
STEP = arb(2) ** -80

Oracle = Callable[[Mapping[str, Any]], Any]


class Error(NamedTuple):
    """Of one point: vectors and matrices in the maximum norm."""

    relative: float
    ulp: float  # absolute error over the spacing of the dtype at the exact result
    condition: float  # sum over the inputs' components of |x ∂f/∂x| / |f|

    @property
    def over_condition(self) -> float:
        return self.relative / max(1.0, self.condition)


NONE = Error(0.0, 0.0, 0.0)


def balls(x: Any) -> Any:
    """An array as nested tuples of exact balls."""
    return tuple(map(balls, x)) if np.ndim(x) else arb(float(x))


def leaves(x: Any) -> Iterator[Any]:
    if isinstance(x, tuple):
        for part in x:
            yield from leaves(part)
    else:
        yield x


def perturbed(x: Any, step: arb) -> Iterator[Any]:
    """The input with one of its numbers after the other multiplied by 1 + step."""
    if not isinstance(x, tuple):
        yield x * (1 + step)
        return
    for i, part in enumerate(x):
        for changed in perturbed(part, step):
            yield (*x[:i], changed, *x[i + 1 :])


def moved(x: Any, way: Any, step: arb) -> Any:
    """The input, `step` along a way of its own shape."""
    return tuple(moved(a, b, step) for a, b in zip(x, way, strict=True)) if isinstance(x, tuple) else x + step * way


def largest(values: list[arb]) -> float:
    return max(abs(float(v.mid())) for v in values)


def condition(oracle: Oracle, inputs: Mapping[str, Any], value: list[arb], steps: tuple[arb, ...] = (STEP,)) -> float:
    """Relative condition number with respect to every number of the inputs, from the worst of the steps for each.

    Infinite where a result of 0 is not stable, or a step leaves the domain.
    """
    changes = [arb(0)] * len(value)
    for argument, x in inputs.items():
        moved = [[*perturbed(x, step)] for step in steps]
        for variants in zip(*moved, strict=True):
            worst = [arb(0)] * len(value)
            for step, y in zip(steps, variants, strict=True):
                there = leaves(oracle({**inputs, argument: y}))
                worst = [w.max(abs((m - f) / step)) for w, m, f in zip(worst, there, value, strict=True)]
            changes = [c + w for c, w in zip(changes, worst, strict=True)]
    change, size = largest(changes), largest(value)
    if size == 0:
        return math.inf if change else 0.0
    return change / size if math.isfinite(change) else math.inf


def corners(oracle: Oracle, inputs: Mapping[str, Any], value: list[arb], step: arb, count: int = 16) -> float:
    """What `condition` is for all numbers moved at once, each up or down by the step: worst of a few seeded draws.

    A decision can lie nearer to the input than any single number's step shows.
    """
    signs = np.random.default_rng(1)

    def moved(x: Any) -> Any:
        return tuple(map(moved, x)) if isinstance(x, tuple) else x * (1 + step * int(signs.choice((-1, 1))))

    draws = ([*leaves(oracle({argument: moved(x) for argument, x in inputs.items()}))] for _ in range(count))
    change = max(largest([m - f for m, f in zip(draw, value, strict=True)]) for draw in draws)
    size = largest(value)
    return change / float(step) / size if size else math.inf


def error(oracle: Oracle, inputs: Mapping[str, np.ndarray], got: list[float], info: Any, limit: float) -> Error:
    """Error of the result `got` (its numbers in order) for one point of inputs, the condition of which is taken to first
    order; where the error is above `limit` times that, over a box of half an ulp as well: near a branch or a root's
    end, the derivative does not tell.

    Subnormal intermediates may be flushed to 0 (XLA does), so a result below `tiny / eps` may be off by `tiny / eps`
    spacings; an overflow to infinity must be one.
    """
    with working(BITS):
        exact_inputs = {argument: balls(x) for argument, x in inputs.items()}
        value = [*leaves(oracle(exact_inputs))]
        if not all(v.is_finite() for v in value):
            same = all(math.isinf(g) and (g > 0) == (v > 0) for g, v in zip(got, value, strict=True))
            return NONE if same else Error(math.inf, math.inf, 0.0)
        size = largest(value)
        tiny, eps, spacings = float(info.tiny), float(info.eps), 0.0
        if not all(map(math.isfinite, got)):
            if size > float(info.max):
                return NONE
            relative = spacings = math.inf
        else:
            miss = largest([arb(g) - v for g, v in zip(got, value, strict=True)])
            if miss == 0 or (size < tiny / eps and miss <= tiny / eps):
                return NONE
            relative = miss / size if size else math.inf
            spacings = miss / 2.0 ** (math.floor(math.log2(size)) - info.nmant) if size else math.inf
        found = Error(relative, spacings, condition(oracle, exact_inputs, value))
        if found.over_condition > limit:
            half = arb(eps) / 2
            found = Error(relative, spacings, condition(oracle, exact_inputs, value, (STEP, half, -half)))
        if found.over_condition > limit:
            found = Error(relative, spacings, max(found.condition, corners(oracle, exact_inputs, value, half)))
        return found
