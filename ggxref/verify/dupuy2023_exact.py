"""Dupuy & Benyoub 2023 in ball arithmetic, at exact inputs."""

from functools import partial

from flint import arb

from ggxref.oracle.linalg import N, determinant, inverse_transpose, transpose
from ggxref.oracle.linalg import negative as minus
from ggxref.verify import identities
from ggxref.verify.identities import (
    ALPHAS,
    add,
    apply,
    area,
    directions,
    dot,
    exact,
    fronts,
    integral,
    norm,
    normalise,
    reflections,
    scale,
    tangents,
    unit_derivative,
)

dupuy = partial(identities.identity, "dupuy2023")

ONE = (arb(1), arb(1))
VNDF = "oracle.sampling.spherical_cap.pdf"


def squeeze(alpha):
    """M = diag(1/α_x, 1/α_y, 1)."""
    a, b = exact(alpha)
    zero = arb(0)
    return ((1 / a, zero, zero), (zero, 1 / b, zero), N)


def inverse(M):
    return transpose(inverse_transpose(M))


def to_hemisphere(alpha, i, m):
    """M⁻¹wi and Mᵀm, normalised, and ‖Mᵀm‖."""
    M = squeeze(alpha)
    inner = normalise(apply(inverse(M), i))
    return inner, normalise(apply(transpose(M), m)), norm(apply(transpose(M), m))


def cases():
    """Roughness, direction, and micronormal in front of it."""
    return [(alpha, i, m) for alpha in ALPHAS for i, m in fronts()]


@dupuy(
    "(1)", "D_vis = D_vis,std(Mᵀm, M⁻¹wi) |det Mᵀ|/‖Mᵀm‖³, enclosed", [VNDF, "oracle.jacobian.linear"],
    mutant=("Jacobian to the 4th power", lambda f: lambda m, i, a: f(m, i, a) * a[0]),
)  # fmt: skip
def visible_density(pdf, linear):
    for alpha, i, m in cases():
        inner, standard, length = to_hemisphere(alpha, i, m)
        M = squeeze(alpha)
        yield pdf(m, i, exact(alpha)), pdf(standard, inner, ONE) * determinant(M) / length**3
        yield linear(m, M), determinant(M) / length**3


@dupuy(
    "(1)", "|det M|/‖Mm‖³ is the area that ∂(Mm/‖Mm‖) spans", "oracle.jacobian.linear",
    mutant=("‖Mm‖²", lambda f: lambda m, M: f(m, M) * norm(apply(M, m))),
)  # fmt: skip
def linear_jacobian(linear):
    for alpha, _, m in cases():
        M = squeeze(alpha)
        yield linear(m, M), area(*(unit_derivative(apply(M, m), apply(M, t)) for t in tangents(m)))


@dupuy(
    "(2)", "D_vis,std = (m·wi) D_std/σ_std", [VNDF, "oracle.ndf.hemisphere", "oracle.masking.sigma_ggx"],
    mutant=("z_i for σ_std", lambda f: lambda m, i, a: f(m, i, a) * i[2]),
)  # fmt: skip
def standard_density(pdf, D, sigma):
    for i, m in fronts():
        yield pdf(m, i, ONE), dot(m, i) * D(m) / sigma(i, ONE)


@dupuy(
    "(3)", "∫ D_std z dm = 1, enclosed", "oracle.ndf.hemisphere", method="certified",
    mutant=("1/(2π)", lambda f: lambda m: f(m) / 2),
)  # fmt: skip
def hemisphere_is_normalised(D):
    yield 2 * arb.pi() * D(N) * integral(lambda t: t.sin() * t.cos(), 0, arb.pi() / 2), 1


@dupuy(
    "(4)", "σ_std = ∫ max(m·wi, 0) D_std dm = (1 + z_i)/2, also from below, enclosed", lambda i: (1 + i[2]) / 2,
    method="certified", mutant=("z_i", lambda f: lambda i: i[2]),
)  # fmt: skip
def cross_section(sigma):
    for w in directions():
        for i in (w, (w[0], w[1], -w[2])):
            sin = norm((i[0], i[1], arb(0)))
            seen = integral(
                lambda t, i=i, sin=sin: (i[2] * t.cos() - sin * t.sin()) / 2, -arb.pi() / 2, arb.atan2(i[2], sin)
            )
            yield sigma(i), seen


