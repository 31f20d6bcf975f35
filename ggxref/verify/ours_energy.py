"""What the package adds, on whole BSDFs: reciprocity and furnaces of every combination, Fresnel's equations, frames."""

from functools import partial

import numpy as np

from ggxref.verify import cases, engine
from ggxref.verify.charts import NORMAL, dot, integrals, lune, unit
from ggxref.verify.engine import relative, worst
from ggxref.verify.heitz2014 import beckmann_rule, ggx_rule

check = partial(engine.check, "ours")

ALPHA = np.array([0.4, 0.6])
SKEWED = cases.SHAPES[2]
N_I, N_O = 1.1, 1.6

MODELS = ["ndf.ggx", "ndf.beckmann", "ndf.ellipsoid", "masking.g1_ggx", "masking.g1_beckmann", "masking.g1_ellipsoid"]
CORRELATIONS = ["masking.g2_separable", "masking.g2_height_correlated", "masking.g2_v_cavity"]
FRESNEL = ["fresnel.dielectric", "fresnel.conductor", "fresnel.schlick"]


def surfaces(ggx, beckmann, ellipsoid, g1_ggx, g1_beckmann, g1_ellipsoid):
    """D(m) and G1(w, m) of each family at one shape, and the quadrature over the normals that a direction sees."""
    return [
        (lambda m: ggx(m, ALPHA), lambda w, m: g1_ggx(w, m, ALPHA), lambda i: ggx_rule(i, ALPHA)),
        (lambda m: beckmann(m, ALPHA), lambda w, m: g1_beckmann(w, m, ALPHA), lambda i: beckmann_rule(i, ALPHA)),
        (lambda m: ellipsoid(m, SKEWED), lambda w, m: g1_ellipsoid(w, m, SKEWED), lambda i: lune(i, NORMAL, SKEWED)),
    ]


def reflectances(dielectric, conductor, schlick):
    return [
        lambda c: dielectric(c, N_I / N_O),
        lambda c: dielectric(c, N_O / N_I),
        lambda c: conductor(c, 0.2, 3.9),
        lambda c: schlick(c, 0.04),
    ]


def correlations(separable, correlated, v_cavity):
    """G2(i, o, m) from the G1 of a family, or of V-cavities."""
    return [
        lambda g1: lambda i, o, m: separable(g1(i, m), g1(o, m)),
        lambda g1: lambda i, o, m: correlated(g1(i, m), g1(o, m)),
        lambda g1: v_cavity,
    ]


@check(
    "BRDFs", "reciprocity of every NDF × G2 × Fresnel combination", "exact", ["bsdf.brdf", *MODELS, *CORRELATIONS, *FRESNEL],
    tolerance=1e-12, mutant=("cos θ_o lost", lambda f: lambda i, o, *v: f(i, o, *v) * o[:, 2]),
)  # fmt: skip
def brdfs_are_reciprocal(brdf, *formulas):
    i, o = cases.pairs(cases.UP, cases.hemisphere(150))
    m = unit(i + o)
    errors = []
    for D, g1, _ in surfaces(*formulas[:6]):
        d = D(m)
        keep = d > 1e-100
        for form in correlations(*formulas[6:9]):
            G2 = form(g1)
            for F in reflectances(*formulas[9:]):
                there = brdf(i, o, d, G2(i, o, m), F(dot(i, m)))
                back = brdf(o, i, d, G2(o, i, m), F(dot(o, m)))
                errors.append(worst((there - back)[keep] / np.maximum(there, 1e-100)[keep]))
    return max(errors)


@check(
    "BRDFs", "GGX in one expression of wi + wo is D G2 / (4 zi zo) at the half vector, and 0 below the horizon", "exact",
    ["bsdf.brdf_ggx", "bsdf.brdf", "geometry.half_reflection", "ndf.ggx", "masking.g1_ggx", "masking.g2_height_correlated"],
    tolerance=1e-12, mutant=("2 for 4", lambda f: lambda *v: 2 * f(*v)),
)  # fmt: skip
def one_expression(whole, brdf, half, D, g1, correlated):
    errors = []
    for alpha in (ALPHA, np.array([0.02, 1.5])):
        i, o = cases.pairs(cases.UP, cases.hemisphere(150))
        m = half(i, o)
        parts = brdf(i, o, D(m, alpha), correlated(g1(i, m, alpha), g1(o, m, alpha)), 1.0)
        below = whole(i, o * np.array([1, 1, -1]), alpha)
        errors += [worst(relative(whole(i, o, alpha), parts)), worst(below)]
    return max(errors)


