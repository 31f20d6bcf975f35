"""The article on Tokuyoshi & Eto 2024 in ball arithmetic, at exact inputs; its equations are numbered in its order: definitions
(1)–(18) and caps (19)–(24)."""

from functools import partial

from flint import arb

from ggxref.oracle.linalg import determinant, inverse_transpose, transpose
from ggxref.verify import identities
from ggxref.verify.dupuy2023_exact import ONE, VNDF, cases, inverse, squeeze
from ggxref.verify.identities import (
    ALPHAS,
    NORMALS,
    add,
    apply,
    area,
    directions,
    dot,
    exact,
    fronts,
    normalise,
    reflections,
    tangents,
    unit_derivative,
)

tokuyoshi = partial(identities.identity, "tokuyoshi2024")


@tokuyoshi(
    "(1)", "D_vis = G1 |wi·m| D/(wi·n)", [VNDF, "oracle.masking.g1_ggx", "oracle.ndf.ggx"],
    mutant=("wi·m lost", lambda f: lambda m, i, a: f(m, i, a) / dot(i, m)),
)  # fmt: skip
@tokuyoshi(
    "(5)", "D_vis,std = G1,std |wi·m| D_std/(wi·n)", [VNDF, "oracle.masking.g1_ggx", "oracle.ndf.ggx"],
    mutant=("wi·n lost", lambda f: lambda m, i, a: f(m, i, a) * i[2]),
)  # fmt: skip
def visible_normals(pdf, g1, D):
    for alpha, i, m in cases():
        for a in (exact(alpha), ONE):
            yield pdf(m, i, a), g1(i, m, a) * dot(i, m) * D(m, a) / i[2]


@tokuyoshi(
    "(2)", "D = 1/(π α_x α_y (x²/α_x² + y²/α_y² + z²)²)", "oracle.ndf.ggx", mutant=("square lost", lambda f: lambda m, a: f(m, a).sqrt()),
)  # fmt: skip
@tokuyoshi(
    "(6)", "D_std = 1/π", "oracle.ndf.ggx", mutant=("1", lambda f: lambda m, a: f(m, a) * arb.pi()),
)  # fmt: skip
def ggx(D):
    for alpha, _, m in cases():
        a, b = exact(alpha)
        yield D(m, (a, b)), 1 / (arb.pi() * a * b * ((m[0] / a) ** 2 + (m[1] / b) ** 2 + m[2] ** 2) ** 2)
        yield D(m, ONE), 1 / arb.pi()


@tokuyoshi(
    "(3)", "G1 = 1/(1 + Λ), on front faces", ["oracle.masking.g1_ggx", "oracle.masking.lambda_ggx"],
    mutant=("1/(1 + 2Λ)", lambda f: lambda w, m, a: f(w, m, a) / (2 - f(w, m, a))),
)  # fmt: skip
@tokuyoshi(
    "(7)", "G1,std = 2 z_i/(1 + z_i)", ["oracle.masking.g1_ggx", "oracle.masking.lambda_ggx"],
    mutant=("z_i/(1 + z_i)", lambda f: lambda w, m, a: f(w, m, a) / 2),
)  # fmt: skip
def masking(g1, smith):
    for alpha, i, m in cases():
        yield g1(i, m, exact(alpha)), 1 / (1 + smith(i, exact(alpha)))
        yield g1(i, m, ONE), 2 * i[2] / (1 + i[2])


@tokuyoshi(
    "(4)", "Λ = (-1 + √(1 + (α_x²x² + α_y²y²)/z²))/2", "oracle.masking.lambda_ggx", mutant=("without the half", lambda f: lambda w, a: 2 * f(w, a)),
)  # fmt: skip
def smith_lambda(smith):
    for alpha in ALPHAS:
        a, b = exact(alpha)
        for w in directions():
            yield smith(w, (a, b)), ((1 + ((a * w[0]) ** 2 + (b * w[1]) ** 2) / w[2] ** 2).sqrt() - 1) / 2


@tokuyoshi(
    "(8)", "D_vis,std = 2(wi·m)/(π(1 + z_i))", VNDF, mutant=("1/π", lambda f: lambda m, i, a: f(m, i, a) / 2),
)  # fmt: skip
def standard_visible_normals(pdf):
    for i, m in fronts():
        yield pdf(m, i, ONE), 2 * dot(i, m) / (arb.pi() * (1 + i[2]))


def stretches(place, wrong, form, reference):
    """(9)–(16): each way to write the stretch against the matrix M of (17)."""

    statement, *mutant = wrong

    @tokuyoshi(place, statement, form, mutant=tuple(mutant))
    def stretch(map_):
        for alpha in ALPHAS:
            for w in directions():
                yield map_(w, *exact(alpha)), normalise(apply(reference(squeeze(alpha)), w))


def componentwise(x, y):
    return lambda w, a, b: normalise((w[0] * x(a), w[1] * y(b), w[2]))


def times(a):
    return a


def over(a):
    return 1 / a


_LOST = ("y by α_x", lambda f: lambda w, a, b: f(w, a, a))
stretches("(9)", ("ω' = (x α_x, y α_y, z) is M⁻¹ω", *_LOST), componentwise(times, times), inverse)
stretches("(10)", ("ω = (x'/α_x, y'/α_y, z') is M ω'", *_LOST), componentwise(over, over), lambda M: M)
stretches("(11)", ("ω_m' = (x_m/α_x, y_m/α_y, z_m) is Mᵀω_m", *_LOST), componentwise(over, over), transpose)
stretches("(12)", ("ω_m = (x_m'α_x, y_m'α_y, z_m') is M⁻ᵀω_m'", *_LOST), componentwise(times, times), inverse_transpose)


