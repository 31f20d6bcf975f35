"""The distance between an answer and the exact result, in units in the last place."""

from collections.abc import Iterator
from typing import Any

from flint import fmpq

from ggxref.golden.rounding import Format, decode, is_nan, ulp


def vectors(x: Any) -> Iterator[tuple[Any, ...]]:
    """The parts of a result that are measured each in its own norm: a number, a vector, each row of a matrix."""
    if not isinstance(x, tuple):
        yield (x,)
    elif any(isinstance(part, tuple) for part in x):
        for part in x:
            yield from vectors(part)
    else:
        yield x


def value(bits: int, fmt: Format) -> fmpq:
    """The number of the bits; infinity counts as the power of two where overflow starts."""
    magnitude = bits & (fmt.sign - 1)
    if magnitude == fmt.infinity:
        return fmpq(2) ** (fmt.emax + 1) * (-1 if bits & fmt.sign else 1)
    return decode(bits, fmt)


def distance(got: Any, expected: Any, fmt: Format) -> fmpq | None:
    """The largest difference of bits nested alike, in ulp of the largest component of its vector; None for a NaN.

    +0 and -0 are equal.
    """
    worst = fmpq(0)
    for answer, right in zip(vectors(got), vectors(expected), strict=True):
        if any(is_nan(bits, fmt) for bits in answer):
            return None
        exact = [value(bits, fmt) for bits in right]
        unit = ulp(max(map(abs, exact)), fmt)
        differences = (abs(value(bits, fmt) - x) for bits, x in zip(answer, exact, strict=True))
        worst = max(worst, max(differences) / unit)
    return worst
