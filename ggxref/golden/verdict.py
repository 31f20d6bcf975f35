"""The verdict on one answer to one test."""

from dataclasses import dataclass
from typing import Any

from flint import fmpq

from ggxref.golden.cases import leaves, mapped
from ggxref.golden.compare import distance, value
from ggxref.golden.linear import dot
from ggxref.golden.reading import Test
from ggxref.golden.rounding import F16, Format, decode, encode, is_nan

# A flushed intermediate may lose a result that is so many binades above the smallest normal number.
FLUSH_MARGIN = 8


@dataclass(frozen=True)
class Verdict:
    """`error` in ulp of the exact result's largest component; None where there is no number to measure."""

    test: Test
    got: Any
    error: fmpq | None
    passed: bool
    # What the pass rests on, or what is wrong that no number tells.
    remark: str = ""


@dataclass(frozen=True)
class Failure:
    """An answer that is no result: a refusal, or nothing."""

    reason: str


def judge(test: Test, answer: Any, strict: bool = False) -> Verdict:
    """The verdict on bits nested as the result (or a `Failure`). `strict`: subnormals must not be flushed."""
    if isinstance(answer, Failure):
        return Verdict(test, None, None, "error" in test.outcomes, answer.reason)
    answer = tangential(test, answer)
    result, fmt = test.result, test.fmt
    if test.outcomes:
        outcome = outcome_of(test, answer)
        return Verdict(test, answer, None, outcome in test.outcomes, outcome)
    assert result is not None
    error = distance(answer, result.expected, fmt)
    if error is not None and error <= result.ulp:
        return Verdict(test, answer, error, True)
    if error is not None and not strict and fmt is not F16:
        for right in (result.expected, result.flushed):
            other = distance(unflushed(answer, right, fmt), right, fmt)
            if other is not None and other <= result.ulp:
                return Verdict(test, answer, other, True, "flushed")
    return Verdict(test, answer, error, False, "NaN" if error is None else "")


def unflushed(answer: Any, right: Any, fmt: Format) -> Any:
    """The answer with its zeros replaced by the right number where that is small enough to have been flushed."""
    if isinstance(answer, tuple):
        return tuple(unflushed(a, r, fmt) for a, r in zip(answer, right, strict=True))
    small = abs(value(right, fmt)) < fmpq(2) ** (fmt.emin + FLUSH_MARGIN)
    return right if small and answer in (0, fmt.sign) else answer


def outcome_of(test: Test, answer: Any) -> str:
    """What became of a broken input."""
    bits, fmt = [*leaves(answer)], test.fmt
    if any(is_nan(b, fmt) for b in bits):
        return "nan"
    if all(b in (0, fmt.sign) for b in bits):
        return "zero"
    if test.result and matches_but_for_signs(answer, test.result.expected, fmt, test.result.ulp):
        return "value"
    return "inf" if any(b & (fmt.sign - 1) == fmt.infinity for b in bits) else "another value"


def matches_but_for_signs(answer: Any, right: Any, fmt: Format, limit: int) -> bool:
    got, wanted = (mapped(lambda b: b & (fmt.sign - 1), x) for x in (answer, right))
    error = distance(got, wanted, fmt)
    return error is not None and error <= limit


def tangential(test: Test, answer: Any) -> Any:
    """Of a gradient with respect to a direction, the part in the direction's tangent plane; other answers as they are."""
    fmt, argument = test.fmt, test.function.derivative
    if not argument or test.function.arguments[argument] != "wm" or len(answer) != 4:
        return answer
    x, y, _ = test.inputs[argument]
    if {x, y} <= {0, fmt.sign} and not is_nan(answer[3], fmt):
        # At the normal that part is z alone, and may be beyond the dtype.
        return (*answer[:3], 0)
    if any(b & (fmt.sign - 1) >= fmt.infinity for b in (*answer, *test.inputs[argument])):
        return answer
    m, g = ((decode(x, fmt), decode(y, fmt), decode(z, fmt)) for x, y, z in (test.inputs[argument], answer[1:]))
    along = dot(g, m) / dot(m, m)
    # Rounded to the dtype again, which is less than the answer's own rounding.
    return (answer[0], *(encode(a - along * b, fmt) for a, b in zip(g, m, strict=True)))
