"""Heitz & d'Eon 2014, §5 and appendix A: visible slopes, stretch invariance, algorithm 4."""

from functools import partial

import numpy as np

from ggxref.verify import cases, charts, engine, laws, samplers
from ggxref.verify.charts import dot, front, gauss, integrals, unit
from ggxref.verify.engine import relative, worst
from ggxref.verify.heitz2014 import PAPER, QUADRATURE, ROUNDING, beckmann_rule, ggx_rule
from ggxref.verify.statistics import FALSE_ALARM

check = partial(engine.check, PAPER)

RULES = {"ggx": ggx_rule, "beckmann": beckmann_rule}
LAWS = {"ggx": laws.ggx_visible, "beckmann": laws.beckmann_visible}
# Marginal density of x̃ at α = 1, and its conditional distribution function of ỹ.
MARGINALS = {"ggx": lambda x: 0.5 / (1 + x**2) ** 1.5, "beckmann": lambda x: np.exp(-(x**2)) / np.sqrt(np.pi)}
ONE = np.array([1.0, 1.0])


def slope_of(m):
    return -m[..., :2] / m[..., 2:]


def swapped(f):
    """The formula with αx and αy exchanged; alpha is its last argument."""
    return lambda *v: f(*v[:-1], v[-1][..., ::-1])


def plane(n: int = 15) -> np.ndarray:
    """Slopes, in units of α, from the centre of the lobe to its tail."""
    x, y = np.meshgrid(np.linspace(-3, 3.1, n), np.linspace(-2.9, 3, n))
    return np.stack([x.ravel(), y.ravel()], axis=-1)


def sees(wi, slope):
    """-x_i x̃ - y_i ỹ + z_i"""
    return wi[..., 2] - dot(wi[..., :2], slope)


@check(
    "§5.1 ∂m̃/∂ω_m", "slope Jacobian 1/(m·n)³, against the derivatives of the slope and of its inverse", "autodiff",
    ["jacobian.slope", "slopes.from_normal", "slopes.to_normal"], tolerance=ROUNDING,
    mutant=("cos⁴", lambda f: lambda m: f(m) / m[..., 2]),
)  # fmt: skip
def slope_jacobian(jacobian, from_normal, to_normal):
    m = cases.hemisphere(500)[:-5]
    slope = from_normal(m)
    there, back = from_normal.area_ratio(0)(m), to_normal.area_ratio(0)(slope)
    return max(relative(there, jacobian(m)), relative(back * jacobian(m), 1), worst(to_normal(slope) - m))


