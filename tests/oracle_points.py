"""Shapes, directions and comparisons for the tests of the oracle's samplers."""

from flint import arb

from ggxref.oracle.linalg import add, cross, negative, norm, scale
from ggxref.oracle.precision import exact

BITS = 400
STEP = arb(2) ** -100  # central differences are off by its square, 2^-200

ALPHA = exact((0.125, 0.75))
SKEWED = exact(((0.25, 0.125, 0.0625), (0.0, 0.5, -0.125), (0.125, 0.0, 1.25)))
MIRRORED = exact(((-0.25, 0.125, 0.0625), (0.0, 0.5, -0.125), (0.125, 0.0, 1.25)))
DIAGONAL = exact(((0.125, 0, 0), (0, 0.75, 0), (0, 0, 1)))

DIRECTIONS = {
    "plain": exact((0.5, -0.25, 0.75)),
    "normal": exact((0, 0, 2)),
    "grazing": exact((-1, 0.5, 0.001)),
    "below": exact((0.5, 0.25, -0.5)),
}


def same(a, b, digits=50):
    return abs(a - b) < arb(10) ** -digits


def alike(a, b, digits=50):
    return all(same(x, y, digits) for x, y in zip(a, b, strict=True))


def solid_angle(sample, u):
    """|dm / du|: the solid angle of normals per area of the unit square."""
    derivative = []
    for k in (0, 1):
        ahead, behind = (sample(tuple(x + sign * STEP * (j == k) for j, x in enumerate(u))) for sign in (1, -1))
        derivative.append(scale(1 / (2 * STEP), add(ahead, negative(behind))))
    return norm(cross(*derivative))
