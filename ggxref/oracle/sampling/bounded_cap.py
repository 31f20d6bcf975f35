"""Visible GGX normals from a cap without most of the reflections below the horizon: tokuyoshi2024."""

from flint import arb

from ggxref.oracle import ndf
from ggxref.oracle.linalg import ONE, Vec3, Vector, apply, cosine, dot, norm, normalise
from ggxref.oracle.precision import exactly, sign
from ggxref.oracle.sampling import sphere


def _least(alpha: Vector) -> arb:
    return alpha[0].min(alpha[1]).min(ONE)


def bound(wi: Vector, alpha: Vector) -> arb:
    """k = (1 - a^2) s^2 / (s^2 + a^2 z_i^2), a = min(ax, ay, 1), s = 1 + |(x_i, y_i)|; 1 where wi is not above."""
    if sign(wi[2]) <= 0:
        return arb(1)
    (x, y, z), a = normalise(wi), _least(alpha)
    s = 1 + norm((x, y, arb(0)))
    return (1 - a**2) * s**2 / (s**2 + a**2 * z**2)


def sample(u: Vector, wi: Vector, alpha: Vector) -> Vec3:
    """dupuy2023's sampler with the cap's lower end at -k z_i'. The article's algorithm."""
    B = sphere.stretch(alpha)
    return sphere.half_in_cap(u, wi, -bound(wi, alpha) * sphere.incident(wi, B)[2], B)


def _in_cap(wm: Vector, wi: Vector, alpha: Vector) -> bool:
    """o_z' + k i_z' >= 0 for a facing m.

    That is 2 (i.m) z_m >= (1 - k) z_i |B^-T m|^2, with 1 - k = a^2 (s^2 + z_i^2) / (s^2 + a^2 z_i^2). Multiplied out, it
    is a polynomial of exact numbers wherever |wi| and |(x_i, y_i)| are rational, as at normal incidence; and where a = 1,
    s drops out.
    """
    if sign(wi[2]) <= 0:
        return True
    (ax, ay), (x, y, z), a, c = alpha, wm, _least(alpha), dot(wi, wm)
    s, i = norm(wi) + norm((wi[0], wi[1], arb(0))), wi[2]
    with exactly():
        stretched = (x * ay) ** 2 + (y * ax) ** 2 + (z * ax * ay) ** 2
        seen, least = 2 * c * z * (ax * ay) ** 2, i * stretched
        return sign((seen - a * a * least) * s * s + a * a * (seen - least) * i * i) >= 0


def pdf(wm: Vector, wi: Vector, alpha: Vector) -> arb:
    """2 D max(0, wi.m) / (k z_i + |(ax x_i, ay y_i, z_i)|) [1/sr], 0 where m reflects wi out of the cap. p_bound."""
    if not sphere.front(wm, wi) or not _in_cap(wm, wi, alpha):
        return arb(0)
    i = normalise(wi)
    area = bound(wi, alpha) * i[2] + norm(apply(sphere.stretch(alpha), i))
    return 2 * ndf.ggx(wm, alpha) * cosine(wi, wm) / area
