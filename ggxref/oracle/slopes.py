"""Slope space: a slope is (-x_m / z_m, -y_m / z_m). Densities P22 per unit of slope area."""

from flint import arb

from ggxref.oracle.linalg import (
    ONE,
    Matrix,
    N,
    Vec3,
    Vector,
    apply,
    determinant,
    dot,
    inverse_transpose,
    norm,
    normalise,
)
from ggxref.oracle.masking import sigma_beckmann, sigma_ggx
from ggxref.oracle.precision import exactly, sign


def from_normal(wm: Vector) -> tuple[arb, arb]:
    """(-x / z, -y / z), z not 0. heitz2014 section 5.1."""
    x, y, z = wm
    if sign(z) == 0:
        raise ValueError("a normal on the horizon has no slope")
    return -x / z, -y / z


def to_normal(slope: Vector) -> Vec3:
    """(-x, -y, 1), normalised. heitz2014 section 5.1."""
    x, y = slope
    return normalise((-x, -y, ONE))


def stretch(w: Vector, factors: Vector) -> Vec3:
    """(fx x, fy y, z), normalised. heitz2014 section 5.2."""
    (x, y, z), (fx, fy) = w, factors
    with exactly():
        stretched = fx * x, fy * y, z
    return normalise(stretched)


def ggx(slope: Vector, alpha: Vector) -> arb:
    """1 / (pi ax ay (1 + x^2/ax^2 + y^2/ay^2)^2)."""
    (x, y), (ax, ay) = slope, alpha
    return 1 / (arb.pi() * ax * ay * (1 + (x / ax) ** 2 + (y / ay) ** 2) ** 2)


def beckmann(slope: Vector, alpha: Vector) -> arb:
    """exp(-x^2/ax^2 - y^2/ay^2) / (pi ax ay)."""
    (x, y), (ax, ay) = slope, alpha
    return (-((x / ax) ** 2) - (y / ay) ** 2).exp() / (arb.pi() * ax * ay)


def student_t(slope: Vector, alpha: Vector, gamma: arb) -> arb:
    """(g-1)^g / (pi ax ay (g-1 + x^2/ax^2 + y^2/ay^2)^g), g = gamma > 1. Ribardiere et al. 2017."""
    (x, y), (ax, ay) = slope, alpha
    return (gamma - 1) ** gamma / (arb.pi() * ax * ay * (gamma - 1 + (x / ax) ** 2 + (y / ay) ** 2) ** gamma)


def ellipsoid(slope: Vector, A: Matrix) -> arb:
    """z^4 D = 1 / (pi |A| |A n| |A^-T (-x, -y, 1)|^4). walter2014 (1) with heitz2014 section 5.1."""
    x, y = slope
    stretched = norm(apply(inverse_transpose(A), (-x, -y, ONE)))
    return 1 / (arb.pi() * abs(determinant(A)) * norm(apply(A, N)) * stretched**4)


def visible_ggx(slope: Vector, wi: Vector, alpha: Vector) -> arb:
    """max(0, -x_i x - y_i y + z_i) P22 / sigma(wi). heitz2014 (7) with its signs corrected."""
    facing = dot(wi, (-slope[0], -slope[1], ONE))
    if sign(facing) <= 0:
        return arb(0)
    return facing / norm(wi) * ggx(slope, alpha) / sigma_ggx(normalise(wi), alpha)


def visible_beckmann(slope: Vector, wi: Vector, alpha: Vector) -> arb:
    """max(0, -x_i x - y_i y + z_i) P22 / sigma(wi). heitz2014 (7) with its signs corrected."""
    facing = dot(wi, (-slope[0], -slope[1], ONE))
    if sign(facing) <= 0:
        return arb(0)
    return facing / norm(wi) * beckmann(slope, alpha) / sigma_beckmann(normalise(wi), alpha)
