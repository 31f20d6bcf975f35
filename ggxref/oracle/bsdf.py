"""D, G2 and F put together, as values. Directions are unit, z their height over the macrosurface."""

from flint import arb

from ggxref.oracle.geometry import half_reflection, half_refraction
from ggxref.oracle.linalg import Vector, cosine, normalise
from ggxref.oracle.masking import g1_ggx, g2_height_correlated
from ggxref.oracle.ndf import ggx
from ggxref.oracle.precision import sign


def brdf(wi: Vector, wo: Vector, D: arb, G2: arb, F: arb) -> arb:
    """D G2 F / (4 |z_i| |z_o|) [1/sr], 0 on the horizon. walter2014 (4), dupuy2023 (11)."""
    if sign(wi[2]) * sign(wo[2]) == 0:
        return arb(0)
    return D * G2 * F / (4 * abs(normalise(wi)[2]) * abs(normalise(wo)[2]))


def brdf_ggx(wi: Vector, wo: Vector, alpha: Vector) -> arb:
    """`brdf` of the GGX D and the height-correlated G2 at the half vector, F = 1; 0 unless both are above the horizon."""
    if sign(wi[2]) <= 0 or sign(wo[2]) <= 0:
        return arb(0)
    h = half_reflection(wi, wo)
    G2 = g2_height_correlated(g1_ggx(wi, h, alpha), g1_ggx(wo, h, alpha))
    return brdf(wi, wo, ggx(h, alpha), G2, arb(1))


def btdf(wi: Vector, wo: Vector, n_i: arb, n_o: arb, D: arb, G2: arb, F: arb) -> arb:
    """|i.h| |o.h| n_o^2 (1 - F) G2 D / (|z_i| |z_o| (n_i i.h + n_o o.h)^2) [1/sr], h = half_refraction.

    0 on the horizon, infinite where wi goes straight on (n_i = n_o, wo = -wi). heitz2014 section 2.1.
    """
    if sign(wi[2]) * sign(wo[2]) == 0:
        return arb(0)
    h = half_refraction(wi, wo, n_i, n_o)
    if all(part == 0 for part in h):
        return arb.pos_inf()
    ih, oh, z_i, z_o = cosine(wi, h), cosine(wo, h), normalise(wi)[2], normalise(wo)[2]
    return abs(ih) * abs(oh) * n_o**2 * (1 - F) * G2 * D / (abs(z_i) * abs(z_o) * (n_i * ih + n_o * oh) ** 2)


def weight_normals(wi: Vector, wm: Vector, G2: arb) -> arb:
    """|i.m| G2 / (|z_i| |z_m|), 0 on the horizon. heitz2014 algorithm 1."""
    if sign(wi[2]) * sign(wm[2]) == 0:
        return arb(0)
    return abs(cosine(wi, wm)) * G2 / (abs(normalise(wi)[2]) * abs(normalise(wm)[2]))


def weight_visible(g1_i: arb, g2: arb, F: arb) -> arb:
    """F G2 / G1, 0 where G1 = 0. heitz2014 algorithm 2, walter2014 (50)."""
    return arb(0) if sign(g1_i) == 0 else F * g2 / g1_i
