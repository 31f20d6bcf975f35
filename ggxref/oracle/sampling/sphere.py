"""Sphere space: a linear map B with B n along n turns the distribution of normals into the unit hemisphere's."""

from flint import arb

from ggxref.oracle import jacobian, ndf
from ggxref.oracle.linalg import (
    ONE,
    ZERO,
    Mat3,
    Matrix,
    Vec3,
    Vector,
    add,
    apply,
    dot,
    inverse_transpose,
    normalise,
    transpose,
)
from ggxref.oracle.precision import root, sign


def stretch(alpha: Vector) -> Mat3:
    """B = M^-1 = diag(ax, ay, 1). dupuy2023 section 2."""
    ax, ay = alpha
    return (ax, ZERO, ZERO), (ZERO, ay, ZERO), (ZERO, ZERO, ONE)


def incident(wi: Vector, B: Matrix) -> Vec3:
    """B wi / |B wi|."""
    if wi[0] == 0 and wi[1] == 0 and wi[2] < 0:
        raise ValueError("no normal is visible from straight below")
    return normalise(apply(B, wi))


def micronormal(m: Vector, B: Matrix) -> Vec3:
    """B^T m / |B^T m|. dupuy2023 listing 1, line 8, which warps wi there instead of m."""
    return normalise(apply(transpose(B), m))


def cap(u: Vector, lower: arb) -> Vec3:
    """Uniform point of the cap lower < z <= 1. dupuy2023 listing 3.

    z = (1 - u1)(1 - lower) + lower is written 1 - u1 (1 - lower), which is known to be 1 at u1 = 0.
    """
    z = 1 - u[1] * (1 - lower)
    sin_theta = root(1 - z * z)
    sin, cos = (2 * u[0]).sin_cos_pi()
    return sin_theta * cos, sin_theta * sin, z


def half_in_cap(u: Vector, wi: Vector, lower: arb, B: Matrix) -> Vec3:
    """The micronormal that reflects wi, in sphere space, to the point u of the cap above `lower`. dupuy2023 listing 3."""
    return micronormal(add(cap(u, lower), incident(wi, B)), B)


def front(wm: Vector, wi: Vector) -> bool:
    """m is above the horizon and faces wi."""
    return sign(wm[2]) > 0 and sign(dot(wi, wm)) > 0


def visible(wm: Vector, wi: Vector, B: Matrix) -> arb:
    """D_vis,std(B^-T m, B wi) |det B^-T| / |B^-T m|^3, both directions normalised. dupuy2023 (1)-(4)."""
    if not front(wm, wi):
        return arb(0)
    normals = inverse_transpose(B)
    m, i = normalise(apply(normals, normalise(wm))), incident(wi, B)
    sigma = (1 + i[2]) / 2
    return dot(m, i) * ndf.hemisphere(m) / sigma * jacobian.linear(wm, normals)


def uniform_half(wm: Vector, wi: Vector, lower: arb, B: Matrix) -> arb:
    """Density of `half_in_cap` on its support: 1 / (2 pi (1 - lower)), times both Jacobians of o' -> m' -> m."""
    normals = inverse_transpose(B)
    m, i = normalise(apply(normals, normalise(wm))), incident(wi, B)
    return 4 * dot(i, m) * jacobian.linear(wm, normals) / (2 * arb.pi() * (1 - lower))
