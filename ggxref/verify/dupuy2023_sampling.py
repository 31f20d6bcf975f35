"""Dupuy & Benyoub 2023: the listings, and what is estimated with their samples."""

from itertools import pairwise

import numpy as np

from ggxref.verify import cases, samplers
from ggxref.verify.charts import diagonal, dot, front, integrals, unit
from ggxref.verify.dupuy2023 import ALPHA, GGX_SAMPLERS, QUADRATURE, ROUNDING, check, rules, swapped, warp
from ggxref.verify.engine import relative, worst
from ggxref.verify.heitz2014 import ggx_rule
from ggxref.verify.statistics import FALSE_ALARM, same_law, unlikely_difference, unlikely_mean


def listing_1(u, wi, alpha, hemisphere):
    """Listing 1, with line 8 corrected."""
    return warp(hemisphere(u, warp(wi, alpha)), alpha)


def listing_1_as_printed(u, wi, alpha, hemisphere):
    """Line 8 warps wi where it should warp wmStd."""
    del hemisphere
    return np.broadcast_to(warp(wi, alpha), (len(u), 3))


def listing_2(u, wi):
    flat = np.hypot(wi[0], wi[1])
    w1 = np.array([-wi[1], wi[0], 0]) / flat if flat > 0 else np.array([1.0, 0.0, 0.0])
    phi, r = 2 * np.pi * u[:, 0], np.sqrt(u[:, 1])
    t1, s = r * np.cos(phi), (1 + wi[2]) / 2
    t2 = (1 - s) * np.sqrt(1 - t1**2) + s * r * np.sin(phi)
    ti = np.sqrt(np.maximum(0, 1 - t1**2 - t2**2))
    return t1[:, None] * w1 + t2[:, None] * np.cross(wi, w1) + ti[:, None] * wi


def listing_3(u, wi):
    phi, z = 2 * np.pi * u[:, 0], (1 - u[:, 1]) * (1 + wi[2]) - wi[2]
    sin = np.sqrt(np.clip(1 - z * z, 0, 1))
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), z], axis=-1) + wi


@check(
    "listing 1", "the listing, line 8 corrected, draws the samples of sampling.spherical_cap", "exact",
    [listing_1, "sampling.spherical_cap.sample"], tolerance=1e-12, hemisphere=listing_3,
    mutant=("line 8 as printed: wi in place of wmStd", lambda f: listing_1_as_printed),
)  # fmt: skip
@check(
    "listing 2", "the listing draws the samples of sampling.cross_section", "exact",
    [listing_1, "sampling.cross_section.sample"], tolerance=1e-10, hemisphere=listing_2,
    mutant=("phi from u.y, r from u.x", lambda f: lambda u, i, a, h: f(u[:, ::-1], i, a, h)),
)  # fmt: skip
@check(
    "listing 3", "the listing draws the samples of sampling.spherical_cap", "exact",
    [listing_1, "sampling.spherical_cap.sample"], tolerance=1e-12, hemisphere=listing_3,
    mutant=("line 12 without + wi", lambda f: lambda u, i, a, h: f(u, i, a, lambda u, w: h(u, w) - w)),
)  # fmt: skip
def listings(listing, sample, hemisphere):
    """Tolerance of listing 2: its 1 - t1² - t2² cancels near the rim."""
    u = samplers.lattice(2000)
    return max(worst(listing(u, i, a, hemisphere) - sample(u, i, a)) for i, a in samplers.VISIBLE)


@check(
    "§4", "all samplers of the visible GGX normals have one law", "monte_carlo",
    [f"sampling.{name}.sample" for name in GGX_SAMPLERS] + ["sampling.lune.sample", "sampling.ellipsoid_cap.sample"],
    tolerance=FALSE_ALARM, mutant=("axes swapped", swapped),
)  # fmt: skip
def samplers_agree(*sampled, stream):
    """Azimuth and height of the micronormals of each method against the next one's."""
    drawn = []
    for k, sample in enumerate(sampled):
        points = []
        for i, alpha in samplers.VISIBLE:
            m = sample(stream.uniform(stream.samples, 2), i, alpha if k < len(GGX_SAMPLERS) else diagonal(alpha))
            points.append(np.stack([np.arctan2(m[:, 1], m[:, 0]), m[:, 2]], -1))
        drawn.append(points)
    return max(same_law(a, b) for a, b in pairwise(drawn))