for _name in ("ggx", "beckmann"):

    @check(
        "(5)", f"D_wi = ⟨wi·m⟩ D / ∫ ⟨wi·m⟩ D dm, also from below the horizon, {_name}", "quadrature",
        [f"sampling.slope_{_name}.pdf", f"ndf.{_name}"], tolerance=QUADRATURE, rule=RULES[_name],
        mutant=("|wi·n| for the integral", lambda f: lambda m, i, a: f(m, i, a) * np.abs(i[..., 2])),
    )  # fmt: skip
    def visible_normals(pdf, D, rule):
        i, alpha = cases.pairs(cases.ALL, cases.ALPHAS[2:])
        rules = [rule(x, a) for x, a in zip(i, alpha, strict=True)]
        c = integrals(lambda m, i, a: front(i, m) * D(m, a), rules, i, alpha)
        counts = [len(w) for _, w in rules]
        m, i, alpha, c = np.concatenate([m for m, _ in rules]), *(np.repeat(x, counts, axis=0) for x in (i, alpha, c))
        keep = (dot(i, m) > 1e-3) & (D(m, alpha) > 1e-100)
        return relative(pdf(m, i, alpha)[keep] * c[keep], (front(i, m) * D(m, alpha))[keep])

    @check(
        "§5.1 P22", f"(m·n) D = P22 / (m·n)³, {_name}", "exact", [f"slopes.{_name}", f"ndf.{_name}", "jacobian.slope"],
        tolerance=1e-12, mutant=("axes swapped", swapped),
    )  # fmt: skip
    def slopes_of_normals(P22, D, jacobian):
        slope, alpha = cases.pairs(plane(), cases.ALPHAS)
        m = unit(np.concatenate([-slope * alpha, np.ones((len(slope), 1))], axis=-1))
        return relative(jacobian(m) * P22(slope * alpha, alpha), m[:, 2] * D(m, alpha))

    @check(
        "(6)", f"D_wi = P22_wi / (m·n)³, {_name}", "exact",
        [f"slopes.visible_{_name}", f"sampling.slope_{_name}.pdf", "jacobian.slope"], tolerance=1e-11,
        mutant=("axes swapped", swapped),
    )  # fmt: skip
    def visible_slopes_of_normals(P22, pdf, jacobian):
        slope, i, alpha = cases.triples(plane(), cases.ALL, cases.ALPHAS)
        m = unit(np.concatenate([-slope * alpha, np.ones((len(slope), 1))], axis=-1))
        keep = dot(i, m) > 1e-3
        m, i, alpha = m[keep], i[keep], alpha[keep]
        return relative(jacobian(m) * P22(slope_of(m), i, alpha), pdf(m, i, alpha))

    @check(
        "(7)", f"∬ P22_wi = 1 and P22_wi = (1/c) χ⁺(s) s P22 with s = -x_i x̃ - y_i ỹ + z_i, {_name}", "quadrature",
        [f"slopes.visible_{_name}", f"slopes.{_name}"], tolerance=1e-11, rule=RULES[_name],
        mutant=("+x_i x̃ + y_i ỹ + z_i as printed", lambda f: lambda s, i, a: f(-s, i, a)),
    )  # fmt: skip
    def visible_slopes(P22_i, P22, rule):
        i, alpha = cases.pairs(cases.ALL, cases.ALPHAS[2:])
        rules = [(m, w / m[:, 2] ** 3) for m, w in (rule(x, a) for x, a in zip(i, alpha, strict=True))]
        total = integrals(lambda m, i, a: P22_i(slope_of(m), i, a), rules, i, alpha)
        c = integrals(lambda m, i, a: np.maximum(0, sees(i, slope_of(m))) * P22(slope_of(m), a), rules, i, alpha)
        slope, j = cases.pairs(plane(), np.arange(len(i)))
        slope = slope * alpha[j]
        got = P22_i(slope, i[j], alpha[j]) * c[j]
        expected = np.maximum(0, sees(i[j], slope)) * P22(slope, alpha[j])
        return max(relative(total, 1), worst((got - expected) * alpha[j].prod(axis=-1)))

    @check(
        "(8)", f"P22 is shape-invariant, {_name}", "exact", f"slopes.{_name}", tolerance=ROUNDING,
        mutant=("Phong's slopes", lambda f: phong_slopes),
    )  # fmt: skip
    def shape_invariance(P22):
        slope, alpha, factor = cases.triples(plane(), cases.ALPHAS[2:], np.array([[0.3, 2.0], [5.0, 1.0]]))
        slope = slope * alpha
        return relative(P22(slope / factor, alpha / factor) / factor.prod(axis=-1), P22(slope, alpha))

    @check(
        "(9)", f"P22_wi is shape-invariant, {_name}", "exact", [f"slopes.visible_{_name}", "slopes.stretch"],
        tolerance=1e-10, mutant=("axes swapped", swapped),
    )  # fmt: skip
    @check(
        "appendix A", f"stretched by (α_x, α_y), P22_wi becomes the one of α = 1, {_name}", "exact",
        [f"slopes.visible_{_name}", "slopes.stretch"], tolerance=1e-10, to_one=True, mutant=("axes swapped", swapped),
    )  # fmt: skip
    def visible_shape_invariance(P22_i, stretch, to_one=False):
        """Tolerance: s is small against its terms near the edge of what wi sees; slopes within 1e-3 of it are left out."""
        slope, i, alpha = cases.triples(plane(), cases.UP, cases.ALPHAS[2:])
        slope = slope * alpha
        factor = alpha if to_one else np.broadcast_to([0.3, 2.0], alpha.shape)
        keep = sees(i, slope) > 1e-3
        slope, i, alpha, factor = slope[keep], i[keep], alpha[keep], factor[keep]
        there = P22_i(slope / factor, stretch(i, factor), alpha / factor)
        return relative(there / factor.prod(axis=-1), P22_i(slope, i, alpha))

    @check(
        "(10)", f"∫ P22_wi dỹ = (1/c) χ⁺(s) s P2-(x̃) with s = -x_i x̃ + z_i, {_name}", "quadrature",
        f"slopes.visible_{_name}", tolerance=QUADRATURE, marginal=MARGINALS[_name],
        mutant=("+x_i x̃ + z_i as printed", lambda f: lambda s, i, a: f(-s, i, a)),
    )  # fmt: skip
    def marginal_slope(P22_i, marginal):
        i = np.stack([cases.direction(d, 0) for d in (10, 45, 80, 110)])
        x = np.linspace(-3, 3, 25)
        t, weight = gauss([-np.pi / 2, np.pi / 2], 200)
        slope = np.stack(np.broadcast_arrays(x[:, None], np.tan(t)), axis=-1)
        got = P22_i(slope, i[:, None, None], ONE) @ (weight / np.cos(t) ** 2)
        s = np.maximum(0, i[:, 2:] - i[:, :1] * x)
        return worst(got * _area(i, marginal)[:, None] - s * marginal(x))

    @check(
        "(11)", f"the first number is the distribution function of the sampled x̃, {_name}", "exact",
        f"sampling.slope_{_name}.sample", tolerance=1e-11, law=LAWS[_name], number=0,
        mutant=("inverted by a linear table of 1024", lambda f: lambda u, i, a: f(tabulated(u, 0), i, a)),
    )  # fmt: skip
    @check(
        "(13)", f"the second number is the conditional distribution function of the sampled ỹ, {_name}", "exact",
        f"sampling.slope_{_name}.sample", tolerance=1e-11, law=LAWS[_name], number=1,
        mutant=("inverted by a linear table of 1024", lambda f: lambda u, i, a: f(tabulated(u, 1), i, a)),
    )  # fmt: skip
    def inverse_distribution(sample, law, number):
        u, i, alpha = samplers.on_lattice(samplers.VISIBLE, 1000)
        drawn = np.split(sample(u, i, alpha), len(samplers.VISIBLE))
        errors = [law(m, *case)[:, number] - u[:1000, number] for m, case in zip(drawn, samplers.VISIBLE, strict=True)]
        return worst(errors)

    @check(
        "algorithm 4", f"samples follow D_wi, {_name}", "monte_carlo", f"sampling.slope_{_name}.sample",
        tolerance=FALSE_ALARM, law=LAWS[_name], cases=samplers.VISIBLE, thin=4,
        mutant=("not unstretched", lambda f: lambda u, i, a: f(u, charts.unit(charts.diagonal(a) @ i), ONE)),
    )  # fmt: skip
    def slope_samples(sample, **settings):
        return samplers.follows(sample, **settings)

    @check(
        "algorithm 4", f"the Jacobian of the map u → m is D_wi, {_name}", "autodiff",
        [f"sampling.slope_{_name}.pdf", f"sampling.slope_{_name}.sample"], tolerance=1e-8, cases=samplers.VISIBLE,
        mutant=("without σ(wi)", lambda f: lambda m, i, a: f(m, i, a) * (1 + i[..., 2]) / 2),
    )  # fmt: skip
    def slope_sampler_jacobian(pdf, sample, **settings):
        return samplers.density_is_jacobian(pdf, sample, **settings)

    @check(
        "§2.2", f"samples of (m·n) D follow it, {_name}", "monte_carlo", f"sampling.normals.sample_{_name}",
        tolerance=FALSE_ALARM, law=getattr(laws, f"{_name}_normals"), cases=samplers.NORMALS,
        mutant=("axes swapped", swapped),
    )  # fmt: skip
    def normal_samples(sample, **settings):
        return samplers.follows(sample, **settings)

    @check(
        "§2.2", f"the Jacobian of the map u → m is (m·n) D, {_name}", "autodiff",
        [f"sampling.normals.pdf_{_name}", f"sampling.normals.sample_{_name}", f"ndf.{_name}"], tolerance=1e-10,
        mutant=("D without cos", lambda f: lambda m, a: f(m, a) / m[..., 2]),
    )  # fmt: skip
    def normal_sampler_jacobian(pdf, sample, D):
        u, alpha = cases.pairs(samplers.lattice(500), cases.ALPHAS)
        m = sample(u, alpha)
        area = sample.area_ratio(0)(u, alpha)
        return max(relative(pdf(m, alpha) * area, 1), relative(pdf(m, alpha), m[:, 2] * D(m, alpha)))


