"""The misprints of heitz2014, each as a formula in both forms with a property that only the right one has."""

import numpy as np

from ggxref.verify import cases, charts
from ggxref.verify.charts import NORMAL, dot, front, integrals, unit
from ggxref.verify.engine import relative, worst
from ggxref.verify.errata import erratum
from ggxref.verify.heitz2014 import ggx_rule, printed_transmit
from ggxref.verify.heitz2014_bsdf import ALPHA, N_I, N_O, SMITH, refracting
from ggxref.verify.heitz2014_slopes import ONE, plane, sees, slope_of
from ggxref.verify.walter2014 import norm

HEITZ = "heitz2014"
ROUNDING = 1e-12


def reflecting_normal(i, o):
    return unit(i + o)


@erratum(
    HEITZ, "§2.1 f_r", "D(ω_ht)", "D(ω_hr)", "exact",
    [reflecting_normal, "bsdf.brdf", *SMITH, "sampling.slope_ggx.pdf", "jacobian.reflection"], tolerance=ROUNDING,
    change=lambda half: lambda i, o: unit(N_I * i + N_O * o),
)  # fmt: skip
def normal_of_reflection(half, brdf, D, g1, g2, fresnel, pdf, jacobian):
    """Algorithm 2's estimator is the weight F G2/G1 only with the half vector of reflection in D."""
    i, o = cases.pairs(cases.UP, cases.hemisphere(300))
    m = unit(i + o)
    F, G_i, G_o = fresnel(dot(i, m), N_I / N_O), g1(i, m, ALPHA), g1(o, m, ALPHA)
    f = brdf(i, o, D(half(i, o), ALPHA), g2(G_i, G_o), F)
    return relative(f * o[:, 2] / (pdf(m, i, ALPHA) * jacobian(o, m)), F * g2(G_i, G_o) / G_i)


@erratum(
    HEITZ, "§2.2 reflect", "2|ω_i·ω_m| ω_m - ω_i, which holds for front faces alone", "2(ω_i·ω_m) ω_m - ω_i", "exact",
    "geometry.reflect", tolerance=ROUNDING, change=lambda f: lambda w, m: 2 * np.abs(dot(w, m))[:, None] * m - w,
)  # fmt: skip
def reflection_is_unit(reflect):
    w, m = cases.pairs(cases.UP, cases.hemisphere(300))
    return worst(norm(reflect(w, m)) - 1)


@erratum(
    HEITZ, "§2.2 transmit", "√(1 + n(c² - 1))", "√(1 + n²(c² - 1))", "exact",
    [lambda w, m, eta: printed_transmit(w, m, eta, power=2)], tolerance=1e-12, change=lambda f: printed_transmit,
)  # fmt: skip
def transmission_obeys_snell(transmit):
    i, m, _ = refracting(lambda i, m, eta: transmit(i, m, np.full(len(i), eta)))
    o = transmit(i, m, np.full(len(i), N_I / N_O))
    return max(worst(norm(o) - 1), worst(np.cross(o, m) + N_I / N_O * np.cross(i, m)))


@erratum(
    HEITZ, "§2.2 ∂ω_ht", "‖∂ω_ht/∂ω_i‖ = n_o²|ω_o·ω_ht|/(…)²", "‖∂ω_ht/∂ω_o‖ = n_o²|ω_o·ω_ht|/(…)²", "autodiff",
    [lambda i, o, half: half.area_ratio(1)(i, o, N_I, N_O), "jacobian.refraction", "geometry.half_refraction", "geometry.refract"],
    tolerance=1e-11, change=lambda f: lambda i, o, half: half.area_ratio(0)(i, o, N_I, N_O),
)  # fmt: skip
def refraction_variable(derivative, jacobian, half, refract):
    i, m, o = refracting(refract)
    return relative(derivative(i, o, half), jacobian(i, o, m, N_I, N_O))


@erratum(
    HEITZ, "table 2", "|ω_i·ω_m| G2/|ω_m·ω_g|", "|ω_i·ω_m| G2/(|ω_i·ω_g||ω_m·ω_g|), as in §2.2", "exact",
    [lambda i, m, G: np.abs(dot(i, m)) * G / (i[:, 2] * m[:, 2]), *SMITH[:3], "jacobian.reflection", "bsdf.brdf"],
    tolerance=ROUNDING, change=lambda f: lambda i, m, G: f(i, m, G) * i[:, 2],
)  # fmt: skip
def weight_of_normals(weight, D, g1, g2, jacobian, brdf):
    i, o = cases.pairs(cases.UP, cases.hemisphere(300))
    m = unit(i + o)
    G = g2(g1(i, m, ALPHA), g1(o, m, ALPHA))
    estimator = brdf(i, o, D(m, ALPHA), G, 1.0) * o[:, 2] / (D(m, ALPHA) * m[:, 2] * jacobian(o, m))
    return relative(weight(i, m, G), estimator)


