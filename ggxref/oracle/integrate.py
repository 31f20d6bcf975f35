"""Certified integrals: balls that are proven to hold the value, one dimension of each done in closed form.

The normalisations should hold 1, and the G1 those of `masking`: they share no closed form with it.
"""

from collections.abc import Callable, Sequence
from fractions import Fraction

from flint import acb, arb

from ggxref.oracle.linalg import N, apply, cross, determinant, dot, inverse_transpose, norm, normalise, transpose
from ggxref.oracle.precision import Undecided, exact, sign, working

Number = int | float | Fraction
Integrand = Callable[[acb, bool], acb]


def integral(f: Integrand, a: arb, b: arb) -> arb:
    """Enclosure of the integral of f from a to b, f real there.

    f(z, analytic) has to hand `analytic` on to every root, logarithm and real power in it: where the flag is set and z
    meets a branch cut, f must come out non-finite, or the result is wrong without a sign of it.
    """
    value = acb.integral(f, acb(a), acb(b))
    if not value.is_finite():
        raise Undecided("the integral did not converge")
    return value.real


def power_three_halves(x: acb, analytic: bool) -> acb:
    """x^(3/2)."""
    return x * x.sqrt(analytic=analytic)


def projected_area_ggx(alpha: Sequence[Number], bits: int) -> arb:
    """int D cos dm of GGX, over t = sin^2 theta; it is 1. heitz2014 (1).

    D cos dm = dt dphi / (2 pi ax ay q^2) with q = a cos^2 phi + b sin^2 phi, a = t/ax^2 + 1 - t, b = t/ay^2 + 1 - t, and
    the integral of 1/q^2 over phi is pi (a + b) / (a b)^(3/2).
    """

    def density(t: acb, analytic: bool) -> acb:
        a, b = (t / width**2 + 1 - t for width in (ax, ay))
        return (a + b) / (2 * ax * ay * power_three_halves(a, analytic) * power_three_halves(b, analytic))

    with working(bits):
        ax, ay = exact(alpha)
        return integral(density, arb(0), arb(1))


def projected_area_beckmann(alpha: Sequence[Number], bits: int) -> arb:
    """int D cos dm of the Beckmann distribution, over v = tan^2 theta; it is 1. heitz2014 (1).

    D cos dm = exp(-v (p cos^2 phi + q sin^2 phi)) dv dphi / (2 pi ax ay), p = 1/ax^2, q = 1/ay^2; its integral over phi is
    exp(-v (p + q)/2) I0(v |p - q|/2) / (ax ay), in which exp(-x) I0(x) is taken as one. What is left beyond v = V is at
    most a^2 exp(-V/a^2) / (ax ay), a the larger alpha.
    """

    def density(v: acb, _: bool) -> acb:
        return (-v / widest).exp() * (v * abs(p - q) / 2).bessel_i(0, scaled=True) / (ax * ay)

    with working(bits):
        ax, ay = exact(alpha)
        p, q, widest = 1 / ax**2, 1 / ay**2, ax.max(ay) ** 2
        end = (bits * widest).upper()
        rest = widest / (ax * ay) * (-end / widest).exp()
        return integral(density, arb(0), end) + arb(0).union(rest)


def projected_area_student_t(alpha: Sequence[Number], gamma: Number, bits: int) -> arb:
    """int D cos dm of the Student-T distribution, over phi; it is 1. heitz2014 (1), Ribardiere et al. 2017.

    In slopes r (cos phi, sin phi), with s = cos^2 phi/ax^2 + sin^2 phi/ay^2, the integral of r (g-1 + s r^2)^-g dr is
    (g-1)^(1-g) / (2 s (g-1)). A quarter of the circle stands for all.
    """

    def density(phi: acb, _: bool) -> acb:
        s = (phi.cos() / ax) ** 2 + (phi.sin() / ay) ** 2
        return 4 * (g - 1) ** g / (arb.pi() * ax * ay) * (g - 1) ** (1 - g) / (2 * s * (g - 1))

    with working(bits):
        (ax, ay), g = exact(alpha), exact(gamma)
        return integral(density, arb(0), arb.pi() / 2)


def projected_area_ellipsoid(A: Sequence[Sequence[Number]], bits: int) -> arb:
    """int D cos dm of the ellipsoid NDF, over the slope x = tan(tau); it is 1. heitz2014 (1), walter2014 (1).

    With a, b, c the columns of A^-T, the integral over the slope y of 1 / |c - x a - y b|^4 is
    pi |b|^2 / (2 |b x (x a - c)|^3).
    """

    def density(tau: acb, analytic: bool) -> acb:
        sin, cos = tau.sin_cos()
        square = sin * sin * p - 2 * sin * cos * q + cos * cos * r
        return scale * cos / power_three_halves(square, analytic)

    with working(bits):
        A_exact = exact(A)
        a, b, c = transpose(inverse_transpose(A_exact))
        ba, bc = cross(b, a), cross(b, c)
        p, q, r = dot(ba, ba), dot(ba, bc), dot(bc, bc)
        scale = dot(b, b) / (2 * abs(determinant(A_exact)) * norm(apply(A_exact, N)))
        return integral(density, -arb.pi() / 2, arb.pi() / 2)


def _reduced(w: Sequence[Number], alpha: Sequence[Number]) -> tuple[arb, arb]:
    """z and s = |(ax x, ay y)| of the unit w: w.m D dm is (z - s t) times the density of t, the slope towards w over its
    own width, when the slope across is integrated out.
    """
    (x, y, z), (ax, ay) = normalise(exact(w)), exact(alpha)
    if sign(z) <= 0:
        raise ValueError(f"the defining integral of G1 is taken above the horizon; w.z is {z.str(5)}")
    return z, norm((ax * x, ay * y, arb(0)))


def g1_ggx(w: Sequence[Number], alpha: Sequence[Number], bits: int) -> arb:
    """z / int max(0, w.m) D dm of GGX, z > 0. dupuy2023 (15).

    The slope t = tan(beta) has the density 1 / (2 (1 + t^2)^(3/2)).
    """

    def seen(beta: acb, _: bool) -> acb:
        return (z * beta.cos() - s * beta.sin()) / 2

    with working(bits):
        z, s = _reduced(w, alpha)
        return z / integral(seen, -arb.pi() / 2, arb.atan2(z, s))


def g1_beckmann(w: Sequence[Number], alpha: Sequence[Number], bits: int) -> arb:
    """z / int max(0, w.m) D dm of the Beckmann distribution, z > 0. dupuy2023 (15).

    The slope t has the density exp(-t^2) / sqrt(pi). What lies beyond |t| = T is at most (z + s T) exp(-T^2) for T >= 1.
    """

    def seen(t: acb, _: bool) -> acb:
        return (z - s * t) * (-t * t).exp() / arb.pi().sqrt()

    with working(bits):
        z, s = _reduced(w, alpha)
        reach = arb(bits).sqrt().upper()
        end = reach if s == 0 or z > s * reach else z / s
        rest = (z + s * reach) * (-reach * reach).exp()
        return z / (integral(seen, -reach, end) + arb(0).union(rest))
