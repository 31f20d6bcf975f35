"""One test: the exact result of a case from the oracle, with every rounding proven."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from flint import arb, fmpq

from ggxref.golden import invalid
from ggxref.golden.budget import allowance, sensitivity
from ggxref.golden.cases import Case, leaves, mapped
from ggxref.golden.catalogue import Function
from ggxref.golden.exact import evaluate
from ggxref.golden.flags import flags_of, is_subnormal
from ggxref.golden.linear import determinant
from ggxref.golden.rounding import DIGITS, F16, Format, Undecided, decimal_ball, ends, round_ball, to_float, to_hex
from ggxref.golden.steady import steady
from ggxref.golden.stressed import Stressed
from ggxref.oracle.precision import MAX_BITS, working

# 40 digits are 133 bits: nearly every case is decided at once.
FIRST_BITS = 192


@dataclass(frozen=True)
class Exact:
    """Result of a case: `expected` bits, `digits`, and `values` (None: infinite), nested as the function returns it."""

    expected: Any
    digits: Any
    values: tuple[fmpq | None, ...]


def proven(function: Function, inputs: dict[str, Any], fmt: Format) -> Exact:
    """The result at the first precision that proves all of its roundings; `Undecided` if none does."""
    bits = FIRST_BITS
    while True:
        try:
            with working(bits):
                result = evaluate(function, inputs, bits)
                return Exact(
                    mapped(lambda ball: bits_of(ball, fmt), result), mapped(digits_of, result), values_of(result)
                )
        except Undecided:
            if bits == MAX_BITS:
                raise
            bits = min(2 * bits, MAX_BITS)


def bits_of(ball: arb, fmt: Format) -> int:
    return fmt.infinity | (fmt.sign if ball < 0 else 0) if is_infinite(ball) else round_ball(ball, fmt)


def digits_of(ball: arb) -> str:
    return ("-inf" if ball < 0 else "inf") if is_infinite(ball) else decimal_ball(ball, DIGITS)


def is_infinite(ball: arb) -> bool:
    """Whether the result is proven infinite: Λ at the horizon."""
    return ball == arb.pos_inf() or ball == arb.neg_inf()


def values_of(result: Any) -> tuple[fmpq | None, ...]:
    return tuple(None if is_infinite(ball) else sum(ends(ball), fmpq(0)) / 2 for ball in leaves(result))


def flushed(case: Case) -> Exact | None:
    """The result where the hardware takes subnormal inputs for zeros; None if there are none."""
    # float16 is never flushed: its subnormals are part of its use.
    if case.fmt is F16 or not any(is_subnormal(x, case.fmt) for x in leaves(case.values)):
        return None
    zeros = mapped_values(lambda x: fmpq(0) if is_subnormal(x, case.fmt) else x, case.values)
    return proven(case.function, zeros, case.fmt)


def test(case: Case) -> dict[str, Any] | None:
    """The test's record but for its id; None where it has no proven or no useful result."""
    broken = invalid.broken(case)
    valued = not broken or invalid.continues(case)
    result = solved(case) if valued else None
    if valued and not result:
        return None
    flags = [invalid.FLAGS[broken]] if broken else []
    record = {"flags": flags, "inputs": mapped_values(lambda b: to_hex(b, case.fmt), case.bits)}
    return record | (invalid.outcomes(broken, valued) if broken else {}) | (result or {})


def solved(case: Case) -> dict[str, Any] | None:
    """Flags, result and budget of a case."""
    fmt = case.fmt
    try:
        if any(determinant(A) == 0 for A in case.quantity("A")):
            return None  # singular only once it was rounded
        exact, other = proven(case.function, case.values, fmt), flushed(case)
        if untold(case, exact):
            return None
        found = sensitivity(case)
        ulp = allowance(case, found.condition)
        if found.condition and ulp > 1 << (fmt.precision - 2):
            # The inputs' own rounding moves the result by a quarter of itself: nothing is tested.
            return None
        if not steady(case, ulp):
            return None
    except (ArithmeticError, ValueError):
        # A result exactly on a decision (a tie, a jump), beyond every dtype, or outside the function's domain.
        return None
    flags = {} if invalid.broken(case) else {"flags": flags_of(Stressed(case, exact.values))}
    record = flags | {
        "exact": exact.digits,
        "expected": mapped(lambda b: to_hex(b, fmt), exact.expected),
        "condition": to_float(found.condition),
        "spread": to_float(found.spread),
        "ulp": ulp,
    }
    if other and other.expected != exact.expected:
        record["flushed"] = mapped(lambda b: to_hex(b, fmt), other.expected)
    return record


def untold(case: Case, exact: Exact) -> bool:
    """Whether the result is a gradient in a tangent plane that overflows: nobody can project infinities on it."""
    of, fmt = case.function.derivative, case.fmt
    infinite = any(bits & (fmt.sign - 1) == fmt.infinity for bits in leaves(exact.expected))
    return bool(of) and case.function.arguments[of] == "wm" and infinite


def mapped_values(f: Callable[[Any], Any], inputs: dict[str, Any]) -> dict[str, Any]:
    return {argument: mapped(f, x) for argument, x in inputs.items()}
