"""Identities in ball arithmetic: the error of each is a proven bound on the distance of its two sides."""

from collections.abc import Callable, Sequence
from threading import Lock

from flint import acb, arb

from ggxref.oracle import integrate
from ggxref.oracle.linalg import add, apply, cross, dot, norm, normalise, scale
from ggxref.oracle.precision import exact, working
from ggxref.verify import engine

# 192 bits are 57 digits, of which the identities lose at most ten: every one of them is proven to more than 40 digits.
BITS = 192
PROVEN = 1e-40

# The working precision is one number for the whole process.
_PRECISION = Lock()

# Directions as exact multiples of unit vectors: oblique, at either azimuth, and grazing (87°).
DIRECTIONS = [(1, 2, 2), (-6, 2, 9), (3, -2, 6), (12, -12, 1)]
# Micronormals that face all of them.
NORMALS = [(0.125, 0.25, 1), (0.5, -0.25, 2), (-0.0625, -0.5, 1.5)]
ALPHAS = [(0.5, 0.125), (0.015625, 0.25), (1, 1), (2, 0.625)]
SHAPES = [
    ((0.5, 0.0625, 0.25), (-0.125, 0.75, 0.125), (0.125, -0.25, 1.5)),
    ((0.03125, 0, 0.015625), (0, -0.25, 0.0625), (0.25, 0.125, -1)),
]


def identity(
    paper: str,
    equation: str,
    statement: str,
    functions: str | Callable | Sequence,
    *,
    mutant: tuple[str, Callable],
    method: str = "exact",
    also: Sequence[str] = (),
):
    """Register the decorated body, which yields pairs of sides (balls or tuples of balls), as a check of the oracle."""

    def register(body):
        def error(*formulas):
            with _PRECISION, working(BITS):
                return max(distance(*sides) for sides in body(*formulas))

        engine.check(paper, equation, statement, method, functions, tolerance=PROVEN, mutant=mutant, also=also)(error)
        return body

    return register


def distance(got, expected) -> float:
    """Proven bound on |got - expected|, relative where the expected side is above 1; the largest of a tuple's."""
    if isinstance(got, tuple | list):
        return max(distance(g, e) for g, e in zip(got, expected, strict=True))
    got, expected = arb(got), arb(expected)
    # The nearest double may lie below the bound; a billionth is more than its rounding.
    return float((got - expected).abs_upper() / (1 + expected.abs_lower())) * (1 + 1e-9)


def directions(rows=DIRECTIONS):
    """The unit vectors along integer or dyadic ones, as balls."""
    return [normalise(exact(row)) for row in rows]


def fronts(rows=DIRECTIONS):
    """Every direction with every micronormal that it sees."""
    return [(i, m) for i in directions(rows) for m in directions(NORMALS) if dot(i, m) > 0]


def reflections():
    """Pairs of directions above the horizon with their half vector."""
    found = directions()
    return [(i, o, normalise(add(i, o))) for i in found for o in found if i is not o]


def tangents(x):
    """Two orthonormal vectors perpendicular to the unit x."""
    t = normalise(cross(x, exact((0.25, 1, -0.5))))
    return t, cross(x, t)


def unit_derivative(s, ds):
    """Derivative of s/‖s‖ along ds."""
    h = normalise(s)
    return scale(1 / norm(s), add(ds, scale(-dot(h, ds), h)))


def area(first, second):
    """Area of the parallelogram that two derivatives span."""
    return norm(cross(first, second))


def integral(f: Callable, low, high) -> arb:
    """Certified integral of f(x), analytic and without branch cuts near the real interval."""
    return integrate.integral(lambda x, _: acb(f(x)), arb(low), arb(high))


__all__ = [
    "ALPHAS",
    "BITS",
    "DIRECTIONS",
    "NORMALS",
    "SHAPES",
    "add",
    "apply",
    "area",
    "cross",
    "directions",
    "dot",
    "exact",
    "fronts",
    "identity",
    "integral",
    "norm",
    "normalise",
    "reflections",
    "scale",
    "tangents",
    "unit_derivative",
]
