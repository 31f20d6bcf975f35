"""What the package adds to the documents: the canonical shape, Student-t slopes, caps and their bound for the ellipsoid."""

from functools import partial

import numpy as np
from scipy import stats

from ggxref.verify import cases, charts, engine, laws, samplers
from ggxref.verify.charts import NORMAL, dot, gauss, integrals, lune, product, spread, unit
from ggxref.verify.engine import relative, worst
from ggxref.verify.statistics import FALSE_ALARM
from ggxref.verify.walter2014 import norm, skew_of, times
from ggxref.verify.walter2014_sampling import swapped

PAPER = "ours"
check = partial(engine.check, PAPER)

QUADRATURE = 1e-12
ROUNDING = 1e-12
GAMMAS = np.array([1.2, 1.5, 2.0, 3.0, 30.0])


@check(
    "canonical form", "A n = n, upper triangle zero, positive diagonal, and the same distribution", "exact",
    ["ellipsoid.canonical", "ndf.ellipsoid", "masking.g1_ellipsoid"], tolerance=1e-11,
    mutant=("Σ without - e eᵀ", lambda f: lambda A: uncorrected_canonical(A)),
)  # fmt: skip
def canonical_form(canonical, D, g1):
    B = canonical(cases.SHAPES)
    form = max(worst(times(B, NORMAL) - NORMAL), worst(B[:, 1, 0]))
    below = max(0.0, -float(B[:, [0, 1], [0, 1]].min()))
    u, m, k = cases.triples(cases.ALL, cases.hemisphere(100), np.arange(len(B)))
    A = cases.SHAPES[k]
    return max(form, below, relative(D(m, B[k]), D(m, A)), worst(g1(u, m, B[k]) - g1(u, m, A)))


def uncorrected_canonical(A):
    S = np.swapaxes(A, -1, -2) @ A / skew_of(A)[..., None, None] ** 2
    B = np.tile(np.eye(3), (len(A), 1, 1))
    B[:, :2, :2] = np.swapaxes(np.linalg.cholesky(S[:, :2, :2]), -1, -2)
    B[:, 2, :2] = S[:, :2, 2]
    return B


@check(
    "slope parameters", "from_slopes inverts to_slopes, and mean 0, scatter diag(α²) is GGX", "exact",
    ["ellipsoid.from_slopes", "ellipsoid.to_slopes", "ellipsoid.canonical", "ndf.ellipsoid", "ndf.ggx"], tolerance=ROUNDING,
    mutant=("e = +mean", lambda f: lambda mean, scatter: f(-mean, scatter)),
)  # fmt: skip
def slope_parameters(from_slopes, to_slopes, canonical, D, D_ggx):
    mean, scatter = to_slopes(cases.SHAPES)
    m, alpha = cases.pairs(cases.hemisphere(100), cases.ALPHAS)
    upright = from_slopes(np.zeros(2), alpha[:, None] ** 2 * np.eye(2))
    return max(worst(from_slopes(mean, scatter) - canonical(cases.SHAPES)), relative(D(m, upright), D_ggx(m, alpha)))


@check(
    "Student-t", "the slope density of the ellipsoid NDF is scipy's multivariate_t with 2 degrees of freedom", "exact",
    ["slopes.ellipsoid", "ellipsoid.to_slopes", "ndf.ellipsoid", "jacobian.slope"], tolerance=1e-11,
    mutant=("located at +e", lambda f: lambda s, A: f(-s, A)),
)  # fmt: skip
def ellipsoid_slopes(P22, to_slopes, D, jacobian):
    m = cases.hemisphere(300)
    slope = -m[:, :2] / m[:, 2:]
    errors = []
    for A in cases.SHAPES:
        mean, scatter = to_slopes(A)
        expected = stats.multivariate_t(mean, scatter / 2, df=2).pdf(slope)
        errors += [relative(P22(slope, A), expected), relative(D(m, A) * m[:, 2], jacobian(m) * expected)]
    return max(errors)


