"""Heitz & d'Eon 2014, §2: distributions of normals and visible normals, masking, the operators and their Jacobians."""

from functools import partial

import numpy as np

from ggxref.verify import cases, charts, engine
from ggxref.verify.charts import NORMAL, diagonal, dot, front, gaussian, integrals, lune
from ggxref.verify.engine import relative, worst

PAPER = "heitz2014"
check = partial(engine.check, PAPER)

# Sums of 10^3 to 10^4 terms of a smooth integrand, in coordinates where the rule is exact or converged: measured worst
# 3e-14 over all cases. A dropped factor is wrong by percents.
QUADRATURE = 1e-12
# Pointwise identities between terms of order 1: tens of roundings.
ROUNDING = 1e-13


def mirrored(wm):
    """The other facet of a V-cavity, (-x, -y, z)."""
    return wm * np.array([-1, -1, 1])


def ggx_rule(wi, alpha, folded=False, n=24):
    """Quadrature over the GGX normals that wi sees; `folded` allows a kink where wi ⟂ m', the V-cavity's other facet."""
    A = diagonal(alpha)
    return lune(wi, NORMAL, A, n, [2 * charts.frame(A @ wi, NORMAL)[1] - np.pi / 2] if folded else [])


def beckmann_rule(wi, alpha, folded=False):
    return gaussian(wi, alpha, breaks=[-charts.cotangent(wi, alpha)] if folded else [])


@check(
    "(1)", "∫ (m·n) D dm = 1, GGX", "quadrature", "ndf.ggx", tolerance=QUADRATURE, rule=ggx_rule,
    mutant=("α_x² for α_x α_y", lambda D: lambda m, a: D(m, a) * a[..., 1] / a[..., 0]),
)  # fmt: skip
@check(
    "(1)", "∫ (m·n) D dm = 1, Beckmann", "quadrature", "ndf.beckmann", tolerance=QUADRATURE, rule=beckmann_rule,
    mutant=("cos³ for cos⁴", lambda D: lambda m, a: D(m, a) * m[..., 2]),
)  # fmt: skip
def normals_are_normalised(D, rule):
    rules = [rule(NORMAL, alpha) for alpha in cases.ALPHAS]
    return relative(integrals(lambda m, a: D(m, a) * m[:, 2], rules, cases.ALPHAS), 1)


@check(
    "(2)", "∫ G1 |wi·m| D / |wi·n| dm = 1, Smith GGX", "quadrature", ["masking.g1_ggx", "ndf.ggx"],
    tolerance=QUADRATURE, rule=ggx_rule,
    mutant=("√(α_x α_y) for α in G1", lambda g1: lambda w, m, a: g1(w, m, np.sqrt(a * a[..., ::-1]))),
)  # fmt: skip
@check(
    "(2)", "∫ G1 |wi·m| D / |wi·n| dm = 1, Smith Beckmann", "quadrature", ["masking.g1_beckmann", "ndf.beckmann"],
    tolerance=QUADRATURE, rule=beckmann_rule,
    mutant=("GGX's masking", lambda g1: lambda w, m, a: 2 / (1 + np.linalg.norm(w * [*a[0], 1], axis=-1) / w[..., 2])),
)  # fmt: skip
def visible_normals_are_normalised(g1, D, rule):
    wi, alpha = cases.pairs(cases.UP, cases.ALPHAS)

    def visible(m, i, a):
        return g1(i, m, a) * np.abs(dot(i, m)) * D(m, a) / i[:, 2]

    return relative(integrals(visible, [rule(i, a) for i, a in zip(wi, alpha, strict=True)], wi, alpha), 1)


