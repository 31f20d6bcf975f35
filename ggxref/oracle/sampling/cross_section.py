"""Visible GGX normals through the cross section of the hemisphere: Heitz's 2018 method, as dupuy2023 prints it."""

from flint import arb

from ggxref.oracle import masking, ndf
from ggxref.oracle.linalg import ONE, ZERO, Vec3, Vector, add, cosine, cross, normalise, scale
from ggxref.oracle.precision import root
from ggxref.oracle.sampling import sphere


def _hemisphere(u: Vector, wi: Vector) -> Vec3:
    """dupuy2023 listing 2."""
    level = wi[0] == 0 and wi[1] == 0
    w1 = (ONE, ZERO, ZERO) if level else normalise((-wi[1], wi[0], ZERO))
    w2 = cross(wi, w1)
    (sin, cos), r = (2 * u[0]).sin_cos_pi(), u[1].sqrt()
    t1, t2 = r * cos, r * sin
    s = (1 + wi[2]) / 2
    t2 = (1 - s) * root(1 - t1 * t1) + s * t2
    ti = root(1 - t1 * t1 - t2 * t2)
    return add(scale(t1, w1), scale(t2, w2), scale(ti, wi))


def sample(u: Vector, wi: Vector, alpha: Vector) -> Vec3:
    """The micronormal. dupuy2023 listings 1 (line 8 corrected) and 2."""
    B = sphere.stretch(alpha)
    return sphere.micronormal(_hemisphere(u, sphere.incident(wi, B)), B)


def pdf(wm: Vector, wi: Vector, alpha: Vector) -> arb:
    """max(0, wi.m) D(m) / sigma(wi) [1/sr]. heitz2014 (5)."""
    if not sphere.front(wm, wi):
        return arb(0)
    return cosine(wi, wm) * ndf.ggx(wm, alpha) / masking.sigma_ggx(normalise(wi), alpha)
