"""Directions: reflection, refraction, half vectors, frames."""

from flint import arb

from ggxref.oracle.linalg import ONE, ZERO, Mat3, Vec3, Vector, add, dot, negative, norm, normalise, scale, surds
from ggxref.oracle.precision import exactly, sign


def reflect(w: Vector, wm: Vector) -> Vec3:
    """2 (w.m) m - w. dupuy2023 (5).

    Over the common denominator |m|^2 |w| the numerator is a polynomial, so that a component which vanishes is known to.
    """
    mm, c = dot(wm, wm), dot(w, wm)
    with exactly():
        x, y, z = (2 * c * m - mm * part for m, part in zip(wm, w, strict=True))
    length = mm * norm(w)
    return x / length, y / length, z / length


def refract(w: Vector, wm: Vector, eta: arb) -> Vec3:
    """(eta c - sgn(c) sqrt(1 + eta^2 (c^2 - 1))) m - eta w, c = w.m; the zero vector in total reflection.

    heitz2014 section 2.2, with the eta^2 that it misses under the root, and the side of m (w.m, not w.n). sgn(0) = -1. The
    factor of m is 0 at eta = 1, and known to be.
    """
    c = dot(w, wm)
    with exactly():
        squares = dot(w, w) * dot(wm, wm)
        radicand, eta_c = squares + eta * eta * (c * c - squares), eta * c
    if sign(radicand) < 0:
        return ZERO, ZERO, ZERO
    along = surds(eta_c, ONE, -ONE if sign(c) > 0 else ONE, radicand) / squares.sqrt()
    return add(scale(along, normalise(wm)), scale(-eta, normalise(w)))


def _half(wi: Vector, wo: Vector, n_i: arb, n_o: arb) -> Vec3:
    """n_i wi/|wi| + n_o wo/|wo|, normalised; the zero vector where the sum is zero."""
    with exactly():
        ii, oo = dot(wi, wi), dot(wo, wo)
        terms = tuple((n_i * i, n_o * o) for i, o in zip(wi, wo, strict=True))
    x, y, z = (surds(i, oo, o, ii) for i, o in terms)
    return (ZERO, ZERO, ZERO) if x == 0 and y == 0 and z == 0 else normalise((x, y, z))


def half_reflection(wi: Vector, wo: Vector) -> Vec3:
    """(wi + wo) / |wi + wo|; the zero vector where wi = -wo. dupuy2023 (6)."""
    return _half(wi, wo, ONE, ONE)


def half_refraction(wi: Vector, wo: Vector, n_i: arb, n_o: arb) -> Vec3:
    """(n_i wi + n_o wo) / |n_i wi + n_o wo|, turned up; the zero vector where the sum is zero. Walter et al. 2007 (16)."""
    h = _half(wi, wo, n_i, n_o)
    return h if sign(h[2]) >= 0 else negative(h)


def basis(w: Vector) -> Mat3:
    """Rows t, b, w: an orthonormal frame about w, with s = 1 for z >= 0 and -1 below. Duff et al. 2017."""
    x, y, z = normalise(w)
    s = ONE if sign(w[2]) >= 0 else -ONE
    a = -1 / (s + z)
    c = x * y * a
    return (1 + s * x * x * a, s * c, -s * x), (c, s + y * y * a, -y), (x, y, z)
