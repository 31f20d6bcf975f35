"""The article on Tokuyoshi & Eto 2024 in ball arithmetic, at exact inputs: the bound (25)–(39) and its density (40)–(43)."""

from flint import arb

from ggxref.verify.dupuy2023_exact import squeeze, to_hemisphere
from ggxref.verify.identities import (
    ALPHAS,
    add,
    directions,
    dot,
    exact,
    norm,
    normalise,
    reflections,
    scale,
)
from ggxref.verify.tokuyoshi2024_exact import tokuyoshi


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