@check(
    "(11)", "f_r = F G2 D/(4 cos θ_i cos θ_o) is reciprocal", "exact",
    ["bsdf.brdf", "ndf.ggx", "masking.g1_ggx", "masking.g2_height_correlated", "fresnel.conductor"],
    tolerance=ROUNDING, mutant=("cos θ_i twice", lambda f: lambda i, o, *v: f(i, o, *v) * o[:, 2] / i[:, 2]),
)  # fmt: skip
def brdf_is_reciprocal(brdf, D, g1, g2, fresnel):
    i, o, alpha = cases.triples(cases.UP, cases.hemisphere(100), cases.ALPHAS)
    m = unit(i + o)

    def f(i, o):
        return brdf(i, o, D(m, alpha), g2(g1(i, m, alpha), g1(o, m, alpha)), fresnel(dot(i, m), 0.2, 3.9))

    return relative(f(i, o), f(o, i))


@check(
    "(12)", "D = D_std(Mᵀm) |det Mᵀ|/‖Mᵀm‖⁴", "exact", ["ndf.ggx", "ndf.hemisphere"], tolerance=ROUNDING,
    mutant=("‖Mᵀm‖³", lambda D: lambda m, a: D(m, a) * np.linalg.norm(np.c_[m[:, :2] / a, m[:, 2]], axis=-1)),
)  # fmt: skip
def normals_from_hemisphere(D, D_std):
    m, alpha = cases.pairs(cases.hemisphere(400), cases.ALPHAS)
    length = np.linalg.norm(np.c_[m[:, :2] / alpha, m[:, 2]], axis=-1)
    return relative(D(m, alpha), D_std(warp(m, 1 / alpha)) / alpha.prod(axis=-1) / length**4)


@check(
    "(13)", "G2 = G_iG_o/(G_i + G_o - G_iG_o): 1/(1 + Λ_i + Λ_o), between G_iG_o and min(G_i, G_o)", "exact",
    ["masking.g2_height_correlated", "masking.lambda_ggx", "masking.g1_ggx"], tolerance=ROUNDING,
    mutant=("separable", lambda f: lambda a, b: a * b),
)  # fmt: skip
def height_correlation(g2, smith, g1):
    i, o, alpha = cases.triples(cases.UP, cases.hemisphere(100), cases.ALPHAS)
    m = unit(i + o)
    a, b = g1(i, m, alpha), g1(o, m, alpha)
    G = g2(a, b)
    above, below = np.maximum(0, G - np.minimum(a, b)), np.maximum(0, a * b - G)
    return max(worst(above), worst(below), relative(G, 1 / (1 + smith(i, alpha) + smith(o, alpha))))


@check(
    "(15)", "G1 = χ⁺(m·w) z / ∫ max(m·w, 0) D dm", "quadrature", ["masking.g1_ggx", "ndf.ggx"], tolerance=QUADRATURE,
    also=["(16)", "(17)", "tokuyoshi2024 (7)"], mutant=("axes swapped", swapped),
)  # fmt: skip
def masking_is_its_integral(g1, D):
    w, alpha = cases.pairs(cases.UP, cases.ALPHAS)
    area = integrals(lambda m, w, a: front(w, m) * D(m, a), rules(w, alpha), w, alpha)
    back = cases.hemisphere(300)
    hidden = g1(cases.UP[3], back, ALPHA)[dot(cases.UP[3], back) < 0]
    return max(relative(g1(w, w, alpha), w[:, 2] / area), worst(hidden))


@check(
    "(16)", "G1 = G1,std(Mᵀm, M⁻¹w) = z'/σ_std(w')", "exact", "masking.g1_ggx", tolerance=ROUNDING,
    mutant=("axes swapped", swapped),
)  # fmt: skip
@check(
    "(17)", "G1,std = χ⁺(w·m) z_i/σ_std(w)", "exact", "masking.g1_ggx", tolerance=ROUNDING, standard=True,
    mutant=("σ_std without the half", lambda f: lambda w, m, a: f(w, m, a) / 2),
)  # fmt: skip
def masking_of_hemisphere(g1, standard=False):
    w, m, alpha = cases.triples(cases.UP, cases.hemisphere(100), cases.ALPHAS)
    alpha = np.ones_like(alpha) if standard else alpha
    z = warp(w, alpha)[:, 2]
    return worst(g1(w, m, alpha) - np.where(dot(w, m) > 0, 2 * z / (1 + z), 0))


@check(
    "(19)", "the estimator with samples of listing 1 and the density (20) converges to ∫ f_r |cos| dω", "monte_carlo",
    ["sampling.spherical_cap.sample", "bsdf.brdf", "ndf.ggx", "masking.g1_ggx", "masking.g2_height_correlated"],
    tolerance=FALSE_ALARM, also=["(18)"], mutant=("axes swapped", swapped),
)  # fmt: skip
def estimator(sample, brdf, D, g1, g2, stream):
    from ggxref.verify.heitz2014_bsdf import hemispherical

    def f(i, o):
        m = unit(i + o)
        return brdf(i, o, D(m, ALPHA), g2(g1(i, m, ALPHA), g1(o, m, ALPHA)), 1.0) * np.abs(o[:, 2])

    i = cases.UP[1:3]
    values = []
    for a in i:
        m = sample(stream.uniform(stream.samples, 2), a, ALPHA)
        o = 2 * dot(a, m)[:, None] * m - a
        density = g1(a, m, ALPHA) * D(m, ALPHA) / (4 * a[2])
        values.append(np.where(o[:, 2] > 0, f(np.broadcast_to(a, o.shape), o), 0) / density)
    return unlikely_mean(np.array(values), hemispherical(f, i))


