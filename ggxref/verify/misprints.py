"""The documents' misprints, each as a formula in both forms with a property that only the right one has."""

import numpy as np

from ggxref.verify import cases, charts, samplers
from ggxref.verify.charts import NORMAL, dot, front, gauss, integrals, unit
from ggxref.verify.dupuy2023 import listing_1, listing_1_as_printed, listing_3, warp
from ggxref.verify.engine import relative, worst
from ggxref.verify.errata import erratum
from ggxref.verify.heitz2014 import ggx_rule, printed_transmit
from ggxref.verify.heitz2014_bsdf import ALPHA, N_I, N_O, SMITH, refracting
from ggxref.verify.heitz2014_slopes import ONE, plane, sees, slope_of
from ggxref.verify.tokuyoshi2024 import horizon, literal_k, reflected_height
from ggxref.verify.walter2014 import norm, times
from ggxref.verify.walter2014_sampling import lune_probability_error, rational_fit_error

HEITZ, WALTER, DUPUY, TOKUYOSHI = "heitz2014", "walter2014", "dupuy2023", "tokuyoshi2024"
ROUNDING = 1e-12


# heitz2014


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


# walter2014


@erratum(
    WALTER, "(25)", "(M a) × (M b) = |M| Mᵀ (a × b)", "|M| M⁻ᵀ (a × b)", "exact",
    [lambda M: np.linalg.inv(M).T], tolerance=ROUNDING, change=lambda f: lambda M: M.T,
)  # fmt: skip
def cross_product_of_images(cofactor):
    a, b = cases.pairs(cases.sphere(20), cases.sphere(21))
    errors = []
    for M in cases.SHAPES:
        got = np.cross(a @ M.T, b @ M.T) - np.linalg.det(M) * np.cross(a, b) @ cofactor(M).T
        errors.append(worst(got) / np.linalg.norm(M) ** 2)
    return max(errors)


@erratum(
    WALTER, "(46) mapping", "A p_c would be the corresponding point on the ellipsoidal lune", "A⁻¹ p_c, by (24)", "exact",
    [lambda A, p: p @ np.linalg.inv(A).T], tolerance=ROUNDING, change=lambda f: lambda A, p: p @ A.T,
)  # fmt: skip
def point_on_ellipsoid(mapping):
    p = cases.sphere(200)
    return max(worst(norm(mapping(A, p) @ A.T) - 1) for A in cases.SHAPES)


@erratum(
    WALTER, "(48)", "A_e(n)/(4 A_e(ψ, n))", "A_e(n)/(4 A_ℓ(ψ, n)), as in (33)", "quadrature",
    ["ellipsoid.lune_area", "ellipsoid.projected_area", "ndf.ellipsoid"], tolerance=1e-11, origin="converter",
    change=lambda f: lambda u, v, A, C: np.pi * norm(times(A, u)) / np.abs(np.linalg.det(A)),
)  # fmt: skip
def reflected_density(lune_area, projected_area, D):
    """p_o 4|ψ·m| integrates to 1 over the micronormals in front."""
    i, A = cases.pairs(cases.UP, cases.SHAPES)
    rules = [charts.lune(x, NORMAL, B) for x, B in zip(i, A, strict=True)]

    def density(m, i, A):
        p_o = projected_area(NORMAL, A, 1.0) / (4 * lune_area(i, NORMAL, A, 1.0)) * D(m, A)
        return 4 * front(i, m) * p_o

    return relative(integrals(density, rules, i, A), 1)


@erratum(
    WALTER, "§4.2", "Our approach does involve any approximations", "Our approach does not involve any approximations", "autodiff",
    [lune_probability_error, "sampling.lune.pdf", "sampling.lune.sample"], tolerance=1e-10,
    change=lambda f: lambda pdf, sample: rational_fit_error(),
)  # fmt: skip
def sampled_probabilities_are_exact(average_error, pdf, sample):
    """Average relative error of the sampled density against p_h; the control is the fit that the section faults."""
    return average_error(pdf, sample)


