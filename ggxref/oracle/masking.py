"""Lambda, G1, G2. A direction below the horizon sees the surface from below: G1(w, m) = G1(-w, m), walter2014 (7)."""

from flint import arb

from ggxref.oracle.linalg import Matrix, N, Vector, apply, dot, norm, normalise
from ggxref.oracle.precision import at_least_zero, exactly, sign


def sigma_ggx(w: Vector, alpha: Vector) -> arb:
    """int max(w.m, 0) D dm = (z + |(ax x, ay y, z)|) / 2 for a unit w: dupuy2023 (4), unstretched."""
    (x, y, z), (ax, ay) = w, alpha
    return (z + norm((ax * x, ay * y, z))) / 2


def sigma_beckmann(w: Vector, alpha: Vector) -> arb:
    """int max(w.m, 0) D dm for a unit w, also below the horizon.

    z (1 + erf a) / 2 + s exp(-a^2) / (2 sqrt pi), s = |(ax x, ay y)|, a = z / s: the integral of max(0, z - s t)
    exp(-t^2) / sqrt(pi) over t. erfc(-a) stands for 1 + erf(a), of which nothing is left where a is far below 0.
    """
    (x, y, z), (ax, ay) = w, alpha
    s = norm((ax * x, ay * y, arb(0)))
    if s == 0:
        return at_least_zero(z)
    a = z / s
    return z * (-a).erfc() / 2 + s * (-a * a).exp() / (2 * arb.pi().sqrt())


def _front(w: Vector, wm: Vector) -> bool:
    """chi+((w.m)(w.n)): m faces the side that w is on."""
    return sign(dot(w, wm)) * sign(w[2]) > 0


def _raised(w: Vector) -> tuple[arb, arb, arb]:
    """sgn(w.n) w, of unit length."""
    x, y, z = normalise(w)
    return (x, y, z) if sign(w[2]) >= 0 else (-x, -y, -z)


def lambda_ggx(w: Vector, alpha: Vector) -> arb:
    """(-1 + sqrt(1 + (ax^2 x^2 + ay^2 y^2) / z^2)) / 2; infinite at the horizon. tokuyoshi2024."""
    if sign(w[2]) == 0:
        return arb.pos_inf()
    (x, y, z), (ax, ay) = w, alpha
    return (-1 + (1 + ((ax * x) ** 2 + (ay * y) ** 2) / z**2).sqrt()) / 2


def lambda_beckmann(w: Vector, alpha: Vector) -> arb:
    """(erf(a) - 1) / 2 + exp(-a^2) / (2 a sqrt pi), a = |z| / |(ax x, ay y)|; infinite at the horizon. Smith 1967.

    erfc(a) stands for 1 - erf(a): the two terms are near exp(-a^2), far below the last bit of erf(a).
    """
    if sign(w[2]) == 0:
        return arb.pos_inf()
    (x, y, z), (ax, ay) = w, alpha
    s = norm((ax * x, ay * y, arb(0)))
    if s == 0:
        return arb(0)
    a = abs(z) / s
    return -a.erfc() / 2 + (-a * a).exp() / (2 * a * arb.pi().sqrt())


def g1_ggx(w: Vector, wm: Vector, alpha: Vector) -> arb:
    """chi+((w.m)(w.n)) |z| / sigma(w). dupuy2023 (15)."""
    if not _front(w, wm):
        return arb(0)
    w = _raised(w)
    return w[2] / sigma_ggx(w, alpha)


def g1_beckmann(w: Vector, wm: Vector, alpha: Vector) -> arb:
    """chi+((w.m)(w.n)) |z| / sigma(w). dupuy2023 (15) for the Beckmann distribution."""
    if not _front(w, wm):
        return arb(0)
    w = _raised(w)
    return w[2] / sigma_beckmann(w, alpha)


def g1_v_cavity(w: Vector, wm: Vector) -> arb:
    """chi+((w.m)/(w.n)) min(1, 2 |m.n| |w.n| / |w.m|). heitz2014 (3). The lengths of w and m cancel."""
    if not _front(w, wm):
        return arb(0)
    with exactly():
        ratio = 2 * abs(wm[2] * w[2]), abs(dot(w, wm))
    return (ratio[0] / ratio[1]).min(arb(1))


def g1_ellipsoid(w: Vector, wm: Vector, A: Matrix) -> arb:
    """min(1, 2 |A n|^2 |u.n| / (|A u| |A n| + A u . A n)) chi+(u.m), u = sgn(w.n) w. walter2014 (6), (7)."""
    if not _front(w, wm):
        return arb(0)
    u = _raised(w)
    Au, An = apply(A, u), apply(A, N)
    return (2 * dot(An, An) * u[2] / (norm(Au) * norm(An) + dot(Au, An))).min(arb(1))


def g2_separable(g1_i: arb, g1_o: arb) -> arb:
    """G1(wi) G1(wo). heitz2014 section 2.1, walter2014 (5)."""
    return g1_i * g1_o


def g2_height_correlated(g1_i: arb, g1_o: arb) -> arb:
    """Gi Go / (Gi + Go - Gi Go), 0 where either is 0. dupuy2023 (13)."""
    if sign(g1_i) == 0 or sign(g1_o) == 0:
        return arb(0)
    return g1_i * g1_o / (g1_i + g1_o - g1_i * g1_o)


def g2_v_cavity(wi: Vector, wo: Vector, wm: Vector) -> arb:
    """min(G1, G1) where wo is above the horizon, else max(G1 + G1 - 1, 0); wi is above. heitz2014 section 2.1."""
    g1_i, g1_o = g1_v_cavity(wi, wm), g1_v_cavity(wo, wm)
    return g1_i.min(g1_o) if sign(wo[2]) > 0 else at_least_zero(g1_i + g1_o - 1)
