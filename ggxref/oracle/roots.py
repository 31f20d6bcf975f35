"""Roots of increasing functions, enclosed by two proven signs."""

from collections.abc import Callable

from flint import arb, ctx

from ggxref.oracle.precision import working

Function = Callable[[arb], arb]

COARSE_BITS = 64  # the precision of the way to the root's neighbourhood


def _approximate(f: Function, slope: Function, low: arb, high: arb, x: arb, bits: int) -> arb:
    """A number within about 2^-bits of the root of f in [low, high], relatively; no proof.

    Newton's steps from x on, halving the bracket where one leaves it. A step of 2^-(bits/2) is the last: it leaves an
    error of about its square.
    """
    small = arb(2) ** -(bits // 2)
    for _ in range(4 * ctx.prec):
        value, slant = f(x).mid(), slope(x).mid()
        step = -value / slant if slant > 0 else high - low
        new = (x + step).mid()
        if abs(step) <= abs(x) * small:
            return new
        low, high = (x, high) if value < 0 else (low, x)
        x = new if low < new < high else ((low + high) / 2).mid()
    return x


def increasing_root(f: Function, slope: Function, low: arb, high: arb) -> arb:
    """Enclosure of the root that f, increasing, is known to have in [low, high]; `slope` is its derivative.

    The ends of the enclosure, f < 0 at the lower and f > 0 at the upper, are proven by f's balls there; the way to the
    root is not. Where f itself is a wide ball, the enclosure is as wide as that makes it, at most the bracket.
    """
    bits, x = ctx.prec, ((low + high) / 2).mid()
    with working(COARSE_BITS):
        x = _approximate(f, slope, low, high, x, COARSE_BITS)
    with working(2 * bits):  # room for what f loses by cancellation
        x = _approximate(f, slope, low, high, x, bits)
        radius = (high - low if x == 0 else abs(x)) * arb(2) ** -bits
        while radius < high - low:
            below, above = (x - radius).max(low).lower(), (x + radius).min(high).upper()
            if (below <= low or f(below) < 0) and (above >= high or f(above) > 0):
                return below.union(above)
            radius = 8 * radius
    return low.union(high)