@erratum(
    HEITZ, "§2.2 Walter's trick", "α' = (1.2 - 0.2√|ω_i·ω_m|)α", "α' = (1.2 - 0.2√|ω_i·ω_g|)α", "quadrature",
    [lambda i, m: np.sqrt(i[:, 2]), "ndf.ggx"], tolerance=1e-11, change=lambda f: lambda i, m: np.sqrt(np.abs(dot(i, m))),
)  # fmt: skip
def trick_is_a_density(root, D):
    """The normals drawn with α' have a density that integrates to 1: α' cannot depend on the normal drawn."""
    i = cases.UP[1:]
    rules = [ggx_rule(NORMAL, 1.1 * ALPHA, n=60) for _ in i]

    def density(m, i):
        return D(m, (1.2 - 0.2 * root(i, m))[:, None] * ALPHA) * m[:, 2]

    return relative(integrals(density, rules, i), 1)


@erratum(
    HEITZ, "§3", "G1 ≤ G2", "G2 ≤ G1", "exact",
    [lambda G2, G1: G2 - G1, "masking.g1_ggx", "masking.g2_height_correlated", "masking.g2_separable"], tolerance=1e-14,
    change=lambda f: lambda G2, G1: G1 - G2,
)  # fmt: skip
def masking_and_shadowing_is_less(excess, g1, *correlations):
    i, o = cases.pairs(cases.UP, cases.hemisphere(300))
    m = unit(i + o)
    a, b = g1(i, m, ALPHA), g1(o, m, ALPHA)
    return max(0.0, *(float(np.max(excess(g2(a, b), a))) for g2 in correlations))


def as_printed(projection):
    """x_i x̃ + y_i ỹ + z_i"""
    return lambda i, s: i[..., 2] + dot(i[..., :2], s)


for _place, _printed, _correct in (
    ("(7)", "x_i x̃ + y_i ỹ + z_i", "-x_i x̃ - y_i ỹ + z_i, as in appendix A"),
    ("§5.3", "χ⁺(x_i x̃ + z_i)(x_i x̃ + z_i)", "χ⁺(-x_i x̃ + z_i)(-x_i x̃ + z_i)"),
    ("(10)", "χ⁺(x_i x̃ + z_i)(x_i x̃ + z_i)", "χ⁺(-x_i x̃ + z_i)(-x_i x̃ + z_i), in all three lines"),
):

    @erratum(
        HEITZ, _place, _printed, _correct, "quadrature", [sees, "slopes.ggx", "sampling.slope_ggx.pdf", "jacobian.slope"],
        tolerance=1e-11, change=as_printed,
    )  # fmt: skip
    def projection_of_slopes(projection, P22, pdf, jacobian):
        """The visible slopes of (6), from the projected area ⟨ω_i, ω_m⟩/(ω_m·n) of a slope's own normal."""
        i = cases.direction(50, 0)
        s = plane()
        m = unit(np.concatenate([-s, np.ones((len(s), 1))], axis=-1))
        rule, weight = ggx_rule(i, ONE)
        area = np.sum(weight / rule[:, 2] ** 3 * front(i, rule) / rule[:, 2] * P22(slope_of(rule), ONE))
        got = np.maximum(0, projection(i, s)) * P22(s, ONE) / area
        return worst(got - pdf(m, i, ONE) / jacobian(m))


@erratum(
    HEITZ, "(7) text", "c = ∬ χ⁺(s) s P22 with s = x_i x̃ + y_i ỹ + z_i", "s = -x_i x̃ - y_i ỹ + z_i; the same c for even P22 only",
    "quadrature", [sees, "slopes.ellipsoid", "ndf.ellipsoid"], tolerance=1e-3, change=as_printed,
)  # fmt: skip
def normalisation_of_slopes(projection, P22, D):
    """c of a skewed distribution against ∫ ⟨ω_i, ω_m⟩ D dω_m of (5). Tolerance: the whole lobe by one rule, with a kink."""
    A = cases.SHAPES[2]
    i = np.stack([cases.direction(50, 0.4), cases.direction(70, 2.0)])
    m, weight = charts.lune(NORMAL, NORMAL, A, 100)
    s = slope_of(m)
    c = [np.sum(weight / m[:, 2] ** 3 * np.maximum(0, projection(x, s)) * P22(s, A)) for x in i]
    expected = [np.sum(weight * front(x, m) * D(m, A)) for x in i]
    return max(
        relative(c, expected), relative(expected, [np.sum(w * dot(x, n) * D(n, A)) for x, (n, w) in lunes(i, A)])
    )