@check(
    "BRDFs", "weak white furnace: ∫ D G1(wi) /(4|wi·n|) dwo over the sphere is 1, or the clamp's loss", "quadrature",
    ["bsdf.brdf", *MODELS, "masking.g1_v_cavity", "geometry.reflect", "jacobian.reflection"], tolerance=1e-10,
    also=["walter2014 (4)"], mutant=("2 for 4", lambda f: lambda *v: 2 * f(*v)),
)  # fmt: skip
def weak_furnace(brdf, *formulas):
    """Over micronormals, with the reflection's Jacobian; the skewed ellipsoid's G1 is clamped, so that it may lose energy."""
    *models, v_cavity, reflect, jacobian = formulas
    errors = []
    for family, (D, smith, rule) in enumerate(surfaces(*models)):
        for cavities, g1 in ((False, smith), (True, v_cavity)):
            if cavities and family == 2:
                continue  # V-cavities pair normals about n, which a skewed ellipsoid does not
            rules = [folded(family, i) if cavities else rule(i) for i in cases.UP]

            def scattered(m, i, D=D, g1=g1):
                o = reflect(i, m)
                return brdf(i, o, D(m), g1(i, m), 1.0) * np.abs(o[:, 2]) / jacobian(o, m)

            total = integrals(scattered, rules, cases.UP)
            expected = np.minimum(1, skewed_area(cases.UP)) if family == 2 else 1
            errors.append(relative(total, expected))
    return max(errors)


def folded(family, i):
    return (ggx_rule, beckmann_rule)[family](i, ALPHA, folded=True)


def skewed_area(w):
    """Visible area of the skewed half ellipsoid over the surface's, less than 1 where G1 is clamped."""
    a, n = w @ SKEWED.T, SKEWED[:, 2]
    return (np.linalg.norm(a, axis=-1) * np.linalg.norm(n) + a @ n) / (2 * (n @ n) * w[:, 2])


@check(
    "BRDFs", "white furnace: single scattering never gains, loses more with α, and nothing as α → 0", "quadrature",
    ["masking.g2_height_correlated", "bsdf.brdf", "ndf.ggx", "masking.g1_ggx"], tolerance=1e-4,
    mutant=("no masking", lambda f: lambda a, b: np.ones_like(a)),
)  # fmt: skip
def single_scattering_loses(g2, brdf, D, g1):
    """Albedo at 0, 30, 60° for α from 1e-4 to 1; at α = 1e-4 less than 1e-4 is lost."""
    alphas = np.array([1e-4, 0.1, 0.3, 0.6, 1.0])
    previous = np.ones(3)
    errors = []
    for a in alphas:
        alpha = np.array([a, a])
        i = cases.UP[:3]

        def reflected(m, i, alpha=alpha):
            o = 2 * dot(i, m)[:, None] * m - i
            value = brdf(i, o, D(m, alpha), g2(g1(i, m, alpha), g1(o, m, alpha)), 1.0) * o[:, 2] * 4 * dot(i, m)
            return np.where(o[:, 2] > 0, value, 0)

        albedo = integrals(reflected, [ggx_rule(x, alpha, n=80) for x in i], i)
        errors.append(max(0.0, np.max(albedo - previous)))
        if a == alphas[0]:
            errors.append(np.max(1 - albedo))
        previous = albedo
    return max(errors)


@check(
    "published table", "α = (0.1, 0.8), 60°: height-correlated G2 for x/x, x/y, y/y is .985329, .734298, .585206", "exact",
    ["masking.g2_height_correlated", "masking.g1_ggx"], tolerance=5e-7, mutant=("separable", lambda f: lambda a, b: a * b),
)  # fmt: skip
def published_values(g2, g1):
    x, y = cases.direction(60, 0.0), cases.direction(60, np.pi / 2)
    alpha = np.array([0.1, 0.8])
    got = [g2(g1(a, NORMAL, alpha), g1(b, NORMAL, alpha)) for a, b in ((x, x), (x, y), (y, y))]
    return worst(np.array(got) - [0.985329, 0.734298, 0.585206])


