"""The article on Tokuyoshi & Eto 2024 in ball arithmetic, at exact inputs; its equations are numbered in its order."""

from functools import partial

from flint import arb

from ggxref.oracle.linalg import determinant, inverse_transpose, transpose
from ggxref.verify import identities
from ggxref.verify.dupuy2023_exact import ONE, VNDF, cases, inverse, squeeze, to_hemisphere
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
    norm,
    normalise,
    reflections,
    scale,
    tangents,
    unit_derivative,
)

tokuyoshi = partial(identities.identity, "tokuyoshi2024")

# The article, in its order: definitions (1)–(18), caps (19)–(24), the bound (25)–(39), the density (40)–(43).


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


def reflected(alpha):
    """Pairs of directions with the stretched incidence i', the stretched half vector m', and h = wi + wo."""
    return [(i, o, *to_hemisphere(alpha, i, m)[:2], add(i, o)) for i, o, m in reflections()]


@tokuyoshi(
    "(25)", "wo' = 2(wi'·wm') wm' - wi' is unit, and wm' its half vector with wi'", "oracle.geometry.reflect",
    mutant=("z'_m for wm', as printed", lambda f: lambda w, m: tuple(2 * dot(w, m) * m[2] - x for x in w)),
)  # fmt: skip
@tokuyoshi(
    "(26)", "z'_o = 2(wi'·wm') z'_m - z'_i, its third component", "oracle.geometry.reflect",
    mutant=("2 lost", lambda f: lambda w, m: scale(arb(1) / 2, add(f(w, m), w))),
)  # fmt: skip
def reflected_vector(reflect):
    for alpha in ALPHAS:
        for _, _, inner, m, _ in reflected(alpha):
            o = reflect(inner, m)
            yield dot(o, o), 1
            yield normalise(add(inner, o)), m
            yield o[2], 2 * dot(inner, m) * m[2] - inner[2]


@tokuyoshi(
    "(27)", "wi' = (α_x x_i, α_y y_i, z_i)/‖…‖", ["oracle.slopes.stretch"], mutant=("α_x twice", lambda f: lambda w, a: f(w, (a[0], a[0]))),
)  # fmt: skip
@tokuyoshi(
    "(28)", "wm' = (x_m/α_x, y_m/α_y, z_m)/‖…‖, with which z'_o of (26) follows", ["oracle.slopes.stretch"],
    mutant=("multiplied", lambda f: lambda w, a: f(w, (1 / a[0], 1 / a[1]))),
)  # fmt: skip
def stretched_vectors(stretch):
    for alpha in ALPHAS[:2] + ALPHAS[3:]:
        a = exact(alpha)
        for i, _, inner, m, h in reflected(alpha):
            yield stretch(i, a), inner
            yield stretch(normalise(h), (1 / a[0], 1 / a[1])), m


def lengths(alpha, i, m):
    """‖(α_x x_i, α_y y_i, z_i)‖ and ‖(x_m/α_x, y_m/α_y, z_m)‖²."""
    a, b = exact(alpha)
    return norm((a * i[0], b * i[1], i[2])), (m[0] / a) ** 2 + (m[1] / b) ** 2 + m[2] ** 2


def height(inner, m):
    """z'_o of (26)."""
    return 2 * dot(inner, m) * m[2] - inner[2]


@tokuyoshi(
    "(29)", "z'_o = 2 z_m (wi·wm)/(‖…‖‖…‖²) - z'_i", lambda i, m, n, q: 2 * m[2] * dot(i, m) / (n * q) - i[2] / n,
    mutant=("‖…‖ for ‖…‖²", lambda f: lambda i, m, n, q: f(i, m, n, q.sqrt())),
)  # fmt: skip
def height_in_tangent_space(formula):
    for alpha in ALPHAS:
        for i, _, inner, m_std, h in reflected(alpha):
            m = normalise(h)
            yield formula(i, m, *lengths(alpha, i, m)), height(inner, m_std)