def pulled(M, w):
    return normalise(apply(M, w))


@tokuyoshi(
    "(13)", "ω' = M⁻¹ω and (14) ω = M ω' undo each other", pulled, mutant=("M² ω'", lambda f: lambda M, w: f(M, f(M, w))),
)  # fmt: skip
@tokuyoshi(
    "(14)", "ω = M ω' undoes (13)", pulled, mutant=("ω'", lambda f: lambda M, w: w),
)  # fmt: skip
@tokuyoshi(
    "(15)", "ω_m' = Mᵀω_m and (16) ω_m = M⁻ᵀω_m' undo each other", pulled,
    mutant=("M⁻ᵀ both ways", lambda f: lambda M, w: f(inverse_transpose(M), w)),
)  # fmt: skip
@tokuyoshi(
    "(16)", "directions by M and normals by M⁻ᵀ stay perpendicular", pulled, mutant=("normals by M", lambda f: lambda M, w: f(M, f(M, w))),
)  # fmt: skip
def stretch_and_back(map_):
    for alpha in ALPHAS[:2] + ALPHAS[3:]:
        M = squeeze(alpha)
        for w in directions():
            yield map_(M, pulled(inverse(M), w)), w
            yield map_(transpose(M), pulled(inverse_transpose(M), w)), w
            t = tangents(w)[0]
            yield dot(map_(M, w), pulled(inverse_transpose(M), t)), 0


@tokuyoshi(
    "(17)", "M = diag(1/α_x, 1/α_y, 1) takes the unit sphere to the ellipsoid of GGX: D = (dA/dm)/A⊥", ["oracle.ndf.ggx", squeeze],
    mutant=("diag(α_x, α_y, 1)", lambda f: lambda m, a: f(m, (1 / a[0], 1 / a[1]))),
)  # fmt: skip
def ellipsoid_of_ggx(D, M):
    """The point M s has the normal m ∝ M⁻ᵀs; the shadow of the ellipsoid along n is π/(α_x α_y)."""
    for alpha in ALPHAS:
        a, b = exact(alpha)
        for m in directions(NORMALS):
            back = transpose(M(alpha))
            moved = [apply(M(alpha), unit_derivative(apply(back, m), apply(back, t))) for t in tangents(m)]
            yield D(m, (a, b)), area(*moved) * a * b / arb.pi()


@tokuyoshi(
    "(18)", "‖∂ω_m'/∂ω_m‖ = det M/‖Mω_m‖³", "oracle.jacobian.linear", mutant=("det M lost", lambda f: lambda m, M: f(m, M) / determinant(M)),
)  # fmt: skip
def stretch_jacobian(linear):
    for alpha, _, m in cases()[: len(fronts()) * 2]:
        M = squeeze(alpha)
        yield linear(m, M), area(*(unit_derivative(apply(M, m), apply(M, t)) for t in tangents(m)))


@tokuyoshi(
    "(19)", "min z'_o = -z'_i, where m' lies in the horizon", "oracle.geometry.reflect",
    mutant=("0", lambda f: lambda w, m: (f(w, m)[0], f(w, m)[1], arb(0))),
)  # fmt: skip
def lowest_reflection(reflect):
    for i in directions():
        for x, y in ((3, 4), (-5, 12), (1, 0)):
            yield reflect(i, normalise(exact((x, y, 0))))[2], -i[2]


@tokuyoshi(
    "(20)", "f_p(wo') = p(wm') ‖∂wm'/∂wo'‖", ["oracle.sampling.spherical_cap.cap_pdf", VNDF, "oracle.jacobian.reflection"],
    mutant=("divided by the Jacobian", lambda f: lambda o, i: f(o, i) * 2),
)  # fmt: skip
@tokuyoshi(
    "(23)", "f_p = D_vis,std/(4|wi'·wm'|)", ["oracle.sampling.spherical_cap.cap_pdf", VNDF, "oracle.jacobian.reflection"],
    mutant=("2 for 4", lambda f: lambda o, i: f(o, i) / 2),
)  # fmt: skip
@tokuyoshi(
    "(24)", "f_p = 1/(2π(1 + z'_i))", ["oracle.sampling.spherical_cap.cap_pdf", VNDF, "oracle.jacobian.reflection"],
    mutant=("1 - z'_i", lambda f: lambda o, i: f(o, i) * (1 + i[2]) / (1 - i[2])),
)  # fmt: skip
def density_on_cap(cap_pdf, pdf, jacobian):
    for i, o, h in reflections():
        yield cap_pdf(o, i), pdf(h, i, ONE) * jacobian(o, h)
        yield cap_pdf(o, i), pdf(h, i, ONE) / (4 * dot(i, h))
        yield cap_pdf(o, i), 1 / (2 * arb.pi() * (1 + i[2]))


@tokuyoshi(
    "(21)", "‖∂wm'/∂wo'‖ = 1/(4|wo'·wm'|)", "oracle.jacobian.reflection", mutant=("1/2", lambda f: lambda o, m: 2 * f(o, m)),
)  # fmt: skip
@tokuyoshi(
    "(22)", "|wo'·wm'| = |wi'·wm'|: either may stand in (21)", "oracle.jacobian.reflection",
    mutant=("wi'·wo'", lambda f: lambda o, m: f(o, (m[0], m[1], -m[2]))),
)  # fmt: skip
def mirror_jacobian(jacobian):
    for i, o, h in reflections():
        spanned = area(*(unit_derivative(add(i, o), t) for t in tangents(o)))
        yield (jacobian(o, h), jacobian(i, h)), (spanned, spanned)
