"""Roots of increasing functions, enclosed by two proven signs."""

from collections.abc import Callable

from flint import arb, ctx

from ggxref.oracle.precision import Undecided, working

Function = Callable[[arb], arb]

GUARD = 32  # bits beyond the working precision, which the approximate root keeps


def _approximate(f: Function, slope: Function, low: arb, high: arb) -> arb:
    """A number near the root of the increasing f in [low, high]: Newton's steps, halving where one leaves the bracket."""
    bits = ctx.prec - GUARD
    x = ((low + high) / 2).mid()
    for _ in range(4 * ctx.prec):
        value, slant = f(x).mid(), slope(x).mid()
        low, high = (x, high) if value < 0 else (low, x)
        step = -value / slant if slant > 0 else high - low
        new = (x + step).mid()
        if not low < new < high:
            new = ((low + high) / 2).mid()
        if abs(new - x) <= abs(x) * arb(2) ** (-bits):
            return new
        x = new
    raise Undecided(f"no root found between {low.str(5)} and {high.str(5)} at {ctx.prec} bits")


def increasing_root(f: Function, slope: Function, low: arb, high: arb) -> arb:
    """Enclosure of the root of f, which is increasing on [low, high]; `slope` is its derivative.

    The ends of the enclosure, f < 0 at the lower and f > 0 at the upper, are proven by f's balls there; the way to the
    root is not. Where f itself is a wide ball, the enclosure is as wide as that makes it.
    """
    with working(2 * ctx.prec + GUARD):
        x = _approximate(f, slope, low, high)
    with working(2 * ctx.prec + GUARD):
        radius = (high - low if x == 0 else abs(x)) * arb(2) ** (-(ctx.prec // 2))
        while radius < high - low:
            below, above = (x - radius).max(low).lower(), (x + radius).min(high).upper()
            if (below <= low or f(below) < 0) and (above >= high or f(above) > 0):
                return below.union(above)
            radius = 8 * radius
    raise Undecided(f"no root of proven signs near {x.str(5)} at {ctx.prec} bits")