@tokuyoshi(
    "(30)", "z'_o = (z_i + z_o)‖wi + wo‖²/(‖…‖‖…‖²) - z'_i", lambda i, h, n, q: h[2] * dot(h, h) / (n * q) - i[2] / n,
    mutant=("‖wi + wo‖", lambda f: lambda i, h, n, q: h[2] * norm(h) / (n * q) - i[2] / n),
)  # fmt: skip
def height_by_both_directions(formula):
    for alpha in ALPHAS:
        for i, _, inner, m_std, h in reflected(alpha):
            yield formula(i, h, *lengths(alpha, i, h)), height(inner, m_std)


AROUND = [(3, 4), (-5, 12), (8, -15), (-1, 0), (0, 1)]


def horizon():
    """Directions on the horizon, at exact azimuths."""
    return [normalise(exact((x, y, 0))) for x, y in AROUND]


def height_on_horizon(alpha, i, o):
    inner, m, _ = to_hemisphere(alpha, i, normalise(add(i, o)))
    return height(inner, m), inner


def bracket(i, o, a, b):
    """{…} of (31)."""
    x, y, z = i[0] + o[0], i[1] + o[1], i[2]
    return (x * x + y * y + z * z) / ((x / a) ** 2 + (y / b) ** 2 + z * z) - 1


@tokuyoshi(
    "(31)", "o'_z(π/2, φ) = {((x_i + cos φ)² + (y_i + sin φ)² + z_i²)/(…/α_x² + …/α_y² + z_i²) - 1} z'_i", bracket,
    mutant=("without - 1", lambda f: lambda *v: f(*v) + 1),
)  # fmt: skip
def heights_on_horizon(form):
    for alpha in ALPHAS:
        for i in directions():
            for o in horizon():
                value, inner = height_on_horizon(alpha, i, o)
                yield form(i, o, *exact(alpha)) * inner[2], value


WIDTHS = (0.0625, 0.5, 0.75)


def radius(i, o):
    """r of (34)."""
    return (i[0] + o[0]) ** 2 + (i[1] + o[1]) ** 2


@tokuyoshi(
    "(32)", "isotropic: o'_z = {α²(r + z_i²)/(r + α² z_i²) - 1} z'_i with (34) r = (x_i + cos φ)² + (y_i + sin φ)²", radius,
    mutant=("√r", lambda f: lambda i, o: f(i, o).sqrt()),
)  # fmt: skip
@tokuyoshi(
    "(34)", "r is the squared distance of (-x_i, -y_i) and (cos φ, sin φ)", radius,
    mutant=("of (x_i, y_i)", lambda f: lambda i, o: f((-i[0], -i[1], i[2]), o)),
)  # fmt: skip
def isotropic_heights(r):
    for a in map(arb, WIDTHS):
        for i in directions():
            for o in horizon():
                value, inner = height_on_horizon((a, a), i, o)
                d, square = r(i, o), i[2] ** 2
                yield (a * a * (d + square) / (d + a * a * square) - 1) * inner[2], value
                yield d, dot(add(i, o), add(i, o)) - square


@tokuyoshi(
    "(33)", "argmin o'_z = argmax r for α < 1: the larger r has the lower o'_z", lambda r, s: (r, s),
    mutant=("argmin r", lambda f: lambda r, s: (s, r)),
)  # fmt: skip
def largest_radius(order):
    for a in map(arb, WIDTHS):
        for i in directions():
            for o, p in zip(horizon(), horizon()[1:], strict=False):
                first, second = order(radius(i, o), radius(i, p))
                low, high = height_on_horizon((a, a), i, o)[0], height_on_horizon((a, a), i, p)[0]
                expected = low.min(high)
                yield (low if first > second else high), expected


def own_azimuth(i):
    return normalise((i[0], i[1], arb(0)))


def spread(i):
    """(35)"""
    return 1 + norm((i[0], i[1], arb(0)))


@tokuyoshi(
    "(35)", "s = 1 + √(x_i² + y_i²) is the distance at wi's own azimuth φ_s", spread, mutant=("1 + z_i", lambda f: lambda i: 1 + i[2]),
)  # fmt: skip
@tokuyoshi(
    "(36)", "r(φ_s) = s², and no r is larger", spread, mutant=("√s", lambda f: lambda i: f(i).sqrt()),
)  # fmt: skip
def largest_distance(s):
    for i in directions():
        yield radius(i, own_azimuth(i)), s(i) ** 2
        for o in horizon():
            yield radius(i, o).max(s(i) ** 2), s(i) ** 2