@check(
    "Student-t", "∫ D (m·n) dm = 1 for γ from 1.2 to 30", "quadrature", "ndf.student_t", tolerance=1e-11,
    mutant=("γ for γ - 1", lambda D: lambda m, a, g: D(m, a, g + 1)),
)  # fmt: skip
def student_is_normalised(D):
    alpha, gamma = cases.pairs(cases.ALPHAS, GAMMAS)
    rules = [charts.student(a, g) for a, g in zip(alpha, gamma, strict=True)]
    total = integrals(lambda m, a, g: D(m, a, g) * m[:, 2], rules, alpha, gamma)
    mass = [student_tail_ratio(D, a, g) for a, g in zip(cases.ALPHAS, GAMMAS, strict=False)]
    return max(relative(total, 1), worst(mass))


def student_tail_ratio(D, alpha, gamma):
    """D over its value at the pole, at slope 3 along x, less (1 + 9/(γ - 1))^-γ (1 + 9 α²)²."""
    m = unit(np.array([-3 * alpha[0], 0, 1.0]))
    expected = (1 + 9 / (gamma - 1)) ** -gamma * (1 + 9 * alpha[0] ** 2) ** 2
    return float(D(m, alpha, gamma) / D(NORMAL, alpha, gamma)) - expected


@check(
    "Student-t", "γ = 2 is GGX, and γ → ∞ is Beckmann", "exact", ["ndf.student_t", "ndf.ggx", "ndf.beckmann", "slopes.student_t"],
    tolerance=1e-6, mutant=("power γ + 1", lambda D: lambda m, a, g: D(m, a, g) * 0.5 * (1 + m[..., 2])),
)  # fmt: skip
def student_limits(D, ggx, beckmann, P22):
    """Tolerance: at γ = 1e9 the distance to the limit is γ⁻¹ times the fourth power of the slope, here below 1e2."""
    m, alpha = cases.pairs(cases.hemisphere(300), cases.ALPHAS[2:])
    slope = -m[:, :2] / m[:, 2:]
    steep = norm(slope / alpha) < 3
    limit = relative(D(m, alpha, 1e9)[steep], beckmann(m, alpha)[steep])
    return max(
        relative(D(m, alpha, 2.0), ggx(m, alpha)),
        limit,
        relative(P22(slope, alpha, 1.7), D(m, alpha, 1.7) * m[:, 2] ** 4),
    )


@check(
    "ellipsoid cap", "samples follow the visible normals of the ellipsoid", "monte_carlo", "sampling.ellipsoid_cap.sample",
    tolerance=FALSE_ALARM, law=laws.ellipsoid_visible, cases=samplers.ELLIPSOIDS,
    mutant=("x and y of the ellipsoid exchanged", swapped),
)  # fmt: skip
def cap_samples(sample, **settings):
    return samplers.follows(sample, **settings)


@check(
    "ellipsoid cap", "the Jacobian of the map u → m is the density of the visible normals", "autodiff",
    ["sampling.ellipsoid_cap.pdf", "sampling.ellipsoid_cap.sample"], tolerance=1e-8, cases=samplers.ELLIPSOIDS,
    mutant=("without ‖A n‖", lambda f: lambda m, i, A: f(m, i, A) * skew_of(A)),
)  # fmt: skip
def cap_jacobian(pdf, sample, **settings):
    return samplers.density_is_jacobian(pdf, sample, **settings)


def sphere_space(A):
    """Rows of a frame whose third axis is A n, and ‖A n‖: where the cap is upright, whatever A's own frame."""
    return charts.frame(A[:, 2], NORMAL)[0]


def cap_height(i, o, A):
    """Height o' of the reflection in sphere space, for the half vector of each i and o, about A n/‖A n‖."""
    inner = unit(times(A, i))
    m = unit(np.linalg.solve(np.swapaxes(A, -1, -2), unit(i + o)[..., None])[..., 0])
    pole = unit(A[..., 2])
    return 2 * dot(inner, m) * dot(m, pole) - dot(inner, pole)


@check(
    "ellipsoid bound", "no sample of the true support is lost: o'·A n ≥ L for every wo above the horizon", "exact",
    ["sampling.ellipsoid_bounded.bound", "sampling.ellipsoid_bounded.pdf"], tolerance=ROUNDING,
    mutant=("a tenth higher", lambda f: lambda i, A: f(i, A) + 0.1 * (1 - f(i, A))),
)  # fmt: skip
def bound_keeps_support(bound, pdf):
    phi = np.linspace(0, 2 * np.pi, 360, endpoint=False)
    o = np.concatenate([cases.hemisphere(1500), np.stack([np.cos(phi), np.sin(phi), 0 * phi], -1)])
    upright = np.array([np.diag([*a, 1.0]) for a in cases.ALPHAS])
    i, o, A = cases.triples(cases.UP, o, np.concatenate([cases.SHAPES, upright]))
    lost = bound(i, A) - cap_height(i, o, A)
    above = o[:, 2] > 0  # the horizon itself is the edge, where rounding decides
    return max(worst(np.maximum(0, lost)), float(np.any(pdf(unit(i + o), i, A)[above] <= 0)))


