"""Heitz & d'Eon 2014, §2 to §4: the BSDF, algorithms 1 to 3, table 2, appendix B."""

from functools import partial

import numpy as np

from ggxref.verify import cases, engine, laws, samplers
from ggxref.verify.charts import dot, front, gauss, integrals, product, unit
from ggxref.verify.engine import relative, worst
from ggxref.verify.heitz2014 import PAPER, ROUNDING, ggx_rule, mirrored
from ggxref.verify.statistics import FALSE_ALARM, unlikely_mean

check = partial(engine.check, PAPER)

ALPHA = np.array([0.3, 0.5])
N_I, N_O = 1.1, 1.6
SMITH = ["ndf.ggx", "masking.g1_ggx", "masking.g2_height_correlated", "fresnel.dielectric"]
REFLECT = ["bsdf.brdf", *SMITH]
TRANSMIT = ["bsdf.btdf", *SMITH]


def reflection(brdf, D, g1, g2, fresnel):
    """f_r(wi, wo) in full, of an interface from N_I above to N_O below."""

    def f(i, o, alpha=ALPHA):
        m = unit(i + o)
        return brdf(i, o, D(m, alpha), g2(g1(i, m, alpha), g1(o, m, alpha)), fresnel(dot(i, m), N_I / N_O))

    return f


def transmission(btdf, D, g1, fresnel):
    """f_t(wi, wo) in full, with separable G2; `a` and `b` are the indices on the sides of wi and of wo."""

    def f(i, o, a, b, alpha=ALPHA):
        m = unit(a * i + b * o)
        m = m * np.sign(m[:, 2:])
        return btdf(i, o, a, b, D(m, alpha), g1(i, m, alpha) * g1(o, m, alpha), fresnel(dot(i, m), a / b))

    return f


def refracting(operator, n: int = 40):
    """Directions above, micronormals and transmitted directions below that are not near total reflection."""
    i, m = cases.pairs(cases.UP[:-1], cases.hemisphere(n))
    o = operator(i, m, N_I / N_O)
    keep = (dot(i, m) > 0.02) & (o[:, 2] < -0.02)
    return i[keep], m[keep], o[keep]


@check(
    "§2.1 f_r", "reciprocity: f_r(wi, wo) = f_r(wo, wi)", "exact", REFLECT, tolerance=ROUNDING,
    mutant=("cos_i² for cos_i cos_o", lambda f: lambda i, o, *v: f(i, o, *v) * o[:, 2] / i[:, 2]),
)  # fmt: skip
def brdf_is_reciprocal(brdf, D, g1, g2, fresnel):
    i, o = cases.pairs(cases.UP, cases.hemisphere(300))
    f = reflection(brdf, D, g1, g2, fresnel)
    return relative(f(i, o), f(o, i))


@check(
    "§2.1 f_t", "reciprocity: f_t(wi, wo)/n_o² = f_t(wo, wi)/n_i²", "exact", [*TRANSMIT, "geometry.refract"],
    tolerance=1e-12, mutant=("no n_o²", lambda f: lambda i, o, a, b, *v: f(i, o, a, b, *v) / np.square(b)),
)  # fmt: skip
def btdf_is_reciprocal(btdf, D, g1, g2, fresnel, refract):
    i, _, o = refracting(refract)
    f = transmission(btdf, D, g1, fresnel)
    return relative(f(i, o, N_I, N_O) / N_O**2, f(o, i, N_O, N_I) / N_I**2)


