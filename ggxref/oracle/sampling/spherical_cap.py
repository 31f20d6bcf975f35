"""Visible GGX normals as half vectors of a spherical cap: dupuy2023."""

from flint import arb

from ggxref.oracle.linalg import ONE, Vec3, Vector, dot, normalise, surds
from ggxref.oracle.precision import sign
from ggxref.oracle.sampling import sphere


def sample(u: Vector, wi: Vector, alpha: Vector) -> Vec3:
    """The micronormal. dupuy2023 listings 1 (line 8 corrected) and 3."""
    B = sphere.stretch(alpha)
    return sphere.half_in_cap(u, wi, -sphere.incident(wi, B)[2], B)


def pdf(wm: Vector, wi: Vector, alpha: Vector) -> arb:
    """The density of visible normals [1/sr]. dupuy2023 (1)-(4)."""
    return sphere.visible(wm, wi, sphere.stretch(alpha))


def cap_pdf(wo: Vector, wi: Vector) -> arb:
    """1 / (2 pi (1 + z_i)) where z_o > -z_i, both of sphere space. dupuy2023 (10)."""
    if sign(surds(wo[2], dot(wi, wi), wi[2], dot(wo, wo))) <= 0:
        return arb(0)
    return ONE / (2 * arb.pi() * (1 + normalise(wi)[2]))
