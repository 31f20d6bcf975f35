"""Dupuy & Benyoub 2023: GGX visible normals as half vectors of a uniform spherical cap, and their densities."""

from functools import partial

import numpy as np

from ggxref.verify import cases, charts, engine, laws, samplers
from ggxref.verify.charts import NORMAL, dot, front, integrals, lune, unit
from ggxref.verify.engine import relative, worst
from ggxref.verify.heitz2014 import ggx_rule
from ggxref.verify.statistics import FALSE_ALARM, uniform_square

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
