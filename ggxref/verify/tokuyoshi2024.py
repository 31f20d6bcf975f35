"""The article on Tokuyoshi & Eto 2024: bounded sampling of visible GGX normals. Its equations are numbered in its order."""

from functools import partial

import numpy as np

from ggxref.verify import cases, charts, engine, laws, samplers
from ggxref.verify.charts import NORMAL, diagonal, dot, front, gauss, integrals, product, spread, unit
from ggxref.verify.dupuy2023 import swapped, warp
from ggxref.verify.engine import relative, worst
from ggxref.verify.heitz2014 import ggx_rule
from ggxref.verify.statistics import FALSE_ALARM

PAPER = "tokuyoshi2024"
check = partial(engine.check, PAPER)

QUADRATURE = 1e-12
ROUNDING = 1e-12
ABOVE = [(i, a) for i, a in samplers.VISIBLE if i[2] > 0]


# With both α above 1 as well, where the minimum with 1 acts.
WIDTHS = np.concatenate([cases.ALPHAS, [[1.5, 2.0]]])


def literal_k(i, alpha):
    """(35), (38), (39), with k = 1 where wi is not above the horizon."""
    a = np.minimum(alpha.min(axis=-1), 1)
    s = 1 + np.hypot(i[..., 0], i[..., 1])
    return np.where(i[..., 2] > 0, (1 - a**2) * s**2 / (s**2 + a**2 * i[..., 2] ** 2), 1)


def reflected_height(i, o, alpha):
    """o'_z, by reflecting the stretched wi about the stretched half vector of wi and wo."""
    inner, m = warp(i, alpha), warp(unit(i + o), 1 / alpha)
    return 2 * dot(inner, m) * m[..., 2] - inner[..., 2]


@check(
    "(1)", "∫ G1 |wi·m| D/(wi·n) dm = 1", "quadrature", ["masking.g1_ggx", "ndf.ggx"], tolerance=QUADRATURE,
    mutant=("axes swapped", swapped),
)  # fmt: skip
def visible_normals_are_normalised(g1, D):
    i, alpha = cases.pairs(cases.UP, cases.ALPHAS)
    rules = [ggx_rule(x, a) for x, a in zip(i, alpha, strict=True)]
    visible = integrals(lambda m, i, a: g1(i, m, a) * np.abs(dot(i, m)) * D(m, a) / i[:, 2], rules, i, alpha)
    return relative(visible, 1)


@check(
    "(2)", "D = 1/(π α_x α_y (x²/α_x² + y²/α_y² + z²)²) has ∫ D z dm = 1", "quadrature", "ndf.ggx", tolerance=QUADRATURE,
    mutant=("square lost", lambda D: lambda m, a: np.sqrt(D(m, a) / (np.pi * a.prod(axis=-1)))),
)  # fmt: skip
def normals_are_normalised(D):
    m, alpha = cases.pairs(cases.hemisphere(300), cases.ALPHAS)
    q = (m[:, 0] / alpha[:, 0]) ** 2 + (m[:, 1] / alpha[:, 1]) ** 2 + m[:, 2] ** 2
    total = integrals(lambda m, a: D(m, a) * m[:, 2], [ggx_rule(NORMAL, a) for a in cases.ALPHAS], cases.ALPHAS)
    return max(relative(total, 1), relative(D(m, alpha), 1 / (np.pi * alpha.prod(axis=-1) * q**2)))


@check(
    "(4)", "Λ = (-1 + √(1 + (α_x²x² + α_y²y²)/z²))/2 is the mean area hidden: ∫ max(-w·m, 0) D dm / z", "quadrature",
    ["masking.lambda_ggx", "ndf.ggx", "masking.g1_ggx"], tolerance=1e-10, also=["(3)"], mutant=("axes swapped", swapped),
)  # fmt: skip
def hidden_area(smith, D, g1):
    """Smith's Λ by its definition; (3) G1 = 1/(1 + Λ) with it. Tolerance: Λ is small against 1 near the normal."""
    w, alpha = cases.pairs(cases.UP[1:], cases.ALPHAS[1:])
    rules = [ggx_rule(-x, a) for x, a in zip(w, alpha, strict=True)]
    hidden = integrals(lambda m, w, a: front(-w, m) * D(m, a), rules, w, alpha) / w[:, 2]
    value = smith(w, alpha)
    return max(relative(value, hidden), worst(g1(w, w, alpha) - 1 / (1 + value)))


@check(
    "(8)", "D_vis,std = 2 (wi·m)/(π (1 + z_i)) on the front faces", "exact", "sampling.spherical_cap.pdf",
    tolerance=ROUNDING, mutant=("1/π for 2/π", lambda f: lambda m, i, a: f(m, i, a) / 2),
)  # fmt: skip
def standard_visible_density(pdf):
    i, m = cases.pairs(cases.ALL, cases.hemisphere(300))
    keep = np.abs(dot(i, m)) > 1e-3
    i, m = i[keep], m[keep]
    return worst(pdf(m, i, np.array([1.0, 1.0])) - 2 * front(i, m) / (np.pi * (1 + i[:, 2])))


