"""What a test stresses: each flag is a sentence for people and a condition on the exact input and result."""

from collections.abc import Callable, Iterator
from itertools import product as pairs
from typing import Any

from flint import fmpq

from ggxref.golden.cases import leaves
from ggxref.golden.linear import cofactor, determinant, dot, transposed
from ggxref.golden.rounding import Format, binade, ulp
from ggxref.golden.stressed import Stressed

Condition = Callable[[Stressed], bool]
SENTENCES: dict[str, str] = {}
CONDITIONS: dict[str, Condition] = {}


def flag(sentence: str) -> Callable[[Condition], Condition]:
    """Register a condition under its own name in camel case."""

    def register(condition: Condition) -> Condition:
        name = "".join(word.capitalize() for word in condition.__name__.split("_"))
        SENTENCES[name], CONDITIONS[name] = sentence, condition
        return condition

    return register


def flags_of(stressed: Stressed) -> list[str]:
    """Names of the flags that hold, in the order of the list below."""
    return [name for name, condition in CONDITIONS.items() if condition(stressed)]


def planar(w: Any) -> fmpq:
    """Squared sine of the angle to the normal."""
    return (w[0] * w[0] + w[1] * w[1]) / dot(w, w)


@flag("A direction is the normal itself: there its azimuth, and the derivative of its sine, do not exist.")
def normal_incidence(t: Stressed) -> bool:
    return any(planar(w) == 0 for w in t.seen())


@flag("A direction within 0.04 rad of the normal, where 1 - cos² has lost its digits.")
def near_normal(t: Stressed) -> bool:
    return any(0 < planar(w) < fmpq(1, 625) for w in t.given("wi", "wo", "wm"))


@flag("A direction within 0.04 rad of the horizon, where tan² overflows and G1 goes to 0.")
def grazing(t: Stressed) -> bool:
    return any(0 < abs(w[2]) < fmpq(1, 25) for w in t.seen())


@flag("A direction exactly in the surface, z = 0: divisions by z, and densities that end there.")
def exact_horizon(t: Stressed) -> bool:
    return any(w[2] == 0 for w in t.given("wi", "wo", "wm"))


@flag("A direction or a micronormal below the horizon, which a sign test or an absolute value gets wrong.")
def backfacing(t: Stressed) -> bool:
    return any(w[2] < 0 for w in t.given("wi", "wo", "wm"))


@flag("The microfacet turns its other side to the direction: chi+ must see it.")
def wrong_side_microfacet(t: Stressed) -> bool:
    return any(dot(w, m) * w[2] < 0 for w, m in t.against())


@flag("A direction within 0.02 rad of the microfacet's plane, where a plain dot product cancels.")
def near_perpendicular(t: Stressed) -> bool:
    return any(dot(w, m) ** 2 < fmpq(1, 2500) * dot(w, w) * dot(m, m) for w, m in t.against())


@flag("The two directions nearly cancel, so that their half vector is nearly 0/0.")
def half_vector_degenerate(t: Stressed) -> bool:
    return any(dot(i, o) < 0 and planar_between(i, o) < fmpq(1, 1000) for i, o in two(t))


@flag("Both directions are one: light goes back where it came from.")
def retro(t: Stressed) -> bool:
    return any(i == o for i, o in two(t))


def two(t: Stressed) -> Iterator[tuple[Any, Any]]:
    return pairs(t.given("wi"), t.given("wo"))


def planar_between(i: Any, o: Any) -> fmpq:
    """Squared sine of the angle between two directions."""
    return 1 - dot(i, o) ** 2 / (dot(i, i) * dot(o, o))


@flag("A direction whose length is off by more than an ulp: it stands for the direction, not for its length.")
def non_unit(t: Stressed) -> bool:
    return any(abs(dot(w, w) - 1) > fmpq(4, 1 << t.fmt.precision) for w in t.case.directions().values())


@flag("An input is -0, which must act as +0 wherever the sign of zero has no meaning.")
def negative_zero(t: Stressed) -> bool:
    return any(bits == t.fmt.sign for bits in leaves(t.case.bits))


@flag("A roughness of at most 1e-3: lobes so narrow that clamps and cancellations show.")
def alpha_small(t: Stressed) -> bool:
    return any(min(a) <= fmpq(1, 1000) for a in t.given("alpha"))


@flag("Both roughnesses are exactly 1: the hemisphere.")
def alpha_one(t: Stressed) -> bool:
    return any(tuple(a) == (1, 1) for a in t.given("alpha"))


@flag("A roughness above 1, where cos² (alpha² - 1) + 1 changes character and bounds derived for alpha <= 1 fail.")
def alpha_above_one(t: Stressed) -> bool:
    return any(max(a) > 1 for a in t.given("alpha"))


@flag("The square of a roughness is below the dtype's normal range.")
def alpha_squared_underflow(t: Stressed) -> bool:
    return any(min(a) ** 2 < fmpq(2) ** t.fmt.emin for a in t.given("alpha"))


@flag("The roughnesses differ by up to a factor of 4: catches a mean alpha and swapped axes.")
def aniso_mild(t: Stressed) -> bool:
    return any(1 < max(a) / min(a) <= 4 for a in t.given("alpha"))


@flag("The roughnesses differ by a factor of 100 or more.")
def aniso_extreme(t: Stressed) -> bool:
    return any(max(a) >= 100 * min(a) for a in t.given("alpha"))


@flag("An earlier case with x and y exchanged: the result must not notice.")
def axes_swapped(t: Stressed) -> bool:
    return t.case.theme.get("_post") == "swap"


def slope_of_mean(A: Any) -> fmpq:
    """Squared length of the mean slope e."""
    a, b, c = transposed(A)
    return (dot(a, c) ** 2 + dot(b, c) ** 2) / dot(c, c) ** 2


