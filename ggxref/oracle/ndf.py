"""The distributions of normals D [1/sr], 0 where z_m <= 0."""

from flint import arb

from ggxref.oracle.linalg import Matrix, N, Vector, apply, determinant, inverse_transpose, norm, normalise
from ggxref.oracle.precision import sign


def hemisphere(wm: Vector) -> arb:
    """1 / pi above the horizon. dupuy2023 (3)."""
    return arb(0) if sign(wm[2]) <= 0 else 1 / arb.pi()


def ggx(wm: Vector, alpha: Vector) -> arb:
    """1 / (pi ax ay (x^2/ax^2 + y^2/ay^2 + z^2)^2). tokuyoshi2024, the definition of D."""
    if sign(wm[2]) <= 0:
        return arb(0)
    (x, y, z), (ax, ay) = normalise(wm), alpha
    return 1 / (arb.pi() * ax * ay * ((x / ax) ** 2 + (y / ay) ** 2 + z**2) ** 2)


def beckmann(wm: Vector, alpha: Vector) -> arb:
    """exp(-(x^2/ax^2 + y^2/ay^2) / z^2) / (pi ax ay z^4): P22 over z^4, heitz2014 section 5.1."""
    if sign(wm[2]) <= 0:
        return arb(0)
    (x, y, z), (ax, ay) = normalise(wm), alpha
    return (-((x / ax) ** 2 + (y / ay) ** 2) / z**2).exp() / (arb.pi() * ax * ay * z**4)


def student_t(wm: Vector, alpha: Vector, gamma: arb) -> arb:
    """(g-1)^g / (pi ax ay z^4 (g-1 + (x^2/ax^2 + y^2/ay^2)/z^2)^g), g = gamma > 1. Ribardiere et al. 2017."""
    if sign(wm[2]) <= 0:
        return arb(0)
    (x, y, z), (ax, ay) = normalise(wm), alpha
    q = ((x / ax) ** 2 + (y / ay) ** 2) / z**2
    return (gamma - 1) ** gamma / (arb.pi() * ax * ay * z**4 * (gamma - 1 + q) ** gamma)


def ellipsoid(wm: Vector, A: Matrix) -> arb:
    """1 / (pi |A| |A n| |A^-T m|^4). walter2014 (1), with the absolute value of the determinant."""
    if sign(wm[2]) <= 0:
        return arb(0)
    stretched = norm(apply(inverse_transpose(A), normalise(wm)))
    return 1 / (arb.pi() * abs(determinant(A)) * norm(apply(A, N)) * stretched**4)