@dupuy(
    "(5)", "reflected about their half vector, wi and wo are each other", ["oracle.geometry.reflect", "oracle.geometry.half_reflection"],
    mutant=("2 lost", lambda f: lambda w, m: add(scale(dot(w, m), m), minus(w))),
)  # fmt: skip
@dupuy(
    "(6)", "the half vector reflects wi to wo and wo to wi", ["oracle.geometry.reflect", "oracle.geometry.half_reflection"],
    mutant=("about wi", lambda f: lambda w, m: f(w, w)),
)  # fmt: skip
def half_vector(reflect, half):
    for i, o, _ in reflections():
        h = half(i, o)
        yield (reflect(i, h), reflect(o, h)), (o, i)
        yield dot(h, h), 1


@dupuy(
    "(7)", "f_p = D_vis,std(h) ‖∂h/∂wo‖, the area that ∂h/∂wo spans", ["oracle.sampling.spherical_cap.cap_pdf", VNDF],
    mutant=("half", lambda f: lambda o, i: f(o, i) / 2),
)  # fmt: skip
def density_of_reflections(cap_pdf, pdf):
    for i, o, h in reflections():
        spanned = area(*(unit_derivative(add(i, o), t) for t in tangents(o)))
        yield cap_pdf(o, i), pdf(h, i, ONE) * spanned


@dupuy(
    "(8)", "‖∂h/∂wo‖ = 1/(4|wo·h|)", "oracle.jacobian.reflection", mutant=("1/4", lambda f: lambda o, m: arb(0.25)),
)  # fmt: skip
def half_vector_jacobian(jacobian):
    for i, o, h in reflections():
        yield jacobian(o, h), area(*(unit_derivative(add(i, o), t) for t in tangents(o)))


@dupuy(
    "(9)", "f_p = D_std/(4 σ_std)", ["oracle.sampling.spherical_cap.cap_pdf", "oracle.ndf.hemisphere", "oracle.masking.sigma_ggx"],
    mutant=("2 for 4", lambda f: lambda o, i: 2 * f(o, i)),
)  # fmt: skip
def uniform_density(cap_pdf, D, sigma):
    for i, o, h in reflections():
        yield cap_pdf(o, i), D(h) / (4 * sigma(i, ONE))


@dupuy(
    "(10)", "1/(2π(1 + z_i)) on z_o > -z_i, whose solid angle it is the reciprocal of; 0 below", "oracle.sampling.spherical_cap.cap_pdf",
    mutant=("wrong sign of the limit", lambda f: lambda o, i: f((o[0], o[1], -o[2]), i)),
)  # fmt: skip
def cap_density(cap_pdf):
    for i in directions():
        inside, outside = (scale(c, N) for c in (arb(1), arb(-1)))
        yield cap_pdf(inside, i) * 2 * arb.pi() * (1 + i[2]), 1
        yield cap_pdf(outside, i), 0


BRDF = [
    "oracle.bsdf.brdf",
    "oracle.ndf.ggx",
    "oracle.masking.g1_ggx",
    "oracle.masking.g2_height_correlated",
    "oracle.fresnel.conductor",
]


@dupuy(
    "(11)", "f_r = F G2 D/(4 cos θ_i cos θ_o), reciprocal", BRDF, mutant=("cos θ_i twice", lambda f: lambda i, o, *v: f(i, i, *v)),
)  # fmt: skip
def brdf(f, D, g1, g2, fresnel):
    a = exact((0.5, 0.125))
    for i, o, h in reflections():
        F, G = fresnel(dot(i, h), arb(0.25), arb(3.5)), g2(g1(i, h, a), g1(o, h, a))
        yield f(i, o, D(h, a), G, F), f(o, i, D(h, a), G, F)
        yield f(i, o, D(h, a), G, F), F * G * D(h, a) / (4 * i[2] * o[2])