def skews(t: Stressed) -> list[fmpq]:
    return [slope_of_mean(A) for A in t.given("A")] + [dot2(m) for m in t.given("mean")]


def dot2(m: Any) -> fmpq:
    return m[0] * m[0] + m[1] * m[1]


@flag("The mean slope is not 0: |A n| and the azimuth of the tilt matter.")
def skew(t: Stressed) -> bool:
    return any(fmpq(1, 10**4) < e <= 1 for e in skews(t))


@flag("A mean slope above 45 degrees.")
def strong_skew(t: Stressed) -> bool:
    return any(e > 1 for e in skews(t))


@flag("det A < 0: formulas want its absolute value.")
def negative_det(t: Stressed) -> bool:
    return any(determinant(A) < 0 for A in t.given("A"))


@flag("The shape matrix has a condition number above 1000 (Frobenius).")
def ill_conditioned_a(t: Stressed) -> bool:
    def frobenius(M: Any) -> fmpq:
        return sum((e * e for e in leaves(M)), fmpq(0))

    return any(frobenius(A) * frobenius(cofactor(A)) > 10**6 * determinant(A) ** 2 for A in t.given("A"))


def uniforms(t: Stressed) -> list[fmpq]:
    return list(leaves(t.given("u", "u3", "rows")))


@flag("A uniform number is exactly 0: the pole of the map, where square roots have no derivative.")
def u0(t: Stressed) -> bool:
    return any(u == 0 for u in uniforms(t))


@flag("A uniform number is the largest below 1, where 1 - u is one step of the dtype and tails reach farthest.")
def u_largest_below1(t: Stressed) -> bool:
    return any(u == 1 - fmpq(1, 1 << t.fmt.precision) for u in uniforms(t))


@flag("u[0] is 0, a quarter turn, or one step below 1: seams of the azimuth.")
def azimuth_seam(t: Stressed) -> bool:
    step = fmpq(1, 1 << t.fmt.precision)
    return any(u[0] * 4 == int(u[0] * 4) or u[0] == 1 - step for u in t.given("u", "u3"))


@flag("The micronormal is 10 or more standard radii down the lobe: the density's tail, not 0.")
def lobe_tail(t: Stressed) -> bool:
    pairs_ = pairs(t.given("wm"), t.given("alpha"))
    return any(m[2] > 0 and (m[0] / a[0]) ** 2 + (m[1] / a[1]) ** 2 >= 100 * m[2] ** 2 for m, a in pairs_)


def is_subnormal(x: fmpq | None, fmt: Format) -> bool:
    return x is not None and x != 0 and binade(x) < fmt.emin


@flag("An input is subnormal.")
def subnormal_in(t: Stressed) -> bool:
    return any(is_subnormal(x, t.fmt) for x in leaves(t.case.values))


@flag("A component of the exact result is below the dtype's normal range.")
def subnormal_out(t: Stressed) -> bool:
    return any(is_subnormal(x, t.fmt) for x in t.result)


@flag("A textbook intermediate (tan^4, 1/alpha^4 or det^3) overflows though the result does not.")
def intermediate_overflow(t: Stressed) -> bool:
    return not overflows(t) and any(x >= fmpq(2) ** (t.fmt.emax + 1) for x in intermediates(t))


@flag("A textbook intermediate (cos^4, alpha^4 or det^3) is below the normal range though the result is not.")
def intermediate_underflow(t: Stressed) -> bool:
    normal = not any(is_subnormal(x, t.fmt) for x in t.result)
    return normal and any(0 < x < fmpq(2) ** t.fmt.emin for x in intermediates(t))


def intermediates(t: Stressed) -> Iterator[fmpq]:
    for w in t.given("wi", "wo", "wm"):
        if w[2]:
            yield w[2] ** 4
            yield (planar(w) / w[2] ** 2) ** 2
    for a in t.given("alpha"):
        yield (a[0] * a[1]) ** 2
        yield 1 / (a[0] * a[1]) ** 2
    for A in t.given("A"):
        yield abs(determinant(A)) ** 3


def overflows(t: Stressed) -> bool:
    return any(x is None or abs(x) >= fmpq(2) ** (t.fmt.emax + 1) for x in t.result)


@flag("The exact result is too large for float16 (above 65504).")
def f16_overflow(t: Stressed) -> bool:
    return t.fmt.name == "f16" and overflows(t)


@flag("Flushing subnormals to zero changes the input or the result.")
def ftz_sensitive(t: Stressed) -> bool:
    return subnormal_in(t) or subnormal_out(t)


@flag("A component of the exact result is within 1/128 ulp of the middle between two numbers.")
def hard_to_round(t: Stressed) -> bool:
    def near_tie(x: fmpq) -> bool:
        steps = abs(x) / ulp(x, t.fmt)
        return 0 < abs(steps - int(steps) - fmpq(1, 2)) < fmpq(1, 128)

    return any(near_tie(x) for x in t.result if x and abs(x) < fmpq(2) ** (t.fmt.emax + 1))


@flag("The indices of refraction are nearly or exactly equal: eta² - 1 and the half vector vanish.")
def eta_near_one(t: Stressed) -> bool:
    eta = t.indices()
    return eta is not None and abs(eta - 1) < fmpq(1, 100)


@flag("Total internal reflection.")
def total_reflection(t: Stressed) -> bool:
    eta = t.indices()
    return eta is not None and any(eta * eta * (1 - c) > 1 for c in t.cosines())


@flag("Within 1 % of the critical angle (in cos² of refraction), where the derivative is infinite.")
def critical_angle(t: Stressed) -> bool:
    eta = t.indices()
    return eta is not None and any(abs(1 - eta * eta * (1 - c)) < fmpq(1, 100) for c in t.cosines())