def amplitudes(cos_i, index):
    """Reflected and transmitted amplitudes of both polarisations, from Snell's law in complex numbers, n_o/n_i = index."""
    cos_t = np.sqrt(1 - (1 - cos_i**2) / index**2 + 0j)
    r = (cos_i - index * cos_t) / (cos_i + index * cos_t), (index * cos_i - cos_t) / (index * cos_i + cos_t)
    t = 2 * cos_i / (cos_i + index * cos_t), 2 * cos_i / (index * cos_i + cos_t)
    return r, t, cos_t


@check(
    "Fresnel", "dielectric: the mean of both polarisations, from complex amplitudes and from 1 - T; 1 in total reflection", "exact",
    "fresnel.dielectric", tolerance=1e-12, mutant=("s polarisation alone", lambda f: lambda c, eta: np.abs(amplitudes(c, 1 / eta)[0][0]) ** 2),
)  # fmt: skip
def dielectric_reflectance(fresnel):
    c, eta = cases.pairs(np.linspace(0.01, 1, 200), np.array([0.4, 1 / 1.5, 0.99, 1.01, 1.5, 2.4]))
    (r_s, r_p), (t_s, t_p), cos_t = amplitudes(c, 1 / eta)
    F = fresnel(c, eta)
    passed = (np.abs(t_s) ** 2 + np.abs(t_p) ** 2) / 2 * np.real(cos_t / eta) / c
    return max(worst(F - (np.abs(r_s) ** 2 + np.abs(r_p) ** 2) / 2), worst(F + passed - 1), worst(fresnel(-c, eta) - F))


@check(
    "Fresnel", "conductor: the mean of both polarisations with the complex index; a dielectric at k = 0", "exact",
    ["fresnel.conductor", "fresnel.dielectric"], tolerance=1e-12, mutant=("k for k²", lambda f: lambda c, n, k: f(c, n, np.sqrt(k))),
)  # fmt: skip
def conductor_reflectance(fresnel, dielectric):
    c, n, k = cases.triples(np.linspace(0.01, 1, 100), np.array([0.2, 1.5, 3.0]), np.array([0.1, 3.9, 7.0]))
    (r_s, r_p), _, _ = amplitudes(c, n + 1j * k)
    plain = fresnel(c, n, 0 * k) - dielectric(c, 1 / n)
    return max(worst(fresnel(c, n, k) - (np.abs(r_s) ** 2 + np.abs(r_p) ** 2) / 2), worst(plain))


@check(
    "Fresnel", "Schlick: f0 at normal incidence, 1 at grazing, and (1 - c)⁵ between", "exact", "fresnel.schlick", tolerance=1e-14,
    mutant=("power 4", lambda f: lambda c, f0: f0 + (1 - f0) * (1 - np.abs(c)) ** 4),
)  # fmt: skip
def schlick_reflectance(fresnel):
    c, f0 = cases.pairs(np.linspace(-1, 1, 101), np.array([0.0, 0.04, 0.9]))
    remaining = (1 - fresnel(c, f0)) / (1 - f0)
    return worst(remaining - (1 - (1 - np.abs(c)) ** 5))


@check(
    "frames", "basis(w): orthonormal, right-handed, third row w, at the poles too", "exact", "geometry.basis", tolerance=1e-14,
    mutant=("left-handed", lambda f: lambda w: f(w) * np.array([[1], [-1], [1]])),
)  # fmt: skip
def frames(basis):
    w = np.concatenate([cases.sphere(500), [[0, 0, 1.0], [0, 0, -1.0], unit(np.array([1e-9, 0, -1.0]))]])
    rows = basis(w)
    orthonormal = rows @ np.swapaxes(rows, -1, -2) - np.eye(3)
    return max(worst(orthonormal), worst(np.linalg.det(rows) - 1), worst(rows[:, 2] - w))


@check(
    "half vectors", "the transmitted half vector refracts wi to wo, and is on the upper side", "exact",
    ["geometry.half_refraction", "geometry.refract"], tolerance=1e-10,
    mutant=("indices exchanged", lambda f: lambda i, o, a, b: f(i, o, b, a)),
)  # fmt: skip
def refraction_half_vector(half, refract):
    """Tolerance: n_i wi + n_o wo is a tenth of its terms."""
    i, m = cases.pairs(cases.UP[:4], cases.hemisphere(100))
    o = refract(i, m, N_I / N_O)
    keep = (dot(i, m) > 0.02) & (o[:, 2] < -0.02)
    i, m, o = i[keep], m[keep], o[keep]
    return worst(half(i, o, N_I, N_O) - m)
