"""Dupuy & Benyoub 2023: GGX visible normals as half vectors of a uniform spherical cap."""

from functools import partial
from itertools import pairwise

import numpy as np

from ggxref.verify import cases, charts, engine, laws, samplers
from ggxref.verify.charts import NORMAL, diagonal, dot, front, integrals, lune, unit
from ggxref.verify.engine import relative, worst
from ggxref.verify.heitz2014 import ggx_rule
from ggxref.verify.statistics import FALSE_ALARM, same_law, uniform_square, unlikely_difference, unlikely_mean

PAPER = "dupuy2023"
check = partial(engine.check, PAPER)

QUADRATURE = 1e-12
ROUNDING = 1e-12
ALPHA = np.array([0.3, 0.5])
SPHERE = np.array([1.0, 1.0])
GGX_SAMPLERS = ["spherical_cap", "cross_section", "slope_ggx"]


def warp(v, factors):
    """normalise(diag(fx, fy, 1) v)"""
    return unit(v * np.concatenate([factors, np.ones_like(factors[..., :1])], axis=-1))


def swapped(f):
    """The function with αx and αy exchanged; alpha is its last argument."""
    return lambda *v: f(*v[:-1], v[-1][..., ::-1])


def rules(directions, alphas):
    return [ggx_rule(i, a) for i, a in zip(directions, alphas, strict=True)]


@check(
    "(1)", "D_vis = D_vis,std(Mᵀm, M⁻¹wi) |det Mᵀ|/‖Mᵀm‖³", "exact",
    ["sampling.spherical_cap.pdf", "jacobian.linear"], tolerance=1e-11,
    mutant=("without the Jacobian", lambda f: lambda m, i, a: f(m, i, a) * a.prod(axis=-1)),
)  # fmt: skip
def visible_density(pdf, jacobian):
    i, m, alpha = cases.triples(cases.ALL, cases.hemisphere(200), cases.ALPHAS)
    keep = np.abs(dot(i, m)) > 1e-3
    i, m, alpha = i[keep], m[keep], alpha[keep]
    M = np.eye(3) * np.concatenate([1 / alpha, np.ones((len(alpha), 1))], axis=-1)[:, None]
    got, expected = pdf(m, i, alpha), pdf(warp(m, 1 / alpha), warp(i, alpha), SPHERE) * jacobian(m, M)
    seen = expected > 0
    return max(relative(got[seen], expected[seen]), worst(got[~seen]))


@check(
    "(1)", "‖∂m'/∂m‖ = |det M|/‖Mm‖³, against the derivative of the linear map", "autodiff",
    ["jacobian.linear", "slopes.stretch"], tolerance=ROUNDING,
    also=[f"tokuyoshi2024 ({k})" for k in (10, 11, 14, 15, 17, 18, 27, 28)],
    mutant=("‖Mm‖² for ‖Mm‖³", lambda f: lambda m, M: f(m, M) * np.linalg.norm(np.einsum("...ij,...j", M, m), axis=-1)),
)  # fmt: skip
def linear_jacobian(jacobian, stretch):
    m, alpha = cases.pairs(cases.sphere(300), cases.ALPHAS[1:])
    M = np.eye(3) * np.concatenate([1 / alpha, np.ones((len(alpha), 1))], axis=-1)[:, None]
    return relative(stretch.area_ratio(0)(m, 1 / alpha), jacobian(m, M))


@check(
    "(2)", "D_vis,std = max(m·wi, 0) D_std/σ_std", "exact", ["sampling.spherical_cap.pdf", "ndf.hemisphere"],
    tolerance=1e-11, mutant=("σ_std = z_i", lambda f: lambda m, i, a: f(m, i, a) * (1 + i[..., 2]) / 2),
)  # fmt: skip
def standard_visible_density(pdf, D):
    i, m = cases.pairs(cases.ALL, cases.sphere(400))
    keep = np.abs(dot(i, m)) > 1e-3
    i, m = i[keep], m[keep]
    return worst(pdf(m, i, SPHERE) - front(i, m) * D(m) / ((1 + i[:, 2]) / 2))