@tokuyoshi(
    "(37)", "min o'_z = (α² - 1)s²/(s² + α² z_i²) z'_i", lambda s, a, z: (a * a - 1) * s * s / (s * s + a * a * z * z),
    mutant=("α² - 1 in the numerator only at s", lambda f: lambda s, a, z: f(s.sqrt(), a, z)),
)  # fmt: skip
def least_height(form):
    for a in map(arb, WIDTHS):
        for i in directions():
            value, inner = height_on_horizon((a, a), i, own_azimuth(i))
            yield form(spread(i), a, i[2]) * inner[2], value
            for o in horizon():
                yield value.min(height_on_horizon((a, a), i, o)[0]), value


@tokuyoshi(
    "(38)", "min o'_z = -k z'_i, k = (1 - α²)s²/(s² + α² z_i²)", "oracle.sampling.bounded_cap.bound",
    mutant=("k = 1", lambda f: lambda i, a: arb(1)),
)  # fmt: skip
def bound_is_least_height(bound):
    for a in map(arb, WIDTHS):
        for i in directions():
            value, inner = height_on_horizon((a, a), i, own_azimuth(i))
            yield -bound(i, (a, a)) * inner[2], value


@tokuyoshi(
    "(39)", "with α = min(α_x, α_y, 1) no o'_z on the horizon lies below -k z'_i", "oracle.sampling.bounded_cap.bound",
    mutant=("max", lambda f: lambda i, a: f(i, (a[0].max(a[1]),) * 2)),
)  # fmt: skip
def bound_keeps_support(bound):
    for alpha in [*ALPHAS, (0.0625, 0.75)]:
        for i in directions():
            for o in [*horizon(), own_azimuth(i)]:
                value, inner = height_on_horizon(alpha, i, o)
                low = -bound(i, exact(alpha)) * inner[2]
                yield value.min(low), low


BOUNDED = [
    "oracle.sampling.bounded_cap.pdf",
    "oracle.sampling.bounded_cap.bound",
    "oracle.ndf.ggx",
    "oracle.jacobian.linear",
]


@tokuyoshi(
    "(40)", "p_bound = p_sc ‖∂wo'/∂wm'‖ ‖∂wm'/∂wm‖", BOUNDED, mutant=("first Jacobian inverted", lambda f: lambda m, i, a: f(m, i, a) / 16),
)  # fmt: skip
@tokuyoshi(
    "(41)", "p_sc = 1/(2π(1 + k z'_i))", BOUNDED, mutant=("1 - k z'_i", lambda f: lambda m, i, a: f(m, i, a) * 2),
)  # fmt: skip
@tokuyoshi(
    "(42)", "the Jacobians' product is 4|wi·wm|/(α_x α_y (…)² ‖(α_x x_i, α_y y_i, z_i)‖)", BOUNDED,
    mutant=("power 3/2", lambda f: lambda m, i, a: f(m, i, a) * ((m[0] / a[0]) ** 2 + (m[1] / a[1]) ** 2 + m[2] ** 2).sqrt()),
)  # fmt: skip
@tokuyoshi(
    "(43)", "p_bound = 2 D |wi·wm|/(k z_i + ‖(α_x x_i, α_y y_i, z_i)‖)", BOUNDED, mutant=("D/2", lambda f: lambda m, i, a: f(m, i, a) / 2),
)  # fmt: skip
def bounded_density(pdf, bound, D, linear):
    for alpha in ALPHAS:
        a, b = exact(alpha)
        for i, _, inner, m_std, h in reflected(alpha):
            m = normalise(h)
            k, (n, q) = bound(i, (a, b)), lengths(alpha, i, m)
            cap = 1 / (2 * arb.pi() * (1 + k * inner[2]))
            jacobians = 4 * dot(inner, m_std) * linear(m, squeeze(alpha))
            yield pdf(m, i, (a, b)), cap * jacobians
            yield jacobians, 4 * dot(i, m) / (a * b * q**2 * n)
            yield pdf(m, i, (a, b)), 2 * D(m, (a, b)) * dot(i, m) / (k * i[2] + n)