def lunes(i, A):
    """Each direction with the rule over the micronormals that it sees."""
    return [(x, charts.lune(x, NORMAL, A)) for x in i]


@erratum(
    HEITZ, "(12)", "χ⁺(x_i x̃ + z_i)(x_i x̃ + z_i)", "χ⁺(-x_i x̃ + z_i)(-x_i x̃ + z_i)", "quadrature",
    [sees, "sampling.slope_ggx.pdf"], tolerance=0, change=as_printed,
)  # fmt: skip
def conditional_is_defined(projection, pdf):
    """The factor cancels, but where it is 0 the first line is 0/0: the share of the visible slopes for which it is."""
    i = cases.direction(50, 0)
    m, weight = ggx_rule(i, ONE)
    return float(np.sum(weight * pdf(m, i, ONE) * (projection(i, slope_of(m)) <= 0)))


@erratum(
    HEITZ, "§5.2 footnote", "ω_m = (-y_m̃/λ_x, -y_m̃/λ_y, 1)/‖…‖", "ω_m = (-x_m̃/λ_x, -y_m̃/λ_y, 1)/‖…‖", "exact",
    [lambda s, factor: np.c_[-s / factor, np.ones(len(s))]], tolerance=ROUNDING,
    change=lambda f: lambda s, factor: np.c_[-s[:, 1:] / factor, np.ones(len(s))],
)  # fmt: skip
def stretched_normal(stretched):
    """Normals stay perpendicular to the surface: to the stretched tangent vectors (λ_x, 0, x̃) and (0, λ_y, ỹ)."""
    s, factor = plane(), np.array([0.3, 2.0])
    m, zero = unit(stretched(s, factor)), np.zeros(len(s))
    first, second = np.stack([zero + factor[0], zero, s[:, 0]], -1), np.stack([zero, zero + factor[1], s[:, 1]], -1)
    return max(worst(dot(m, first)), worst(dot(m, second)))


@erratum(
    HEITZ, "appendix A", "second and third line: 1/√((λ_x x_i)² + (λ_y y_i)² + z_i²) in the denominator only",
    "the same root also in the numerator", "quadrature", [lambda i, factor: norm(i * np.array([*factor, 1]))], tolerance=1e-11,
    change=lambda f: lambda i, factor: 1.0,
)  # fmt: skip
def appendix_a_second_line(root_of_numerator):
    """The second line divides by the same integral as the first: at (9)'s left side the value has to stay."""
    i, factor, alpha = cases.direction(50, 0.4), np.array([0.3, 2.0]), np.array([0.4, 0.7])
    m, weight = ggx_rule(i, alpha)
    s, w = slope_of(m), weight / m[:, 2] ** 3
    P22 = 1 / (np.pi * alpha.prod() * (1 + np.sum((s / alpha) ** 2, axis=-1)) ** 2)
    seen = np.maximum(0, sees(i, s)) * P22
    root = norm(i * np.array([*factor, 1]))
    return relative(seen / root_of_numerator(i, factor) / (w @ seen / root), seen / (w @ seen))


@erratum(
    HEITZ, "algorithm 4", "x_m̃ ← C2-(U1), y_m̃ ← C2|2(U2 | x_m̃)", "their inverses, x_m̃ ← C2-⁻¹(U1), y_m̃ ← C2|2⁻¹(U2 | x_m̃)", "exact",
    [lambda u, x, cdf, inverse: inverse(u, x)], tolerance=ROUNDING, change=lambda f: lambda u, x, cdf, inverse: cdf(u, x),
)  # fmt: skip
def inverse_distribution(step):
    """Step 2.b for Beckmann-like tails of GGX at α = 1, a = √(1 + x̃²): C(step(u)) has to be u."""

    def cdf(y, x):
        t = np.arctan(y / np.hypot(1, x))
        return 0.5 + (t + np.sin(t) * np.cos(t)) / np.pi

    def inverse(u, x):
        low, high = np.full_like(u, -np.pi / 2), np.full_like(u, np.pi / 2)
        for _ in range(60):
            middle = (low + high) / 2
            below = 0.5 + (middle + np.sin(middle) * np.cos(middle)) / np.pi < u
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return np.hypot(1, x) * np.tan((low + high) / 2)

    u, x = cases.pairs(np.linspace(0.05, 0.95, 19), np.linspace(-2, 2, 9))
    return worst(cdf(step(u, x, cdf, inverse), x) - u)


@erratum(
    HEITZ, "§5.3 memory", "32 MB for two tables of 1024² numbers", "16 MiB in double, 8 MiB in single precision", "exact",
    [lambda: 16.0], tolerance=0, change=lambda f: lambda: 32.0,
)  # fmt: skip
def table_memory(mebibytes):
    return abs(mebibytes() - 2 * 1024**2 * np.dtype(np.float64).itemsize / 2**20)