@check(
    "(3)", "∫ D_std z dm = 1, and GGX at α = 1 is the hemisphere", "quadrature", ["ndf.hemisphere", "ndf.ggx"],
    tolerance=QUADRATURE, also=["tokuyoshi2024 (6)"], mutant=("1/(2π)", lambda D: lambda m: D(m) / 2),
)  # fmt: skip
def hemisphere_is_normalised(D, D_ggx):
    m = cases.sphere(500)
    total = integrals(lambda m: D(m) * m[:, 2], [lune(NORMAL, NORMAL, np.eye(3))])
    return max(relative(total, 1), worst(D(m) - D_ggx(m, SPHERE)))


@check(
    "(4)", "σ_std = ∫ max(m·wi, 0) D_std dm = (1 + z_i)/2, from above and below", "quadrature", "ndf.hemisphere",
    tolerance=QUADRATURE, mutant=("the whole sphere", lambda D: lambda m: D(m) + D(-m) + (m[..., 2] < 0.5) / np.pi),
)  # fmt: skip
def cross_section_area(D):
    i = cases.ALL
    area = integrals(lambda m, i: front(i, m) * D(m), [lune(x, NORMAL, np.eye(3)) for x in i], i)
    return worst(area - (1 + i[:, 2]) / 2)


@check(
    "(5)", "the half vector of a mirror image is the micronormal: half(wi, reflect(wi, m)) = m", "exact",
    ["geometry.reflect", "geometry.half_reflection"], tolerance=ROUNDING,
    mutant=("the text of A: '−' lost", lambda f: lambda w, m: 2 * dot(w, m)[..., None] * m + 0 * w),
)  # fmt: skip
def half_vector_inverts_reflection(reflect, half):
    i, m = cases.pairs(cases.ALL, cases.hemisphere(200))
    keep = dot(i, m) > 0.02
    i, m = i[keep], m[keep]
    o = reflect(i, m)
    return max(worst(dot(o, o) - 1), worst(half(i, unit(o)) - m))


@check(
    "(6)", "the half vector is unit, symmetric and at equal angles to wi and wo", "exact", "geometry.half_reflection",
    tolerance=ROUNDING, mutant=("not normalised", lambda f: lambda i, o: i + o),
)  # fmt: skip
def half_vector(half):
    i, o = cases.pairs(cases.ALL, cases.sphere(199))
    h = half(i, o)
    return max(worst(dot(h, h) - 1), worst(h - half(o, i)), worst(dot(h, i) - dot(h, o)))


@check(
    "(8)", "‖∂h/∂wo‖ = 1/(4|wo·h|), against the derivative of the half vector", "autodiff",
    ["jacobian.reflection", "geometry.half_reflection"], tolerance=ROUNDING,
    also=["tokuyoshi2024 (21)", "tokuyoshi2024 (22)"], mutant=("without the 4", lambda f: lambda o, m: 4 * f(o, m)),
)  # fmt: skip
def half_vector_jacobian(jacobian, half):
    i, o = cases.pairs(cases.UP, cases.hemisphere(150))
    return relative(half.area_ratio(1)(i, o), jacobian(o, unit(i + o)))


