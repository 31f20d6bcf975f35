"""Sampling D cos: u[0] turns, u[1] reaches."""

from flint import arb

from ggxref.oracle import ndf
from ggxref.oracle.linalg import ONE, Vec3, Vector, normalise


def sample_ggx(u: Vector, alpha: Vector) -> Vec3:
    """(ax sqrt(u1) cos phi, ay sqrt(u1) sin phi, sqrt(1 - u1)), normalised; phi = 2 pi u0. Walter et al. 2007 (35)."""
    (ax, ay), (sin, cos), radius = alpha, (2 * u[0]).sin_cos_pi(), u[1].sqrt()
    return normalise((ax * radius * cos, ay * radius * sin, (1 - u[1]).sqrt()))


def sample_beckmann(u: Vector, alpha: Vector) -> Vec3:
    """(ax r cos phi, ay r sin phi, 1), normalised; r = sqrt(-log(1 - u1)), phi = 2 pi u0. Walter et al. 2007 (28)."""
    (ax, ay), (sin, cos), radius = alpha, (2 * u[0]).sin_cos_pi(), (-((-u[1]).log1p())).sqrt()
    return normalise((ax * radius * cos, ay * radius * sin, ONE))


def _cosine(wm: Vector) -> arb:
    return normalise(wm)[2]


def pdf_ggx(wm: Vector, alpha: Vector) -> arb:
    """D(m) z. heitz2014 (1)."""
    return ndf.ggx(wm, alpha) * _cosine(wm)


def pdf_beckmann(wm: Vector, alpha: Vector) -> arb:
    """D(m) z. heitz2014 (1)."""
    return ndf.beckmann(wm, alpha) * _cosine(wm)
