"""The misprints of walter2014, dupuy2023 and tokuyoshi2024, each as a formula in both forms with a property that only the
right one has."""

import numpy as np

from ggxref.verify import cases, charts, samplers
from ggxref.verify.charts import NORMAL, dot, front, gauss, integrals, unit
from ggxref.verify.dupuy2023 import warp
from ggxref.verify.dupuy2023_sampling import listing_1, listing_1_as_printed, listing_3
from ggxref.verify.engine import relative, worst
from ggxref.verify.errata import erratum
from ggxref.verify.heitz2014 import ggx_rule
from ggxref.verify.heitz2014_bsdf import ALPHA
from ggxref.verify.tokuyoshi2024 import horizon, literal_k, reflected_height
from ggxref.verify.walter2014 import norm, times
from ggxref.verify.walter2014_sampling import lune_probability_error, rational_fit_error

WALTER, DUPUY, TOKUYOSHI = "walter2014", "dupuy2023", "tokuyoshi2024"
ROUNDING = 1e-12


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