def _area(i, marginal):
    """c of (10): ∫ max(0, -x_i x̃ + z_i) P2-(x̃) dx̃, by x̃ = tan ψ up to the slope that wi just sees."""
    areas = []
    for x, _, z in i:
        psi, weight = gauss([-np.pi / 2, np.arctan2(z, x)], 100)
        slope = np.tan(psi)
        areas.append(weight @ (np.maximum(0, z - x * slope) * marginal(slope) / np.cos(psi) ** 2))
    return np.array(areas)


def tabulated(u, number, size=1024):
    """The uniform numbers, one of them through a table: snapped to its nearest entry."""
    u = u.copy()
    u[:, number] = (np.floor(u[:, number] * size) + 0.5) / size
    return u


def phong_slopes(slope, alpha):
    """Phong's distribution as slopes, exponent 2/α² - 2: a power of the cosine, not of a stretched slope."""
    s = 2 / alpha.prod(axis=-1) - 2
    cos = 1 / np.sqrt(1 + dot(slope, slope))
    return (s + 2) / (2 * np.pi) * cos ** (s + 4)


@check(
    "(12)", "the conditional density of ỹ at a given x̃ does not depend on wi", "exact",
    ["slopes.visible_ggx", "slopes.visible_beckmann"], tolerance=1e-12,
    mutant=("with y_i ỹ in the projection", lambda f: lambda s, i, a: f(s, i, a) * (1 + 0.1 * i[..., :1][..., 0] * s[..., 1])),
)  # fmt: skip
def conditional_slope(*densities):
    i = np.stack([cases.direction(d, 0) for d in (10, 45, 70)])[:, None, None]
    slope = np.stack(np.meshgrid(np.linspace(-3, 0.3, 20), np.linspace(-3, 3, 31), indexing="ij"), axis=-1)
    errors = []
    for P22_i in densities:
        value = P22_i(slope, i, ONE)
        conditional = value / value[..., 15:16]
        errors.append(relative(conditional, conditional[:1]))
    return max(errors)
