"""Dupuy & Benyoub 2023: normalisation and law of the cap, and G2 and D as integrals and changes of variable."""

from functools import partial

import numpy as np

from ggxref.verify import cases, engine
from ggxref.verify.charts import NORMAL, front, gauss, integrals, lune
from ggxref.verify.dupuy2023 import PAPER, QUADRATURE, ROUNDING, SPHERE, rules, warp
from ggxref.verify.engine import relative, worst
from ggxref.verify.statistics import FALSE_ALARM, uniform_square

check = partial(engine.check, PAPER)


@check(
    "(2)", "∫ D_vis,std dm = 1, from above and below", "quadrature", "sampling.spherical_cap.pdf", tolerance=QUADRATURE,
    mutant=("σ_std = z_i", lambda f: lambda m, i, a: f(m, i, a) * (1 + i[..., 2]) / 2),
    also=["tokuyoshi2024 (5)", "tokuyoshi2024 (8)"],
)  # fmt: skip
def standard_density_is_normalised(pdf):
    i = cases.ALL
    return relative(integrals(lambda m, i: pdf(m, i, SPHERE), [lune(x, NORMAL, np.eye(3)) for x in i], i), 1)


@check(
    "(7)", "reflections of samples of D_vis,std are uniform on the cap z' > -z_i", "monte_carlo",
    ["sampling.slope_ggx.sample", "geometry.reflect"], tolerance=FALSE_ALARM,
    mutant=("samples of D cos", lambda f: lambda u, i, a: f(u, NORMAL, a)),
    also=["(9)", *(f"tokuyoshi2024 ({k})" for k in (19, 20, 23, 24))],
)  # fmt: skip
def reflections_are_uniform(sample, reflect, stream):
    """Drawn by slopes, which knows nothing of caps."""
    v = []
    for i in (cases.direction(20), cases.direction(89), cases.direction(110, 1.0)):
        o = reflect(i, sample(stream.uniform(stream.samples // 4, 2), i, SPHERE))
        v.append(np.stack([np.arctan2(o[:, 1], o[:, 0]) / (2 * np.pi) % 1, (o[:, 2] + i[2]) / (1 + i[2])], axis=-1))
    inside = np.clip(v, 0, 1)  # rounding alone may leave the cap
    return uniform_square(inside) if worst(v - inside) < 1e-12 else np.inf


@check(
    "(12)", "(m·n) D dm = (m'·n) D_std dm', by differentiating the stretch m → m'", "autodiff",
    ["ndf.ggx", "ndf.hemisphere", "slopes.stretch"], tolerance=ROUNDING,
    mutant=("‖Mᵀm‖³", lambda D: lambda m, a: D(m, a) * np.linalg.norm(np.c_[m[:, :2] / a, m[:, 2]], axis=-1)),
)  # fmt: skip
def projected_area_is_kept(D, D_std, stretch):
    m, alpha = cases.pairs(cases.hemisphere(300), cases.ALPHAS[1:])
    standard = stretch(m, 1 / alpha)
    expected = standard[:, 2] * D_std(standard) * stretch.area_ratio(0)(m, 1 / alpha)
    return relative(m[:, 2] * D(m, alpha), expected)


@check(
    "(13)", "G2 is the mean over heights of h^Λ_i h^Λ_o, h the share of lower heights, with Λ the area that faces away", "quadrature",
    ["masking.g2_height_correlated", "masking.g1_ggx", "ndf.ggx"], tolerance=1e-9, also=["(14)"],
    mutant=("separable", lambda f: lambda a, b: a * b),
)  # fmt: skip
def heights_are_shared(g2, g1, D):
    """A point is seen from a direction with probability h^Λ (Smith); towards grazing all that is seen is near h = 1."""
    w, alpha = cases.pairs(cases.UP, cases.ALPHAS[2:])
    away = integrals(lambda m, w, a: front(-w, m) * D(m, a), rules(-w, alpha), w, alpha) / w[:, 2]
    one = g1(w, w, alpha).reshape(len(cases.UP), -1)
    away = away.reshape(one.shape)
    # Graded to both ends: a power below 1 at 0, a high one at 1.
    h, weight = gauss([0, 1e-10, 1e-7, 1e-4, 1e-2, 0.5, 0.9, 0.99, 0.999, 1], 30)
    seen = h ** (away[:, None] + away[None, :])[..., None] @ weight
    return relative(g2(*np.broadcast_arrays(one[:, None], one[None, :])), seen)


@check(
    "(1)", "‖∂m'/∂m‖ = |det M⁻¹|/‖M⁻¹m‖³ of the inverse stretch, against the derivative of the map", "autodiff",
    ["jacobian.linear", "slopes.stretch"], tolerance=ROUNDING, also=[f"tokuyoshi2024 ({k})" for k in (9, 12, 13, 16)],
    mutant=("‖M⁻¹m‖² for its cube", lambda f: lambda m, M: f(m, M) * np.linalg.norm(np.einsum("...ij,...j", M, m), axis=-1)),
)  # fmt: skip
def inverse_jacobian(jacobian, stretch):
    m, alpha = cases.pairs(cases.sphere(300), cases.ALPHAS[1:])
    M = np.eye(3) * np.c_[alpha, np.ones(len(alpha))][:, None]
    return max(relative(stretch.area_ratio(0)(m, alpha), jacobian(m, M)), worst(stretch(m, alpha) - warp(m, alpha)))
