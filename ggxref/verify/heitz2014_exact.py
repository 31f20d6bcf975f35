"""Heitz & d'Eon 2014 in ball arithmetic: the identities of its other checks, proven to 40 digits at exact inputs."""

from functools import partial

from flint import arb

from ggxref.oracle import integrate
from ggxref.oracle.linalg import N
from ggxref.verify import identities
from ggxref.verify.identities import (
    ALPHAS,
    BITS,
    DIRECTIONS,
    NORMALS,
    add,
    area,
    cross,
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

PAPER = "heitz2014"
identity = partial(identities.identity, PAPER)
certified = partial(identities.identity, PAPER, method="certified")
N_I, N_O = arb(1.125), arb(1.5)


def stretched(w, alpha):
    """‖(α_x x, α_y y)‖ of the unit w, and z."""
    return norm((alpha[0] * w[0], alpha[1] * w[1], arb(0))), w[2]


@certified(
    "(1)", "∫ (m·n) D dm = 1, GGX, enclosed", lambda a: integrate.projected_area_ggx(a, BITS),
    mutant=("α_x for α_x α_y", lambda f: lambda a: f(a) * a[1]),
)  # fmt: skip
@certified(
    "(1)", "∫ (m·n) D dm = 1, Beckmann, enclosed", lambda a: integrate.projected_area_beckmann(a, BITS),
    mutant=("π lost", lambda f: lambda a: f(a) * arb.pi()),
)  # fmt: skip
def normals_are_normalised(total):
    for alpha in ALPHAS:
        yield total(alpha), 1


@certified(
    "(2)", "G1 is (wi·n)/∫ ⟨wi·m⟩ D dm, which normalises D_wi, GGX, enclosed",
    ["oracle.masking.g1_ggx", lambda w, a: integrate.g1_ggx(w, a, BITS)],
    mutant=("α of the other axis", lambda f: lambda w, m, a: f(w, m, a[::-1])),
)  # fmt: skip
@certified(
    "(2)", "G1 is (wi·n)/∫ ⟨wi·m⟩ D dm, which normalises D_wi, Beckmann, enclosed",
    ["oracle.masking.g1_beckmann", lambda w, a: integrate.g1_beckmann(w, a, BITS)],
    mutant=("α of the other axis", lambda f: lambda w, m, a: f(w, m, a[::-1])),
)  # fmt: skip
def masking_is_its_integral(g1, integrated):
    for w in DIRECTIONS:
        for alpha in ALPHAS:
            yield g1(exact(w), exact(w), exact(alpha)), integrated(w, alpha)


for _name, _g1 in (("ggx", integrate.g1_ggx), ("beckmann", integrate.g1_beckmann)):

    @certified(
        "§2.1 Λ", f"1 + Λ is ∫ ⟨wi·m⟩ D dm/(wi·n), {_name}, enclosed", [f"oracle.masking.lambda_{_name}", partial(_g1, bits=BITS)],
        mutant=("without the half", lambda f: lambda w, a: 2 * f(w, a)),
    )  # fmt: skip
    def smith_lambda(smith, integrated):
        for w in DIRECTIONS:
            for alpha in ALPHAS:
                yield 1 + smith(exact(w), exact(alpha)), 1 / integrated(w, alpha)


@certified(
    "appendix B", "∫ D_wi = 1 for V-cavities of GGX, by the marginal slope, enclosed", lambda tan: lambda psi: 1 - psi.tan() / tan,
    mutant=("2 also where both are seen", lambda f: lambda tan: lambda psi: 2 * psi.cos() ** 0),
)  # fmt: skip
def v_cavities_are_normalised(share):
    """x̃ = tan ψ has the density cos ψ/2; below -cot θ only m is seen (2), up to cot θ both are (1 - x̃ tan θ)."""
    for w in directions():
        s, z = stretched(w, exact((0.5, 0.125)))
        edge = arb.atan2(z, s)
        both = share(z / s)
        one = integral(lambda psi: psi.cos(), -arb.pi() / 2, -edge)
        yield one + integral(lambda psi, both=both: both(psi) * psi.cos() / 2, -edge, edge), 1


@identity(
    "(3)", "G1(m)⟨w,m⟩ + G1(m')⟨w,m'⟩ = 2 (m·n)(w·n)", "oracle.masking.g1_v_cavity",
    mutant=("minimum lost", lambda f: lambda w, m: 2 * abs(m[2] * w[2] / dot(w, m)) if dot(w, m) > 0 else arb(0)),
)  # fmt: skip
def v_cavity_conserves_area(g1):
    for w in DIRECTIONS:
        for m in [*NORMALS, (1, 1, 0.5), (-1, 0.5, 0.25)]:
            pair = [exact(m), exact((-m[0], -m[1], m[2]))]
            unit = [normalise(x) for x in pair]
            seen = sum((g1(exact(w), x) * dot(normalise(exact(w)), y) for x, y in zip(pair, unit, strict=True)), arb(0))
            yield seen, 2 * unit[0][2] * normalise(exact(w))[2]


@identity(
    "§2.2 reflect", "unit, coplanar, and at the same angle", "oracle.geometry.reflect",
    mutant=("2 lost", lambda f: lambda w, m: add(scale(dot(w, m), m), scale(arb(-1), w))),
)  # fmt: skip
def reflection_law(reflect):
    for i, m in fronts():
        o = reflect(i, m)
        yield (dot(o, o), dot(o, m), *cross(add(i, o), m)), (1, dot(i, m), 0, 0, 0)


def refractions(refract):
    """Directions above, micronormals, transmitted directions."""
    return [(i, m, refract(i, m, N_I / N_O)) for i, m in fronts()]


@identity(
    "§2.2 transmit", "unit, coplanar, n_i sin θ_i = n_o sin θ_o", "oracle.geometry.refract",
    mutant=("n for n² under the root", lambda f: printed_transmit),
)  # fmt: skip
def refraction_law(refract):
    for i, m, o in refractions(refract):
        yield dot(o, o), 1
        yield add(scale(N_I, cross(i, m)), scale(N_O, cross(o, m))), (0, 0, 0)


def printed_transmit(w, m, n):
    c = dot(w, m)
    return add(scale(n * c - (1 + n * (c * c - 1)).sqrt(), m), scale(-n, w))


@identity(
    "§2.2 ∂ω_hr", "1/(4|wo·h|) is the area that ∂h/∂wo spans", "oracle.jacobian.reflection",
    mutant=("1/(2|wo·h|)", lambda f: lambda o, m: 2 * f(o, m)),
)  # fmt: skip
def reflection_jacobian(jacobian):
    for i, o, h in reflections():
        yield jacobian(o, h), area(*(unit_derivative(add(i, o), t) for t in tangents(o)))


@identity(
    "§2.2 ∂ω_ht", "n_o²|wo·h|/(n_i wi·h + n_o wo·h)² is the area that ∂h/∂wo spans",
    ["oracle.jacobian.refraction", "oracle.geometry.refract"],
    mutant=("∂ω_i as printed", lambda f: lambda i, o, m, a, b: f(o, i, m, b, a)),
)  # fmt: skip
def refraction_jacobian(jacobian, refract):
    for i, m, o in refractions(refract):
        s = add(scale(N_I, i), scale(N_O, o))
        yield jacobian(i, o, m, N_I, N_O), area(*(unit_derivative(s, scale(N_O, t)) for t in tangents(o)))


BSDF = ["oracle.ndf.ggx", "oracle.masking.g1_ggx", "oracle.masking.g2_height_correlated", "oracle.fresnel.dielectric"]
ALPHA = (0.5, 0.125)


@identity(
    "§2.1 f_r", "reciprocity and algorithm 1's weight: f_r |wo·n|/(D (m·n) ∂h/∂wo) = F |wi·m|G2/(|wi·n||m·n|)",
    ["oracle.bsdf.brdf", *BSDF, "oracle.jacobian.reflection", "oracle.bsdf.weight_normals"],
    mutant=("2 for 4", lambda f: lambda *v: 2 * f(*v)),
)  # fmt: skip
def brdf_and_weight(brdf, D, g1, g2, fresnel, jacobian, weight):
    a = exact(ALPHA)
    for i, o, m in reflections():
        F, G = fresnel(dot(i, m), N_I / N_O), g2(g1(i, m, a), g1(o, m, a))
        f = brdf(i, o, D(m, a), G, F)
        yield f, brdf(o, i, D(m, a), g2(g1(o, m, a), g1(i, m, a)), fresnel(dot(o, m), N_I / N_O))
        yield f * o[2] / (D(m, a) * m[2] * jacobian(o, m)), F * weight(i, m, G)


@identity(
    "algorithm 2", "f_r |wo·n|/(D_wi ∂h/∂wo) = F G2/G1", [
        "oracle.bsdf.weight_visible", "oracle.bsdf.brdf", *BSDF, "oracle.jacobian.reflection", "oracle.sampling.spherical_cap.pdf"],
    mutant=("G1 of wo", lambda f: lambda g, G, F: F * G),
)  # fmt: skip
def weight_of_visible_normals(weight, brdf, D, g1, g2, fresnel, jacobian, pdf):
    a = exact(ALPHA)
    for i, o, m in reflections():
        F, G = fresnel(dot(i, m), N_I / N_O), g2(g1(i, m, a), g1(o, m, a))
        yield brdf(i, o, D(m, a), G, F) * o[2] / (pdf(m, i, a) * jacobian(o, m)), weight(g1(i, m, a), G, F)


@identity(
    "§2.1 f_t", "reciprocity, and algorithm 2's weight: f_t |wo·n|/(D_wi ∂h/∂wo) = (1 - F) G2/G1",
    ["oracle.bsdf.btdf", *BSDF, "oracle.jacobian.refraction", "oracle.sampling.spherical_cap.pdf", "oracle.geometry.refract"],
    mutant=("no n_o²", lambda f: lambda i, o, a, b, *v: f(i, o, a, b, *v) / b**2),
)  # fmt: skip
def btdf_and_weight(btdf, D, g1, g2, fresnel, jacobian, pdf, refract):
    a = exact(ALPHA)
    for i, m, o in refractions(refract):
        if not o[2] < 0:
            continue
        F, G = fresnel(dot(i, m), N_I / N_O), g1(i, m, a) * g1(o, m, a)
        f = btdf(i, o, N_I, N_O, D(m, a), G, F)
        back = btdf(o, i, N_O, N_I, D(m, a), G, fresnel(dot(o, m), N_O / N_I))
        yield f / N_O**2, back / N_I**2
        yield f * abs(o[2]) / (pdf(m, i, a) * jacobian(i, o, m, N_I, N_O)), (1 - F) * G / g1(i, m, a)


@certified(
    "(5)", "∫ ⟨wi·m⟩ D dm = σ(wi), GGX, also from below, enclosed", "oracle.masking.sigma_ggx",
    mutant=("|z| for z", lambda f: lambda w, a: f((w[0], w[1], abs(w[2])), a)),
)  # fmt: skip
def visible_area(sigma):
    for x, y, z in DIRECTIONS:
        for w in directions([(x, y, z), (x, y, -z)]):
            s, z_ = stretched(w, exact(ALPHA))
            seen = integral(lambda b, s=s, z_=z_: (z_ * b.cos() - s * b.sin()) / 2, -arb.pi() / 2, arb.atan2(z_, s))
            yield sigma(w, exact(ALPHA)), seen


for _name in ("ggx", "beckmann"):

    @identity(
        "§5.1 P22", f"(m·n) D = P22/(m·n)³, {_name}", [f"oracle.ndf.{_name}", f"oracle.slopes.{_name}", "oracle.slopes.from_normal"],
        mutant=("axes swapped", lambda f: lambda m, a: f(m, a[::-1])),
    )  # fmt: skip
    def slopes_of_normals(D, P22, from_normal):
        for m in directions(NORMALS):
            for alpha in ALPHAS:
                a = exact(alpha)
                yield m[2] * D(m, a), P22(from_normal(m), a) / m[2] ** 3

    @identity(
        "(6)", f"D_wi = P22_wi/(m·n)³, and (7) P22_wi = χ⁺(s) s P22/σ with s = -x_i x̃ - y_i ỹ + z_i, {_name}",
        [f"oracle.slopes.visible_{_name}", f"oracle.slopes.{_name}", f"oracle.ndf.{_name}", f"oracle.masking.sigma_{_name}",
         "oracle.slopes.from_normal"],
        also=["(7)"], mutant=("(7) as printed", lambda f: lambda s, i, a: f((-s[0], -s[1]), i, a)),
    )  # fmt: skip
    def visible_slopes(P22_i, P22, D, sigma, from_normal):
        for i, m in fronts():
            for alpha in ALPHAS:
                a, s = exact(alpha), from_normal(m)
                visible = P22_i(s, i, a)
                yield visible / m[2] ** 3, dot(i, m) * D(m, a) / sigma(i, a)
                yield visible, (i[2] - i[0] * s[0] - i[1] * s[1]) * P22(s, a) / sigma(i, a)

    @identity(
        "(8)", f"P22 is shape-invariant, {_name}, at exact slopes", f"oracle.slopes.{_name}",
        mutant=("without 1/(λ_x λ_y)", lambda f: lambda s, a: f(s, a) * a[0]),
    )  # fmt: skip
    def shape_invariance(P22):
        for alpha in ALPHAS:
            s, a, c = exact((0.25, -0.5)), exact(alpha), exact((0.25, 2))
            there = P22((s[0] / c[0], s[1] / c[1]), (a[0] / c[0], a[1] / c[1]))
            yield P22(s, a), there / (c[0] * c[1])

    @identity(
        "(9)", f"P22_wi is shape-invariant, {_name}, at exact slopes", [f"oracle.slopes.visible_{_name}", "oracle.slopes.stretch"],
        mutant=("wi not stretched", lambda f: lambda s, i, a: f(s, (i[1], i[0], i[2]), a)),
    )  # fmt: skip
    def visible_shape_invariance(P22_i, stretch):
        for alpha in ALPHAS:
            for i in directions():
                s, a, c = exact((-0.25, -0.5)), exact(alpha), exact((0.25, 2))
                there = P22_i((s[0] / c[0], s[1] / c[1]), stretch(i, c), (a[0] / c[0], a[1] / c[1]))
                yield P22_i(s, i, a), there / (c[0] * c[1])


@identity(
    "§5.1 ∂m̃/∂ω_m", "1/(m·n)³ is the area that ∂m̃/∂m spans", "oracle.jacobian.slope",
    mutant=("cos⁴", lambda f: lambda m: f(m) / m[2]),
)  # fmt: skip
def slope_jacobian(jacobian):
    for m in directions(NORMALS):
        (ax, ay), (bx, by) = ([(m[k] * t[2] - t[k] * m[2]) / m[2] ** 2 for k in (0, 1)] for t in tangents(m))
        yield jacobian(m), abs(ax * by - ay * bx)


@certified(
    "(10)", "∫ P22(x̃, ỹ) dỹ = P2-(x̃) = 1/(2(1 + x̃²)^(3/2)), GGX, enclosed", lambda x: (1 + x * x) ** 2,
    mutant=("power 1", lambda f: lambda x: 1 + x * x),
)  # fmt: skip
def marginal_of_ggx(square):
    """ỹ = √(1 + x̃²) tan τ."""
    for x in (arb(0), arb(0.75), arb(-4)):
        width = (1 + x * x).sqrt()
        whole = integral(lambda t: t.cos() ** 2 / arb.pi(), -arb.pi() / 2, arb.pi() / 2)
        yield whole * width / square(x), 1 / (2 * (1 + x * x) * width)


@certified(
    "(11)", "the marginal distribution function (sin(ψ + θ) + cos θ)/(1 + cos θ) is the integral of (10), GGX, enclosed",
    lambda psi, theta: ((psi + theta).sin() + theta.cos()) / (1 + theta.cos()),
    mutant=("θ of the other sign", lambda f: lambda psi, theta: f(psi, -theta)),
)  # fmt: skip
def marginal_distribution(cdf):
    """x̃ = tan ψ; (10) is cos(ψ + θ) dψ / (1 + cos θ)."""
    for degrees in (0.5, 1.0, 1.5, 2.0):
        theta = arb(degrees)
        for share in (0.25, 0.5, 0.875):
            psi = -arb.pi() / 2 + (arb.pi() - theta) * share

            def visible(t, theta=theta):
                """(z_i - x_i tan t) P2-(tan t) / cos² t, before it is divided by c."""
                return (theta.cos() * t.cos() - theta.sin() * t.sin()) / 2

            c = integral(visible, -arb.pi() / 2, arb.pi() / 2 - theta)
            yield cdf(psi, theta), integral(visible, -arb.pi() / 2, psi) / c


@certified(
    "(13)", "the conditional distribution function ½ + (τ + sin τ cos τ)/π is the integral of (12), GGX, enclosed",
    lambda tau: arb(0.5) + (tau + tau.sin() * tau.cos()) / arb.pi(),
    mutant=("τ alone", lambda f: lambda tau: arb(0.5) + tau / arb.pi()),
)  # fmt: skip
def conditional_distribution(cdf):
    """ỹ = √(1 + x̃²) tan τ has P22/P2- dỹ = (2/π) cos² τ dτ, whatever x̃ and wi."""
    for t in (-1.25, -0.5, 0.0, 1.0):
        yield cdf(arb(t)), integral(lambda x: 2 * x.cos() ** 2 / arb.pi(), -arb.pi() / 2, arb(t))


@certified(
    "(4)", "weak white furnace: ∫ D_wi dm = 1 with the G1 that f_r carries, GGX, enclosed",
    lambda w, a: integrate.g1_ggx(w, a, BITS), mutant=("G1²", lambda f: lambda w, a: f(w, a) ** 2),
)  # fmt: skip
def weak_furnace(integrated_g1):
    """∫ G1 D/(4|wi·n|) dwo over the sphere is ∫ G1 ⟨wi·m⟩ D/|wi·n| dm, since dwo = 4|wi·m| dm."""
    for w in DIRECTIONS:
        for alpha in ALPHAS:
            i, a = normalise(exact(w)), exact(alpha)
            s, z = stretched(i, a)
            seen = integral(lambda b, s=s, z=z: (z * b.cos() - s * b.sin()) / 2, -arb.pi() / 2, arb.atan2(z, s))
            yield integrated_g1(w, alpha) * seen / dot(i, N), 1