@check(
    "(30)", "o'_z = (i_z + o_z)‖wi + wo‖²/(‖(α_x x_i, α_y y_i, z_i)‖ ‖(…/α_x, …/α_y, i_z + o_z)‖²) - i'_z", "exact",
    ["slopes.stretch", "geometry.reflect"], tolerance=ROUNDING, mutant=("multiplied by α for divided", lambda f: lambda w, a: f(w, 1 / a)),
)  # fmt: skip
def reflected_height_formula(stretch, reflect):
    i, o, alpha = cases.triples(cases.UP, cases.sphere(201), cases.ALPHAS[1:])
    i, o, alpha = (x[dot(i, o) > -0.99] for x in (i, o, alpha))
    inner, m = stretch(i, alpha), stretch(unit(i + o), 1 / alpha)
    h = i + o
    square = (h[:, 0] / alpha[:, 0]) ** 2 + (h[:, 1] / alpha[:, 1]) ** 2 + h[:, 2] ** 2
    length = np.linalg.norm(np.c_[i[:, :2] * alpha, i[:, 2]], axis=-1)
    formula = h[:, 2] * dot(h, h) / (length * square) - i[:, 2] / length
    return worst(reflect(inner, m)[:, 2] - formula)


def horizon(n=720):
    phi = np.linspace(0, 2 * np.pi, n, endpoint=False)
    return np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=-1)


@check(
    "(38)", "isotropic, α ≤ 1: -k z'_i is the least o'_z on the horizon, reached at wi's own azimuth", "exact",
    "sampling.bounded_cap.bound", tolerance=ROUNDING,
    mutant=("s = 1 + z_i", lambda f: lambda i, a: literal_k(np.c_[i[..., 2], 0 * i[..., 2], i[..., 2]], a)),
)  # fmt: skip
def least_height(bound):
    alphas = np.repeat(np.array([[1e-3], [0.05], [0.5], [1.0]]), 2, axis=1)
    i, alpha = cases.pairs(cases.UP[1:], alphas)
    low = -bound(i, alpha) * warp(i, alpha)[:, 2]
    own = unit(i * [1, 1, 0])
    lost = [np.max(low[k] - reflected_height(i[k], horizon(), alpha[k])) for k in range(len(i))]
    return max(worst(low - reflected_height(i, own, alpha)), max(0.0, *lost))


@check(
    "(39)", "no sample of the true support is lost: o'_z ≥ -k z'_i for every wo above the horizon, any α", "exact",
    ["sampling.bounded_cap.bound", "sampling.bounded_cap.pdf"], tolerance=ROUNDING,
    mutant=("larger α for smaller", lambda f: lambda i, a: literal_k(i, a.max(axis=-1, keepdims=True))),
)  # fmt: skip
def support_is_kept(bound, pdf):
    o = np.concatenate([cases.hemisphere(1500), horizon(360)])
    i, o, alpha = cases.triples(cases.UP, o, WIDTHS)
    lost = -bound(i, alpha) * warp(i, alpha)[:, 2] - reflected_height(i, o, alpha)
    above = o[:, 2] > 0  # the horizon itself is the edge, where rounding decides
    return max(worst(np.maximum(0, lost)), float(np.any(pdf(unit(i + o), i, alpha)[above] <= 0)))


@check(
    "(39)", "k = (1 - α²)s²/(s² + α²z_i²) with α = min(α_x, α_y, 1); 1 from below", "exact", "sampling.bounded_cap.bound",
    tolerance=ROUNDING, mutant=("α = α_x", lambda f: lambda i, a: literal_k(i, a[..., :1])),
)  # fmt: skip
def bound_formula(bound):
    i, alpha = cases.pairs(cases.ALL, WIDTHS)
    k = bound(i, alpha)
    return max(worst(k - literal_k(i, alpha)), worst(np.maximum(0, k - 1)), worst(np.minimum(0, k)))


def cap_rule(i, alpha, low):
    """Micronormals whose reflections lie on the cap o'_z > low, weighted for integrals over dm."""
    inner = warp(i, alpha)
    z, phi, weight = product(gauss([low, 1], 40), gauss([0, 2 * np.pi], 60))
    o = np.stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z], axis=-1)
    m = unit(o + inner)
    return spread(m, weight / (4 * dot(inner, m)), diagonal(alpha))


@check(
    "(43)", "∫ p_bound dm = 1 over its cap", "quadrature", "sampling.bounded_cap.pdf", tolerance=1e-11,
    mutant=("D_vis: without k", lambda f: lambda m, i, a: f(m, i, a) * (1 - 0.1 * i[..., 2] * a.max(axis=-1))),
)  # fmt: skip
def bounded_density_is_normalised(pdf):
    i, alpha = cases.pairs(cases.ALL, cases.ALPHAS[2:])
    low = -literal_k(i, alpha) * warp(i, alpha)[:, 2]
    rules = [cap_rule(*case) for case in zip(i, alpha, low, strict=True)]
    return relative(integrals(lambda m, i, a: pdf(m, i, a), rules, i, alpha), 1)