@erratum(
    WALTER, "§2.4", "pick C_e such that A_ℓ(n) = 1 by inverting equation 26", "A_e(n) = 1", "exact",
    ["ellipsoid.projected_area", "ellipsoid.size"], tolerance=1e-13, origin="converter",
    change=lambda f: lambda u, A, C: f(u, A, C) * (1 + dot(unit(times(A, NORMAL)), unit(times(A, cases.direction(60))))) / 2,
)  # fmt: skip
def size_convention(area, size):
    """(29) makes the whole projected area 1; a lune's, which needs a second direction (here one 60° off), is smaller."""
    return relative(area(NORMAL, cases.SHAPES, size(cases.SHAPES)), 1)


# dupuy2023


@erratum(
    DUPUY, "listing 1, line 8", "normalize(vec3(wi.xy * alpha, wi.z))", "normalize(vec3(wmStd.xy * alpha, wmStd.z))", "exact",
    [listing_1, "sampling.slope_ggx.pdf"], tolerance=1e-10, change=lambda f: listing_1_as_printed,
)  # fmt: skip
def warped_normals_are_visible(listing, pdf):
    """Every sample has a positive density, and the mean of 1/density over the lobe is its solid angle on a small cap."""
    u = samplers.lattice(4000)
    i, alpha = samplers.VISIBLE[3]
    m = listing(u, i, alpha, listing_3)
    return worst(
        np.sort((charts.unit(m / np.array([*alpha, 1])) @ warp(i, alpha)) ** 2) - _cosine_quantiles(u, i, alpha)
    )


def _cosine_quantiles(u, i, alpha):
    """Order statistics of (i'·m')² on the cap: (1 + i'·o')/2 of the listing's own reflections."""
    inner = warp(i, alpha)
    o = listing_3(u, inner) - inner
    return np.sort((1 + o @ inner) / 2)


@erratum(
    DUPUY, "appendix A, step (2)", "ω_b = 2(ω_m·ω_a)ω_m ω_a", "ω_b = 2(ω_m·ω_a)ω_m - ω_a, as in (5)", "exact",
    "geometry.reflect", tolerance=ROUNDING, origin="converter",
    change=lambda f: lambda w, m: 2 * dot(w, m)[:, None] * m * w,
)  # fmt: skip
def reflected_at_equal_angles(reflect):
    w, m = cases.pairs(cases.UP, cases.hemisphere(200))
    o = reflect(w, m)
    return max(worst(norm(o) - 1), worst(dot(o, m) - dot(w, m)))


@erratum(
    DUPUY, "abstract", "up to 39% speed-ups in our benchmarks", "up to 53%: §4 reports 37.67, 52.96 and 39.25%", "exact",
    [lambda: 53.0], tolerance=0.5, change=lambda f: lambda: 39.0,
)  # fmt: skip
def largest_speed_up(claimed):
    return abs(claimed() - max(37.67, 52.96, 39.25))


# tokuyoshi2024


@erratum(
    TOKUYOSHI, "(3)", "G1 = 1/(1 + Λ), so that with |ω_i·ω_m| in (1) back faces count",
    "G1 = χ⁺(ω·ω_m)/(1 + Λ)", "quadrature", [lambda i, m: dot(i, m) > 0, "masking.lambda_ggx", "ndf.ggx"], tolerance=1e-10,
    change=lambda f: lambda i, m: np.ones(len(m)),
)  # fmt: skip
def back_faces_are_hidden(seen, smith, D):
    """Over the whole hemisphere, front and back faces by a rule each."""
    i = cases.UP[1:]
    alpha = np.broadcast_to(ALPHA, (len(i), 2))

    def visible(m, i, a):
        return seen(i, m) / (1 + smith(i, a)) * np.abs(dot(i, m)) * D(m, a) / i[:, 2]

    before = integrals(visible, [ggx_rule(x, a) for x, a in zip(i, alpha, strict=True)], i, alpha)
    behind = integrals(visible, [ggx_rule(-x, a) for x, a in zip(i, alpha, strict=True)], i, alpha)
    return relative(before + behind, 1)