@check(
    "(20)", "PDF = D_vis/(4|wa·m|) = G1 D/(4 cos θ_a)", "exact",
    ["sampling.spherical_cap.pdf", "jacobian.reflection", "masking.g1_ggx", "ndf.ggx"], tolerance=1e-11,
    mutant=("without its Jacobian", lambda f: lambda m, i, a: f(m, i, a) * 4 * dot(i, m)),
)  # fmt: skip
def reflected_ggx_density(pdf, jacobian, g1, D):
    i, m, alpha = cases.triples(cases.UP, cases.hemisphere(100), cases.ALPHAS)
    keep = dot(i, m) > 1e-3
    i, m, alpha = i[keep], m[keep], alpha[keep]
    o = 2 * dot(i, m)[:, None] * m - i
    return relative(pdf(m, i, alpha) * jacobian(o, m), g1(i, m, alpha) * D(m, alpha) / (4 * i[:, 2]))


def outgoing(m, i):
    return 2 * dot(i, m)[:, None] * m - i


@check(
    "(18)", "L = ∫ L f_r |cos| dω over directions is ∫ L F G2/G1 D_vis dm over normals, for a radiance that varies", "quadrature",
    ["bsdf.brdf", "ndf.ggx", "masking.g1_ggx", "masking.g2_height_correlated", "sampling.spherical_cap.pdf"], tolerance=1e-4,
    also=["(11)", "(19)"], mutant=("cos θ_b lost", lambda f: lambda i, o, *v: f(i, o, *v) / np.abs(o[:, 2])),
)  # fmt: skip
def illumination(brdf, D, g1, g2, pdf):
    """Tolerance: over the normals there is a kink where the reflection meets the horizon."""
    from ggxref.verify.heitz2014_bsdf import hemispherical

    def radiance(o):
        return 1 + o[:, 0] + 0.5 * o[:, 1] * o[:, 2]

    def f(i, o):
        m = unit(i + o)
        return radiance(o) * brdf(i, o, D(m, ALPHA), g2(g1(i, m, ALPHA), g1(o, m, ALPHA)), 1.0) * o[:, 2]

    def visible(m, i):
        o = outgoing(m, i)
        g = g1(i, m, ALPHA)
        value = radiance(o) * g2(g, g1(o, m, ALPHA)) / np.where(g > 0, g, 1) * pdf(m, i, ALPHA)
        return np.where(o[:, 2] > 0, value, 0)

    i = cases.UP[:3]
    return worst(hemispherical(f, i) - integrals(visible, [ggx_rule(x, ALPHA, n=150) for x in i], i))


@check(
    "§1", "the estimator's variance is that of the earlier method: second moments of the weight", "monte_carlo",
    ["sampling.spherical_cap.sample", "sampling.cross_section.sample", "masking.g1_ggx"], tolerance=FALSE_ALARM,
    mutant=("axes swapped", swapped),
)  # fmt: skip
def same_variance(caps, cross_section, g1, stream):
    """Both estimate with the weight G1(wo) where wo is above the horizon: its square's mean has to agree."""
    squares = []
    for sample in (caps, cross_section):
        row = []
        for i, alpha in samplers.VISIBLE[2:5]:
            m = sample(stream.uniform(stream.samples, 2), i, alpha)
            o = outgoing(m, i)
            row.append(np.where(o[:, 2] > 0, g1(o, m, alpha), 0) ** 2)
        squares.append(np.array(row))
    error = np.sqrt(sum(s.var(axis=-1) / s.shape[-1] for s in squares))
    return unlikely_difference(squares[0].mean(axis=-1) - squares[1].mean(axis=-1), error)


SPEED_UPS = ((1.34, 0.54, 2.48), (3.71, 1.49, 2.49), (1.89, 0.74, 2.55), (0.48, 0.20, 2.40))


@check(
    "table 1", "the speed-ups are the quotients of the two columns of times, to their digits", "exact",
    lambda before, after: before / after, tolerance=0.02, mutant=("differences", lambda f: lambda before, after: before - after),
)  # fmt: skip
def table_of_times(quotient):
    return worst([quotient(a, b) - c for a, b, c in SPEED_UPS])