@check(
    "(43)", "p_bound = 2 D |wi·m|/(k z_i + ‖(α_x x_i, α_y y_i, z_i)‖) = p_sc ‖∂o'/∂m'‖ ‖∂m'/∂m‖ on the cap, else 0", "exact",
    ["sampling.bounded_cap.pdf", "ndf.ggx", "jacobian.reflection", "jacobian.linear"], tolerance=1e-10,
    mutant=("z'_i for z_i", lambda f: lambda m, i, a: f(m, i, a) * (1 + i[..., 2]) / (1 + warp(i, a)[..., 2])),
)  # fmt: skip
def bounded_density(pdf, D, by_mirror, linear):
    """Below the horizon the printed denominator cancels for small α, so those are left out."""
    i, m, alpha = cases.triples(cases.ALL, cases.hemisphere(200), cases.ALPHAS[2:])
    keep = dot(i, m) > 1e-3
    i, m, alpha = i[keep], m[keep], alpha[keep]
    k, inner = literal_k(i, alpha), warp(i, alpha)
    length = np.linalg.norm(np.c_[i[:, :2] * alpha, i[:, 2]], axis=-1)
    density = pdf(m, i, alpha)
    expected = 2 * D(m, alpha) * dot(i, m) / (k * i[:, 2] + length)
    m_std = warp(m, 1 / alpha)
    o = 2 * dot(inner, m_std)[:, None] * m_std - inner
    M = np.eye(3) * np.c_[1 / alpha, np.ones(len(alpha))][:, None]
    chain = linear(m, M) / by_mirror(o, m_std) / (2 * np.pi * (1 + k * inner[:, 2]))
    inside, outside = o[:, 2] > -k * inner[:, 2] + 1e-9, o[:, 2] < -k * inner[:, 2] - 1e-9
    return max(
        relative(density[inside], expected[inside]), relative(density[inside], chain[inside]), worst(density[outside])
    )


def on_cap(wm, wi, alpha):
    low = -literal_k(wi, alpha) * warp(wi, alpha)[2]
    return laws.reflected_cap(wm, wi, diagonal(alpha), float(low))


@check(
    "(41)", "reflections of the samples are uniform on the cap z' > -k z'_i", "monte_carlo", "sampling.bounded_cap.sample",
    tolerance=FALSE_ALARM, law=on_cap, cases=samplers.VISIBLE, mutant=("axes swapped", swapped),
)  # fmt: skip
def bounded_samples(sample, **settings):
    return samplers.follows(sample, **settings)


@check(
    "(40)", "the Jacobian of the map u → m is p_bound", "autodiff",
    ["sampling.bounded_cap.pdf", "sampling.bounded_cap.sample"], tolerance=1e-8, cases=samplers.VISIBLE,
    also=["(42)"],
    mutant=("D_vis: k = 1", lambda f: lambda m, i, a: f(m, i, a) * (1 + literal_k(i, a) * warp(i, a)[..., 2]) / (1 + warp(i, a)[..., 2])),
)  # fmt: skip
def bounded_jacobian(pdf, sample, **settings):
    return samplers.density_is_jacobian(pdf, sample, **settings)


@check(
    "limitation", "fewer samples end below the horizon than of D_vis, and none of weight above 1", "monte_carlo",
    ["sampling.bounded_cap.sample", "sampling.spherical_cap.sample", "sampling.bounded_cap.pdf", "bsdf.brdf", "ndf.ggx",
     "masking.g1_ggx", "masking.g2_height_correlated", "jacobian.reflection"],
    tolerance=1e-9, mutant=("drawn by D_vis", lambda f: lambda u, i, a: charts.unit(f(u, i, a) * [2, 2, 1])),
)  # fmt: skip
def bounded_is_better(sample, whole, pdf, brdf, D, g1, g2, jacobian, stream):
    """Tolerance: the density of a micronormal nearly perpendicular to wi loses digits to its rounding."""
    errors = []
    for i, alpha in ABOVE:
        u = stream.uniform(stream.samples // 4, 2)
        m = sample(u, i, alpha)
        o, o_whole = (2 * dot(i, x)[:, None] * x - i for x in (m, whole(u, i, alpha)))
        errors.append(max(0.0, np.mean(o[:, 2] <= 0) - np.mean(o_whole[:, 2] <= 0)))
        m, o = m[o[:, 2] > 1e-6], o[o[:, 2] > 1e-6]
        f = brdf(i, o, D(m, alpha), g2(g1(i, m, alpha), g1(o, m, alpha)), 1.0)
        errors.append(np.max(f * o[:, 2] / (pdf(m, i, alpha) * jacobian(o, m))) - 1)
    return max(0.0, *errors)