@dupuy(
    "(12)", "D = D_std |det Mᵀ|/‖Mᵀm‖⁴", ["oracle.ndf.ggx", "oracle.ndf.hemisphere"],
    mutant=("‖Mᵀm‖³", lambda f: lambda m, a: f(m, a) / a[0]),
)  # fmt: skip
def normals_from_hemisphere(D, D_std):
    for alpha, i, m in cases():
        _, standard, length = to_hemisphere(alpha, i, m)
        yield D(m, exact(alpha)), D_std(standard) * determinant(squeeze(alpha)) / length**4


@dupuy(
    "(13)", "G2 = G_iG_o/(G_i + G_o - G_iG_o) is 1/(1 + Λ_i + Λ_o)",
    ["oracle.masking.g2_height_correlated", "oracle.masking.g1_ggx", "oracle.masking.lambda_ggx"],
    mutant=("separable", lambda f: lambda a, b: a * b),
)  # fmt: skip
@dupuy(
    "(14)", "G_k = G1(m, w_k): of each direction its own",
    ["oracle.masking.g2_height_correlated", "oracle.masking.g1_ggx", "oracle.masking.lambda_ggx"],
    mutant=("G_i for both", lambda f: lambda a, b: f(a, a)),
)  # fmt: skip
def height_correlation(g2, g1, smith):
    for alpha in ALPHAS:
        a = exact(alpha)
        for i, o, h in reflections():
            yield g2(g1(i, h, a), g1(o, h, a)), 1 / (1 + smith(i, a) + smith(o, a))


@dupuy(
    "(15)", "G1 = χ⁺ z/∫ max(m·w, 0) D dm, enclosed", ["oracle.masking.g1_ggx"], method="certified",
    mutant=("axes swapped", lambda f: lambda w, m, a: f(w, m, a[::-1])),
)  # fmt: skip
def masking_is_its_integral(g1):
    for alpha, i, m in cases():
        a = exact(alpha)
        s = norm((a[0] * i[0], a[1] * i[1], arb(0)))
        seen = integral(lambda t, i=i, s=s: (i[2] * t.cos() - s * t.sin()) / 2, -arb.pi() / 2, arb.atan2(i[2], s))
        yield g1(i, m, a), i[2] / seen
        yield g1(i, minus(m), a), 0


@dupuy(
    "(16)", "G1 = G1,std(Mᵀm, M⁻¹w)", ["oracle.masking.g1_ggx"], mutant=("of w itself", lambda f: lambda w, m, a: f(w, m, ONE)),
)  # fmt: skip
def masking_of_hemisphere(g1):
    for alpha, i, m in cases():
        inner, standard, _ = to_hemisphere(alpha, i, m)
        yield g1(i, m, exact(alpha)), g1(inner, standard, ONE)


@dupuy(
    "(17)", "G1,std = χ⁺ z_i/σ_std", ["oracle.masking.g1_ggx", "oracle.masking.sigma_ggx"],
    mutant=("σ_std doubled", lambda f: lambda w, m, a: f(w, m, a) / 2),
)  # fmt: skip
def standard_masking(g1, sigma):
    for i, m in fronts():
        yield g1(i, m, ONE), i[2] / sigma(i, ONE)


@dupuy(
    "(20)", "PDF = D_vis/(4|wa·m|) = G1 D/(4 cos θ_a), enclosed", [VNDF, "oracle.jacobian.reflection", "oracle.masking.g1_ggx", "oracle.ndf.ggx"],
    mutant=("Jacobian lost", lambda f: lambda m, i, a: f(m, i, a) * dot(i, m)),
)  # fmt: skip
def density_of_outgoing(pdf, jacobian, g1, D):
    for alpha, i, m in cases():
        a = exact(alpha)
        yield pdf(m, i, a) * jacobian(i, m), g1(i, m, a) * D(m, a) / (4 * i[2])