@check(
    "(9)", "f_p = D_vis,std(h) ‖∂h/∂wo‖ = D_std(h)/(4 σ_std)", "exact",
    ["sampling.spherical_cap.pdf", "jacobian.reflection", "ndf.hemisphere"], tolerance=ROUNDING,
    mutant=("not divided by σ_std", lambda f: lambda m, i, a: f(m, i, a) * (1 + i[..., 2]) / 2),
)  # fmt: skip
@check(
    "(10)", "f_p = D_vis,std(h) ‖∂h/∂wo‖ is 1/(2π(1 + z_i)) on the cap z_o > -z_i and 0 elsewhere", "exact",
    ["sampling.spherical_cap.cap_pdf", "jacobian.reflection", "sampling.spherical_cap.pdf"], tolerance=ROUNDING,
    final=True, also=["§3.1"], mutant=("cap limit of the wrong sign", lambda f: lambda o, i: np.where(o[..., 2] > i[..., 2], f(i, i), 0)),
)  # fmt: skip
def reflected_density(first, jacobian, second, final=False):
    i, o = cases.pairs(cases.ALL, cases.sphere(999))
    keep = (np.abs(o[:, 2] + i[:, 2]) > 1e-6) & (dot(i, o) > -0.999)
    i, o = i[keep], o[keep]
    h = unit(i + o)
    if final:
        return worst(first(o, i) - second(h, i, SPHERE) * jacobian(o, h))
    return worst(first(h, i, SPHERE) * jacobian(o, h) - second(h) / (2 * (1 + i[:, 2])))


@check(
    "(10)", "∫ f_p dwo = 1 over the cap, from above and below", "quadrature", "sampling.spherical_cap.cap_pdf",
    tolerance=QUADRATURE, mutant=("1 - z_i for 1 + z_i", lambda f: lambda o, i: f(o, i) * (1 + i[..., 2]) / (1 - i[..., 2] + 1e-9)),
)  # fmt: skip
def cap_is_normalised(cap_pdf):
    totals = []
    for i in cases.ALL:
        z, weight = charts.gauss([-1, -i[2], 1], 8)
        o = np.stack([np.sqrt(1 - z**2), 0 * z, z], axis=-1)
        totals.append(2 * np.pi * weight @ cap_pdf(o, np.broadcast_to(i, o.shape)))
    return relative(totals, 1)


@check(
    "§3.1", "a hemispherical mirror reflects parallel rays uniformly within a cap: rays traced", "monte_carlo",
    "geometry.reflect", tolerance=FALSE_ALARM, mutant=("reflected about the incident ray", lambda f: lambda w, m: f(m, w)),
)  # fmt: skip
def mirror_hemisphere(reflect, stream):
    """Rays through a disk across wi meet the sphere; those that meet its lower half have missed the hemisphere."""
    v = []
    for i in (cases.direction(20), cases.direction(75, 2.0), cases.direction(110, 1.0)):
        u = stream.uniform(stream.samples, 2)
        r, phi = np.sqrt(u[:, :1]), 2 * np.pi * u[:, 1:]
        rows, _ = charts.frame(i, NORMAL)
        hit = r * np.cos(phi) * rows[0] + r * np.sin(phi) * rows[1] + np.sqrt(1 - r**2) * i
        o = reflect(i, hit[hit[:, 2] > 0])
        v.append(np.stack([np.arctan2(o[:, 1], o[:, 0]) / (2 * np.pi) % 1, (o[:, 2] + i[2]) / (1 + i[2])], -1))
    least = min(map(len, v))
    return uniform_square(np.array([x[:least] for x in v]))


for _sampler, _place in (("spherical_cap", "listing 3"), ("cross_section", "listing 2")):

    @check(
        _place, f"samples follow D_vis, {_sampler}", "monte_carlo", f"sampling.{_sampler}.sample", also=["listing 1"],
        tolerance=FALSE_ALARM, law=laws.ggx_visible, cases=samplers.VISIBLE, mutant=("axes swapped", swapped),
    )  # fmt: skip
    def samples(sample, **settings):
        return samplers.follows(sample, **settings)

    @check(
        _place, f"the Jacobian of the map u → m is D_vis, {_sampler}", "autodiff",
        [f"sampling.{_sampler}.pdf", f"sampling.{_sampler}.sample"], also=["§1", "§4"], tolerance=1e-8, cases=samplers.VISIBLE,
        mutant=("|M|/‖Mᵀm‖² for its cube", lambda f: lambda m, i, a: f(m, i, a) * np.linalg.norm(np.c_[m[:, :2] / a, m[:, 2]], axis=-1)),
    )  # fmt: skip
    def sampler_jacobian(pdf, sample, **settings):
        return samplers.density_is_jacobian(pdf, sample, **settings)


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
