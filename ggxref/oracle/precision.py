"""Working precision, exact inputs, decided signs, and proven digits."""

import importlib
import math
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from typing import Any

from flint import arb, ctx, fmpq, fmpz

# Bits in which polynomials of a few inputs of any binary format come out without rounding: a product of eight f64 spans
# at most 8 * 2098 bits, and a short product costs no more at this precision than at a low one.
EXACT_BITS = 1 << 15

# Where `evaluate` and `digits` give up. Beyond it the quantity asked for almost surely sits exactly on a decision.
MAX_BITS = 1 << 14


class Undecided(ArithmeticError):
    """A branch depends on a ball that straddles its threshold: the working precision is too low."""


class working:
    """Context in which balls carry `bits` bits."""

    def __init__(self, bits: int):
        self.bits = bits

    def __enter__(self) -> None:
        self.outer = ctx.prec
        ctx.prec = self.bits

    def __exit__(self, *exception: object) -> None:
        ctx.prec = self.outer


def exactly() -> working:
    """Context for sums and products of exact inputs, which it does not round (no quotient or root belongs in it)."""
    return working(EXACT_BITS)


def exact(x: Any) -> Any:
    """The number `x` as a ball of radius 0; of a nested sequence, nested tuples; of a word (an option), itself.

    A rational that is not dyadic has no exact ball: it becomes an enclosure at the working precision.
    """
    if isinstance(x, str | arb):
        return x
    if isinstance(x, fmpq):
        return arb(x.p) / arb(x.q)
    if isinstance(x, tuple):  # before the general test, which is slow
        return tuple([exact(part) for part in x])
    if hasattr(x, "tolist"):  # NumPy scalars and arrays
        # bfloat16 and its kin give themselves back from `tolist`, but are exact as a float.
        plain = x.tolist()
        return exact(plain if plain is not x and type(plain) is not type(x) else float(x))
    if isinstance(x, Iterable):
        return tuple(exact(part) for part in x)
    if isinstance(x, Fraction):
        return arb(x.numerator) / x.denominator
    if isinstance(x, int | fmpz):
        return arb(x)
    if isinstance(x, float):
        if not math.isfinite(x):
            raise ValueError(f"the oracle takes finite numbers, got {x}")
        return arb(x)
    raise TypeError(f"no exact conversion from {type(x).__name__}: {x!r}")


def sign(x: arb) -> int:
    """-1, 0 or 1, proven; 0 only for the exact zero."""
    if x > 0:
        return 1
    if x < 0:
        return -1
    if x == 0:
        return 0
    raise Undecided(f"the sign of {x.str(5)} at {ctx.prec} bits")


def root(x: arb) -> arb:
    """Square root of a quantity known to be >= 0, whose ball may reach below 0 by rounding."""
    if x >= 0:
        return x.sqrt()
    if x < 0 or not x.is_finite():
        raise Undecided(f"the square root of {x.str(5)} at {ctx.prec} bits")
    return arb(0).union(x.upper().sqrt())


def at_least_zero(x: arb) -> arb:
    """max(x, 0)."""
    return x.max(arb(0))


def lookup(name: str) -> Callable[..., Any]:
    """The oracle's function of a dotted name such as "sampling.spherical_cap.sample"."""
    module, _, function = name.rpartition(".")
    try:
        return getattr(importlib.import_module(f"ggxref.oracle.{module}"), function)
    except (ImportError, AttributeError, ValueError) as error:
        raise ValueError(f"the oracle has no function {name!r}") from error


def raised(attempt: Callable[[], Any], bits: int, name: str, inputs: Mapping[str, Any]) -> Any:
    """`attempt()` at the first precision from `bits` on, doubling, at which it is decided; else an error that says which."""
    while bits <= MAX_BITS:
        try:
            with working(bits):
                return attempt()
        except Undecided as error:
            reason, bits = error, 2 * bits
    raise ArithmeticError(f"{name}({inputs}): undecided at {MAX_BITS} bits: {reason}")


def evaluate(name: str, inputs: Mapping[str, Any], bits: int) -> Any:
    """`name(**inputs)` on exactly converted inputs: a ball, or nested tuples of balls, at `bits` bits.

    Precision is raised where a branch asks for it, so that the result may carry more bits than `bits`.
    """
    if bits > MAX_BITS:
        raise ValueError(f"at most {MAX_BITS} bits, got {bits}")
    function = lookup(name)
    return raised(lambda: function(**{key: exact(value) for key, value in inputs.items()}), bits, name, inputs)


def digits(name: str, inputs: Mapping[str, Any], n: int) -> Any:
    """`name(**inputs)` as decimals of `n` significant digits, each proven to be the exact result rounded to nearest.

    A string such as "-1.2345e-7", "0" or "inf", or nested tuples of them.
    """
    function = lookup(name)

    def attempt() -> Any:
        return decimal(function(**{key: exact(value) for key, value in inputs.items()}), n)

    return raised(attempt, 64 + 4 * n, name, inputs)


def decimal(x: Any, n: int) -> Any:
    """The ball `x` (or each one of nested tuples) rounded to `n` significant digits, if its ends agree on them."""
    if isinstance(x, tuple):
        return tuple(decimal(part, n) for part in x)
    if x == 0:
        return "0"
    if x == arb.pos_inf() or x == arb.neg_inf():
        return "inf" if x > 0 else "-inf"
    if not x.is_finite():
        raise Undecided(f"{x.str(5)} at {ctx.prec} bits is no number")
    # The guard digits keep the decimal radius above the ball's own, whose conversion rounds outwards.
    mid, radius, exponent = (int(part) for part in x.mid_rad_10exp(n + 20))
    ends = {_rounded(mid + shift, exponent, n) for shift in (-radius, radius)}
    if len(ends) > 1 or "0" in ends:
        raise Undecided(f"digit {n} of {x.str(n + 5)} at {ctx.prec} bits")
    return ends.pop()


def _rounded(mantissa: int, exponent: int, n: int) -> str:
    """mantissa * 10^exponent to `n` significant digits, ties to even."""
    if mantissa == 0:
        return "0"
    size = abs(mantissa)
    drop = len(str(size)) - n
    if drop > 0:
        quotient, rest = divmod(size, 10**drop)
        half = 5 * 10 ** (drop - 1)
        size = quotient + (rest > half or (rest == half and quotient % 2 == 1))
        exponent += drop
    text = str(size)
    exponent += len(text) - 1
    text = text[:n].ljust(n, "0")
    point = "." if n > 1 else ""
    return f"{'-' if mantissa < 0 else ''}{text[0]}{point}{text[1:]}e{exponent:+d}"