@check(
    "(4)", "white furnace: ∫ f_r |wo·n| dwo over directions = ∫ F G2/G1 D_wi over normals, and ≤ 1", "quadrature",
    REFLECT, tolerance=1e-5,
    also=["§2.1 f_r"], mutant=("2 for 4 in f_r", lambda f: lambda *v: 2 * f(*v)),
)  # fmt: skip
def reflected_energy(brdf, D, g1, g2, fresnel):
    """Tolerance: over the normals the integrand has a kink where the reflection meets the horizon."""
    f = reflection(brdf, D, g1, g2, fresnel)
    i = cases.UP[:3]
    energy = hemispherical(lambda i, o: f(i, o) * o[:, 2], i)

    def visible(m, i):
        o = 2 * dot(i, m)[:, None] * m - i
        g = g1(i, m, ALPHA)
        value = fresnel(dot(i, m), N_I / N_O) * g2(g, g1(o, m, ALPHA)) * front(i, m) * D(m, ALPHA) / i[:, 2]
        return np.where(o[:, 2] > 0, value, 0)

    expected = integrals(visible, [ggx_rule(x, ALPHA, n=150) for x in i], i)
    return max(worst(energy - expected), worst(np.maximum(0, energy - 1)))


def hemispherical(f, i, n=64):
    """∫ f(i, o) do over the upper hemisphere, for each i, where the lobe is wide: product rule in height and azimuth."""
    z, phi, weight = product(gauss([0, 1], n), (2 * np.pi * np.arange(2 * n) / (2 * n), np.full(2 * n, np.pi / n)))
    sin = np.sqrt(1 - z**2)
    o = np.stack([sin * np.cos(phi), sin * np.sin(phi), z], axis=-1)
    return np.array([weight @ f(np.broadcast_to(x, o.shape), o) for x in i])


@check(
    "(4)", "energy is conserved: reflected + transmitted ≤ 1, nearly 1 on a smooth surface", "quadrature",
    [*TRANSMIT, "bsdf.brdf", "geometry.refract"], tolerance=1e-3,
    also=["§2.1 f_t"], mutant=("F for 1 - F", lambda f: lambda i, o, a, b, D, G, F: f(i, o, a, b, D, G, 1 - F)),
)  # fmt: skip
def energy_is_conserved(btdf, D, g1, g2, fresnel, brdf, refract):
    """At α = 0.01 and up to 60° little is masked: at most 3e-4."""
    alphas = np.array([[0.01, 0.01], [0.3, 0.5], [1.0, 1.0]])
    i, alpha = cases.pairs(cases.UP[:3], alphas)

    def scattered(m, i, a):
        o, cos, F = 2 * dot(i, m)[:, None] * m - i, dot(i, m), fresnel(dot(i, m), N_I / N_O)
        t = refract(i, m, N_I / N_O)
        above, below = o[:, 2] > 0, t[:, 2] < 0
        reflected = brdf(i, o, D(m, a), g2(g1(i, m, a), g1(o, m, a)), F) * o[:, 2] * 4 * cos
        area = refract.area_ratio(1)(i, m, N_I / N_O)
        transmitted = btdf(i, t, N_I, N_O, D(m, a), g1(i, m, a) * g1(t, m, a), F) * -t[:, 2] * area
        return np.where(above, reflected, 0) + np.where(below, transmitted, 0)

    energy = integrals(scattered, [ggx_rule(x, a) for x, a in zip(i, alpha, strict=True)], i, alpha)
    smooth = alpha[:, 0] == 0.01
    return max(worst(np.maximum(0, energy - 1)), worst(energy[smooth] - 1))


@check(
    "algorithm 1", "the estimator f |wo·n| / (D (m·n) |∂ω_h/∂ω_o|) is the weight |wi·m| G2 / (|wi·n||m·n|) times F",
    "exact", ["bsdf.weight_normals", *REFLECT, "jacobian.reflection"], tolerance=1e-12,
    mutant=("table 2: without |wi·n|", lambda w: lambda i, m, G: w(i, m, G) * i[:, 2]),
)  # fmt: skip
def weight_of_normals(weight, brdf, D, g1, g2, fresnel, jacobian):
    i, o = cases.pairs(cases.UP, cases.hemisphere(300))
    m = unit(i + o)
    estimator = reflection(brdf, D, g1, g2, fresnel)(i, o) * o[:, 2] / (D(m, ALPHA) * m[:, 2] * jacobian(o, m))
    G2 = g2(g1(i, m, ALPHA), g1(o, m, ALPHA))
    return relative(weight(i, m, G2) * fresnel(dot(i, m), N_I / N_O), estimator)