@check(
    "(2)", "∫ G1 |wi·m| D / |wi·n| dm = 1, V-cavities of GGX", "quadrature", ["masking.g1_v_cavity", "ndf.ggx"],
    tolerance=QUADRATURE, rule=ggx_rule, mutant=("no minimum with 1", lambda g1: unclamped_v_cavity),
)  # fmt: skip
@check(
    "(2)", "∫ G1 |wi·m| D / |wi·n| dm = 1, V-cavities of Beckmann", "quadrature",
    ["masking.g1_v_cavity", "ndf.beckmann"], tolerance=QUADRATURE, rule=beckmann_rule,
    mutant=("no minimum with 1", lambda g1: unclamped_v_cavity),
)  # fmt: skip
def v_cavities_are_normalised(g1, D, rule):
    wi, alpha = cases.pairs(cases.UP, cases.ALPHAS)

    def visible(m, i, a):
        return g1(i, m) * np.abs(dot(i, m)) * D(m, a) / i[:, 2]

    rules = [rule(i, a, folded=True) for i, a in zip(wi, alpha, strict=True)]
    return relative(integrals(visible, rules, wi, alpha), 1)


def unclamped_v_cavity(w, m):
    return 2 * m[..., 2] * w[..., 2] / np.abs(dot(w, m))


@check(
    "(3)", "a V-cavity shows its projected area: G1(m)⟨w,m⟩ + G1(m')⟨w,m'⟩ = 2 (m·n)(w·n), 0 ≤ G1 ≤ 1", "exact",
    "masking.g1_v_cavity", tolerance=ROUNDING, mutant=("no minimum with 1", lambda g1: unclamped_v_cavity),
)  # fmt: skip
def v_cavity_conserves_area(g1):
    w, m = cases.pairs(cases.UP, cases.hemisphere(500))
    seen, other = g1(w, m), g1(w, mirrored(m))
    area = seen * front(w, m) + other * front(w, mirrored(m)) - 2 * m[:, 2] * w[:, 2]
    return max(worst(area), worst(np.maximum(0, seen - 1)), worst(np.minimum(0, seen)))


@check(
    "(3)", "χ⁺: back faces are masked; from below G1(w, m) = G1(-w, m)", "exact",
    ["masking.g1_ggx", "masking.g1_beckmann", "masking.g1_v_cavity"], tolerance=0,
    mutant=("no χ⁺", lambda g1: lambda w, m, a: g1(w, np.where(dot(w, m)[..., None] < 0, -m, m), a)),
)  # fmt: skip
def masking_has_a_front(ggx, beckmann, v_cavity):
    w, m = cases.pairs(cases.sphere(60), cases.hemisphere(60))
    back = dot(w, m) * w[:, 2] <= 0
    alpha = np.array([0.5, 0.2])
    models = [lambda w, m: ggx(w, m, alpha), lambda w, m: beckmann(w, m, alpha), v_cavity]
    return max(max(worst(g1(w, m)[back]), worst(g1(w, m) - g1(-w, m))) for g1 in models)


@check(
    "§2.1 G2", "V-cavity: G2 is the overlap of the parts of a facet that wi and wo see, from the top or from the bottom",
    "exact", "masking.g2_v_cavity", tolerance=ROUNDING,
    mutant=("separable", lambda g2: lambda i, o, m: v_cavity_part(i, m) * v_cavity_part(o, m)),
)  # fmt: skip
def v_cavity_correlation(g2):
    """wi above sees the top part of a facet; wo above sees the top too, wo below the far side: the bottom part."""
    i, o, m = cases.triples(cases.UP, cases.sphere(40), cases.hemisphere(40))
    top_i, part = v_cavity_part(i, m), v_cavity_part(o, m)
    low, high = np.where(o[:, 2] > 0, 1 - part, 0), np.where(o[:, 2] > 0, 1, part)
    return worst(g2(i, o, m) - np.maximum(0, high - np.maximum(low, 1 - top_i)))


def v_cavity_part(w, m):
    """Visible part of a facet, by intersecting the ray that grazes the opposite rim with the facet's profile.

    In the plane of the groove the facet runs from the bottom (0, 0) to its rim (-1, h), the other from there to (1, h).
    """
    flat = np.hypot(m[:, 0], m[:, 1])
    x, z = (w[:, 0] * m[:, 0] + w[:, 1] * m[:, 1]) / flat, w[:, 2]
    x, z = np.where(z < 0, -x, x), np.abs(z)
    h = flat / m[:, 2]
    # The facet (-t, h t) is lit through the rim (1, h) from t on: (1 + t) z = (h - h t) x, where x leans over the other.
    shadow_end = np.where(x > 0, (h * x - z) / (h * x + z), 0)
    return np.where(x * flat + z * m[:, 2] > 0, 1 - np.clip(shadow_end, 0, 1), 0)


