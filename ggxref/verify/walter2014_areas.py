"""Walter et al. 2014 by quadrature: masking from below, the sampler's areas, unit size, the weight's mean, SGGX."""

from functools import partial

import numpy as np

from ggxref.verify import cases, engine
from ggxref.verify.charts import NORMAL, dot, front, integrals, lune, unit
from ggxref.verify.engine import relative, worst
from ggxref.verify.heitz2014_bsdf import hemispherical
from ggxref.verify.walter2014 import PAPER, QUADRATURE, skew_of, surface_areas, unflipped_g1
from ggxref.verify.walter2014_steps import POSITIVE, compression

check = partial(engine.check, PAPER)


@check(
    "(7)", "from below G1 = min(1, |ω·n|/∫ ⟨-ω·m⟩ D dm): what is seen from there of the same micronormals", "quadrature",
    ["masking.g1_ellipsoid", "ndf.ellipsoid"], tolerance=QUADRATURE,
    mutant=("the lune of ω itself", lambda g1: lambda w, m, A: unflipped_g1(w, m, A)),
)  # fmt: skip
def masking_from_below(g1, D):
    w, A = cases.pairs(cases.BELOW, cases.SHAPES)
    seen = integrals(
        lambda m, w, A: front(-w, m) * D(m, A), [lune(-x, NORMAL, y) for x, y in zip(w, A, strict=True)], w, A
    )
    return relative(g1(w, -w, A), np.minimum(1, -w[:, 2] / seen))


def repeated(u):
    """The direction for every shape."""
    return np.broadcast_to(u, (len(cases.SHAPES), 3))


@check(
    "(29)", "with C_e = √(|A|/(π‖A n‖)) the surface integral of the projected area along n is 1", "quadrature", "ellipsoid.size",
    tolerance=QUADRATURE, mutant=("without ‖A n‖", lambda f: lambda A: f(A) * np.sqrt(skew_of(A))),
)  # fmt: skip
def unit_size(size):
    n = repeated(NORMAL)
    return relative(size(cases.SHAPES) ** 2 * surface_areas(n, n, cases.SHAPES), 1)


@check(
    "(38)", "s is the share of the silhouette that the lune fills, both by surface integrals", "quadrature", compression,
    tolerance=QUADRATURE, mutant=("cos² of half the angle, squared", lambda f: lambda i, A: f(i, A) ** 2),
)  # fmt: skip
def compression_is_share(s):
    i, A = (np.array(x) for x in zip(*POSITIVE, strict=True))
    share = surface_areas(i, np.broadcast_to(NORMAL, i.shape), A) / surface_areas(i, i, A)
    return relative([s(*case) for case in POSITIVE], share)


@check(
    "(50)", "the mean of the weight over p_h, by micronormals, is the albedo ∫ f_r |ω·n| dω, by directions", "quadrature",
    ["ellipsoid.lune_area", "ellipsoid.projected_area", "sampling.lune.pdf", "bsdf.brdf", "ndf.ellipsoid", "masking.g1_ellipsoid"],
    tolerance=1e-4, mutant=("A_e⊥(ψ) for A_ℓ⊥", lambda f: lambda u, v, A, C: f(u, u, A, C)),
)  # fmt: skip
def mean_weight(lune_area, projected_area, pdf, brdf, D, g1):
    """Tolerance: over micronormals there is a kink where the reflection meets the horizon."""
    A, i = cases.SHAPES[4], cases.UP[:3]

    def f(i, o):
        m = unit(i + o)
        return brdf(i, o, D(m, A), g1(i, m, A) * g1(o, m, A), 1.0) * o[:, 2]

    def weighted(m, i):
        o = 2 * dot(i, m)[:, None] * m - i
        areas = lune_area(i, NORMAL, A, 1.0) / (i[:, 2] * projected_area(NORMAL, A, 1.0))
        return np.where(o[:, 2] > 0, g1(i, m, A) * g1(o, m, A) * areas * pdf(m, i, A), 0)

    return worst(hemispherical(f, i) - integrals(weighted, [lune(x, NORMAL, A, 150) for x in i], i))


@check(
    "§5.1", "the average normal is the normal of the mean slope, (-x̄, -ȳ, 1)", "exact", ["ellipsoid.mean_normal", "ellipsoid.to_slopes"],
    tolerance=1e-13, mutant=("A Aᵀ n", lambda f: lambda A: f(np.swapaxes(A, -1, -2))),
)  # fmt: skip
def normal_of_mean_slope(mean_normal, to_slopes):
    mean, _ = to_slopes(cases.SHAPES)
    return worst(mean_normal(cases.SHAPES) - unit(np.c_[-mean, np.ones(len(mean))]))


@check(
    "§5.2", "π √(uᵀSu)/√|S| is the projected area by the surface integral (21)", "quadrature", "ellipsoid.sggx",
    tolerance=1e-11, mutant=("A Aᵀ", lambda f: lambda A: f(np.swapaxes(A, -1, -2))),
)  # fmt: skip
def sggx_projected_area(sggx):
    """Tolerance: |S| by elimination, where the condition number is 10⁴."""
    u, A = cases.pairs(cases.ALL, cases.SHAPES)
    S = sggx(A)
    shadow = np.sqrt(np.einsum("ni,nij,nj->n", u, S, u) / np.linalg.det(S))
    return relative(np.pi * shadow, surface_areas(u, u, A))