@check(
    "algorithm 2", "the estimator f / (D_wi |∂ω_h/∂ω_o|) is the weight G2/G1, for reflection and for transmission",
    "exact",
    ["bsdf.weight_visible", *REFLECT, "bsdf.btdf", "sampling.slope_ggx.pdf", "jacobian.reflection",
     "jacobian.refraction", "geometry.refract"],
    tolerance=1e-11, mutant=("shadowing of wi, not of wo", lambda w: lambda gi, G, F: w(G / gi, gi * gi, F)),
)  # fmt: skip
def weight_of_visible_normals(weight, brdf, D, g1, g2, fresnel, btdf, pdf, by_mirror, by_lens, refract):
    i, m, t = refracting(refract)
    o = 2 * dot(i, m)[:, None] * m - i
    i_r, m_r, o_r = i[o[:, 2] > 0.02], m[o[:, 2] > 0.02], o[o[:, 2] > 0.02]
    F = fresnel(dot(i_r, m_r), N_I / N_O)
    estimator = (
        reflection(brdf, D, g1, g2, fresnel)(i_r, o_r) * o_r[:, 2] / (pdf(m_r, i_r, ALPHA) * by_mirror(o_r, m_r))
    )
    g_i, g_o = g1(i_r, m_r, ALPHA), g1(o_r, m_r, ALPHA)
    reflected = relative(weight(g_i, g2(g_i, g_o), F), estimator)
    F = fresnel(dot(i, m), N_I / N_O)
    density = pdf(m, i, ALPHA) * by_lens(i, t, m, N_I, N_O) * (1 - F)
    estimator = transmission(btdf, D, g1, fresnel)(i, t, N_I, N_O) * -t[:, 2] / density
    g_i, g_o = g1(i, m, ALPHA), g1(t, m, ALPHA)
    return max(reflected, relative(weight(g_i, g_i * g_o, 1.0), estimator))


@check(
    "algorithm 1", "estimates the albedo that quadrature over directions finds", "monte_carlo",
    ["sampling.normals.sample_ggx", "bsdf.weight_normals", *REFLECT], tolerance=FALSE_ALARM, visible=False,
    mutant=("α for α²: slopes too steep", lambda f: lambda u, a: f(u, np.sqrt(a))),
)  # fmt: skip
@check(
    "algorithm 2", "estimates the albedo that quadrature over directions finds", "monte_carlo",
    ["sampling.slope_ggx.sample", "bsdf.weight_normals", *REFLECT], tolerance=FALSE_ALARM, visible=True,
    mutant=("axes swapped", lambda f: lambda u, i, a: f(u, i, a[::-1])),
)  # fmt: skip
def estimated_albedo(sample, weight, brdf, D, g1, g2, fresnel, visible, stream):
    i = cases.UP[1:3]
    expected = hemispherical(lambda i, o: reflection(brdf, D, g1, g2, fresnel)(i, o) * o[:, 2], i)
    estimates = []
    for x in i:
        u = stream.uniform(stream.samples, 2)
        m = sample(u, x, ALPHA) if visible else sample(u, ALPHA)
        o = 2 * dot(x, m)[:, None] * m - x
        g_i = g1(x, m, ALPHA)
        G = np.where(o[:, 2] > 0, g2(g_i, g1(o, m, ALPHA)), 0)
        value = G / np.where(g_i > 0, g_i, 1) if visible else weight(x, m, G)
        estimates.append(value * fresnel(dot(x, m), N_I / N_O))
    return unlikely_mean(np.array(estimates), expected)