@check(
    "ellipsoid bound", "without skew and for α ≤ 1 the bound is tokuyoshi2024's", "exact",
    ["sampling.ellipsoid_bounded.bound", "sampling.bounded_cap.bound"], tolerance=ROUNDING,
    mutant=("whole cap", lambda f: lambda i, A: -unit(times(A, i))[..., 2]),
)  # fmt: skip
def bound_is_tokuyoshi(bound, k):
    i, alpha = cases.pairs(cases.ALL, cases.ALPHAS[:-1])
    A = np.eye(3) * np.c_[alpha, np.ones(len(alpha))][:, None]
    return worst(bound(i, A) + k(i, alpha) * unit(times(A, i))[:, 2])


def cap_rule(i, A, low):
    """Micronormals whose reflections in sphere space lie higher than `low` above A n's equator, with weights for dm."""
    rows = sphere_space(A)
    inner = rows @ unit(A @ i)
    z, phi, weight = product(gauss([low, 1], 40), gauss([0, 2 * np.pi], 60))
    o = np.stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z], axis=-1)
    m = unit(o + inner)
    return spread(m @ rows, weight / (4 * dot(inner, m)), A)


@check(
    "ellipsoid bound", "∫ pdf dm = 1 over the bounded cap", "quadrature",
    ["sampling.ellipsoid_bounded.pdf", "sampling.ellipsoid_bounded.bound"], tolerance=1e-11,
    mutant=("without ‖A n‖", lambda f: lambda m, i, A: f(m, i, A) * skew_of(A)),
)  # fmt: skip
def bounded_density_is_normalised(pdf, bound):
    i, A = cases.pairs(cases.ALL, cases.SHAPES)
    rules = [cap_rule(*case) for case in zip(i, A, bound(i, A), strict=True)]
    return relative(integrals(lambda m, i, A: pdf(m, i, A), rules, i, A), 1)


@check(
    "ellipsoid bound", "samples are uniform on the bounded cap", "monte_carlo",
    ["sampling.ellipsoid_bounded.sample", "sampling.ellipsoid_bounded.bound"], tolerance=FALSE_ALARM,
    mutant=("x and y of the ellipsoid exchanged", swapped),
)  # fmt: skip
def bounded_samples(sample, bound, stream):
    def law(wm, wi, A):
        return laws.reflected_cap(wm, wi, A, float(bound(wi, A)))

    return samplers.follows(sample, law=law, cases=samplers.ELLIPSOIDS, stream=stream)


@check(
    "ellipsoid bound", "the Jacobian of the map u → m is its density", "autodiff",
    ["sampling.ellipsoid_bounded.pdf", "sampling.ellipsoid_bounded.sample"], tolerance=1e-8, cases=samplers.ELLIPSOIDS,
    mutant=("without ‖A n‖", lambda f: lambda m, i, A: f(m, i, A) * skew_of(A)),
)  # fmt: skip
def bounded_jacobian(pdf, sample, **settings):
    return samplers.density_is_jacobian(pdf, sample, **settings)


@check(
    "lune areas", "the lune's area is that of the visible normals: σ = ∫ max(0, w·m) D, also below the horizon", "quadrature",
    ["ellipsoid.lune_area", "ellipsoid.projected_area", "ndf.ellipsoid"], tolerance=QUADRATURE,
    mutant=("u and v exchanged", lambda f: lambda u, v, A, C: f(v, u, A, C)),
)  # fmt: skip
def visible_area(lune_area, projected_area, D):
    u, A = cases.pairs(cases.ALL, cases.SHAPES)
    rules = [lune(x, NORMAL, B) for x, B in zip(u, A, strict=True)]
    area = integrals(lambda m, u, A: np.maximum(0, dot(u, m)) * D(m, A), rules, u, A)
    return relative(lune_area(u, NORMAL, A, 1.0) / projected_area(NORMAL, A, 1.0), area)