@erratum(
    TOKUYOSHI, "(25)", "ω'_o = 2(ω'_i·ω'_m) z'_m - ω'_i", "ω'_o = 2(ω'_i·ω'_m) ω'_m - ω'_i", "exact",
    ["geometry.reflect"], tolerance=ROUNDING, change=lambda f: lambda w, m: 2 * (dot(w, m) * m[:, 2])[:, None] - w,
)  # fmt: skip
def reflected_vector(reflect):
    w, m = cases.pairs(cases.UP, cases.hemisphere(200))
    return worst(norm(reflect(w, m)) - 1)


@erratum(
    TOKUYOSHI, "(28)-(31)", "x_m/a_m", "x_m/a_x (there is no a_m; read as a_y it fails)", "exact",
    [lambda i, o, a: height_by_30(i, o, a, a[:, 0])], tolerance=ROUNDING,
    change=lambda f: lambda i, o, a: height_by_30(i, o, a, a[:, 1]),
)  # fmt: skip
def heights(formula):
    i, o, alpha = cases.triples(cases.UP[:4], cases.hemisphere(100), cases.ALPHAS[2:])
    return worst(formula(i, o, alpha) - reflected_height(i, o, alpha))


def height_by_30(i, o, alpha, first):
    h = i + o
    length = norm(np.c_[i[:, :2] * alpha, i[:, 2]])
    square = (h[:, 0] / first) ** 2 + (h[:, 1] / alpha[:, 1]) ** 2 + h[:, 2] ** 2
    return h[:, 2] * dot(h, h) / (length * square) - i[:, 2] / length


@erratum(
    TOKUYOSHI, "§ spherical cap", "f_p = 1/(2π(1 + z'_i)) is the area of the cap", "it is the reciprocal of the area", "quadrature",
    [lambda f: 1 / f, "sampling.spherical_cap.cap_pdf"], tolerance=ROUNDING, change=lambda f: lambda value: value,
)  # fmt: skip
def area_of_cap(area, cap_pdf):
    i = cases.ALL
    expected = [2 * np.pi * gauss([-x[2], 1], 4)[1].sum() for x in i]
    return relative(area(cap_pdf(np.broadcast_to(NORMAL, i.shape), i)), expected)


@erratum(
    TOKUYOSHI, "(32) text", "numerator and denominator differ by α² z_i²", "by (1 - α²) z_i²", "exact",
    [lambda a, z: (1 - a**2) * z**2], tolerance=ROUNDING, change=lambda f: lambda a, z: a**2 * z**2,
)  # fmt: skip
def difference_of_terms(claimed):
    r, a, z = cases.triples(np.linspace(0, 4, 9), np.array([0.05, 0.5, 0.9]), np.array([0.1, 0.9]))
    return worst((r + z**2) - (r + a**2 * z**2) - claimed(a, z))


@erratum(
    TOKUYOSHI, "(32)", "argmin_φ o'_z = {…} i'_z", "o'_z = {…} i'_z: the right side is the value, not the angle", "exact",
    [lambda height, phi: height], tolerance=ROUNDING, change=lambda f: lambda height, phi: phi,
)  # fmt: skip
def height_on_horizon(left_side):
    """At each azimuth, isotropic α."""
    i, alpha = cases.direction(60, 0.0), np.array([0.4, 0.4])
    o = horizon(24)
    height, phi = reflected_height(i, o, alpha), np.arctan2(o[:, 1], o[:, 0])
    r = (i[0] + o[:, 0]) ** 2 + (i[1] + o[:, 1]) ** 2
    right = (0.16 * (r + i[2] ** 2) / (r + 0.16 * i[2] ** 2) - 1) * warp(i, alpha)[2]
    return worst(left_side(height, phi) - right)


@erratum(
    TOKUYOSHI, "(38) text", "samples in [-z_i, -k z_i] are not needed", "in [-z'_i, -k z'_i]: heights in stretched space", "exact",
    [lambda i, alpha: -literal_k(i, alpha) * warp(i, alpha)[2]], tolerance=ROUNDING,
    change=lambda f: lambda i, alpha: -literal_k(i, alpha) * i[2],
)  # fmt: skip
def least_height(bound):
    """The bound is the least height that a direction above the horizon reaches, for isotropic α below 1."""
    i, alpha = cases.direction(60, 0.0), np.array([0.4, 0.4])
    return abs(float(bound(i, alpha) - reflected_height(i, np.array([1.0, 0.0, 0.0]), alpha)))