@check(
    "table 2", "Smith: weights of visible normals lie in [0, 1], separable and height-correlated", "exact",
    ["bsdf.weight_visible", "masking.g1_ggx", "masking.g2_separable", "masking.g2_height_correlated"],
    tolerance=ROUNDING, mutant=("divided by G1 twice", lambda w: lambda gi, G, F: w(gi * gi, G, F)),
)  # fmt: skip
def smith_weights(weight, g1, *correlations):
    i, o, alpha = cases.triples(cases.UP, cases.hemisphere(300), cases.ALPHAS)
    m = unit(i + o)
    g_i, g_o = g1(i, m, alpha), g1(o, m, alpha)
    weights = np.stack([weight(g_i, g2(g_i, g_o), 1.0) for g2 in correlations])
    return max(worst(np.maximum(0, weights - 1)), worst(np.minimum(0, weights)))


@check(
    "table 2", "V-cavities: weights in [0, 2], 2 attained, from D; in [0, 1], 1 attained, from visible normals", "exact",
    ["masking.g2_v_cavity", "masking.g1_v_cavity", "bsdf.weight_normals", "bsdf.weight_visible"], tolerance=1e-12,
    mutant=("no G2", lambda g2: lambda i, o, m: np.ones(len(m))),
)  # fmt: skip
def v_cavity_weights(g2, g1, by_normals, by_visible):
    i, o = cases.pairs(cases.UP, cases.hemisphere(2000))
    m = unit(i + o)
    G = g2(i, o, m)
    before, ours = by_normals(i, m, G), by_visible(g1(i, m), G, 1.0)
    low = worst(np.minimum(0, [before, ours]))
    return max(low, worst(before.max() - 2), worst(ours.max() - 1))


@check(
    "table 2", "Smith: weights from D have no bound (reciprocal of the largest found towards grazing)", "exact",
    ["bsdf.weight_normals", "masking.g1_ggx"], tolerance=0.01,
    mutant=("V-cavities, bounded by 2", lambda w: lambda i, m, G: np.minimum(2, w(i, m, G))),
)  # fmt: skip
def smith_weights_from_normals(weight, g1):
    """Nearly horizontal light on nearly vertical microfacets that reflect it just above the horizon: about 8/α²."""
    alpha = np.logspace(0, -3, 7)[:, None] * [1, 1]
    i, m = cases.direction(np.degrees(np.arccos(1e-6)), 0), cases.direction(np.degrees(np.arccos(1e-4)), 0)
    o = 2 * dot(i, m) * m - i
    return 1 / weight(i, m, g1(i, m, alpha) * g1(o, m, alpha)).max()


for _name in ("ggx", "beckmann"):

    @check(
        "algorithm 3", f"V-cavity samples of {_name} follow D_wi", "monte_carlo", "sampling.v_cavity.sample",
        tolerance=FALSE_ALARM, law=laws.v_cavity, cases=samplers.ABOVE, numbers=3, distribution=_name,
        mutant=("never swapped", lambda f: lambda u, *v, **k: f(u * [1, 1, 0] + [0, 0, 1 - 2**-53], *v, **k)),
    )  # fmt: skip
    def v_cavity_samples(sample, **settings):
        return samplers.follows(sample, **settings)

    @check(
        "appendix B", f"D_wi = G1 ⟨wi·m⟩ D/|wi·n| = 2⟨wi·m⟩/(⟨wi·m⟩ + ⟨wi·m'⟩) (m·n) D, {_name}", "exact",
        ["sampling.v_cavity.pdf", "masking.g1_v_cavity", f"ndf.{_name}"], tolerance=1e-12, distribution=_name,
        mutant=("without the factor 2", lambda f: lambda *v, **k: f(*v, **k) / 2),
    )  # fmt: skip
    def v_cavity_density(pdf, g1, D, distribution):
        i, m = cases.pairs(cases.UP[:4], cases.hemisphere(300))
        seen = (dot(i, m) > 0) & (D(m, ALPHA) > 1e-100)
        i, m = i[seen], m[seen]
        density = pdf(m, i, ALPHA, distribution=distribution)
        by_masking = g1(i, m) * dot(i, m) * D(m, ALPHA) / i[:, 2]
        by_choice = 2 * front(i, m) / (front(i, m) + front(i, mirrored(m))) * m[:, 2] * D(m, ALPHA)
        return max(relative(density, by_masking), relative(density, by_choice))