@check(
    "§2.2 reflect", "the mirror image: unit, in the plane of wi and m, at the same angle", "exact", "geometry.reflect",
    tolerance=ROUNDING, mutant=("(wi·m) without the 2", lambda f: lambda w, m: dot(w, m)[..., None] * m - w),
)  # fmt: skip
def reflection_law(reflect):
    w, m = cases.pairs(cases.sphere(100), cases.sphere(100))
    o = reflect(w, m)
    return max(worst(dot(o, o) - 1), worst(dot(o, m) - dot(w, m)), worst(np.cross(o + w, m)))


def printed_transmit(w, m, eta, power=1):
    c = dot(w, m)
    root = np.sqrt(np.maximum(0, 1 + eta**power * (c**2 - 1)))
    return (eta * c - np.sign(w[..., 2]) * root)[..., None] * m - eta[..., None] * w


@check(
    "§2.2 transmit", "Snell's law: unit, coplanar, on the other side, n_i sin θ_i = n_o sin θ_o; none in total reflection",
    "exact", "geometry.refract", tolerance=ROUNDING, mutant=("n for n² under the root", lambda f: printed_transmit),
)  # fmt: skip
def refraction_law(refract):
    w, m, eta = cases.triples(cases.sphere(60), cases.sphere(60), np.array([0.5, 0.66, 1.0, 1.5, 2.4]))
    o, c = refract(w, m, eta), dot(w, m)
    passes = 1 + eta**2 * (c**2 - 1) > 1e-9
    snell = np.cross(o, m) + eta[:, None] * np.cross(w, m)
    side = np.maximum(0, dot(o, m) * np.sign(c))
    total = 1 + eta**2 * (c**2 - 1) < 0
    return max(worst(dot(o, o)[passes] - 1), worst(snell[passes]), worst(side[passes]), worst(o[total]))


@check(
    "§2.2 ∂ω_hr", "reflection Jacobian 1/(4|wo·m|), against the derivatives of the half vector and of the mirror image",
    "autodiff", ["jacobian.reflection", "geometry.half_reflection", "geometry.reflect"], tolerance=ROUNDING,
    mutant=("1/(2|wo·m|)", lambda f: lambda o, m: 2 * f(o, m)),
)  # fmt: skip
def reflection_jacobian(jacobian, half, reflect):
    i, o = cases.pairs(cases.UP, cases.hemisphere(200))
    m = half(i, o)
    return max(
        relative(half.area_ratio(1)(i, o), jacobian(o, m)), relative(reflect.area_ratio(1)(i, m) * jacobian(o, m), 1)
    )


@check(
    "§2.2 ∂ω_ht", "refraction Jacobian n_o²|wo·m|/(n_i wi·m + n_o wo·m)², against the derivatives of both operators",
    "autodiff", ["jacobian.refraction", "geometry.half_refraction", "geometry.refract"], tolerance=1e-11,
    mutant=("n_i² for n_o²", lambda f: lambda i, o, m, a, b: f(i, o, m, a, b) * (a / b) ** 2),
)  # fmt: skip
def refraction_jacobian(jacobian, half, refract):
    """Tolerance: the denominator is a difference of terms up to a hundred times its size."""
    m, w, n_o = cases.triples(cases.hemisphere(60), cases.UP, np.array([0.66, 0.8, 1.33, 1.5, 2.4]))
    n_i = np.full_like(n_o, 1.1)
    o = refract(w, m, n_i / n_o)
    keep = (dot(w, m) > 0.05) & (dot(o, m) < -0.05) & (o[:, 2] < -0.05)
    i, o, n_i, n_o = w[keep], o[keep], n_i[keep], n_o[keep]
    h = half(i, o, n_i, n_o)
    expected = jacobian(i, o, h, n_i, n_o)
    by_half = relative(half.area_ratio(1)(i, o, n_i, n_o), expected)
    return max(by_half, relative(refract.area_ratio(1)(i, h, n_i / n_o) * expected, 1))
