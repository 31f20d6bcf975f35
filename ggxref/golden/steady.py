"""Whether a result survives the rounding of its inputs: a test beside a jump would grade luck."""

from collections.abc import Mapping
from typing import Any

from flint import fmpq

from ggxref.golden.cases import Case, leaves, mapped
from ggxref.golden.compare import vectors
from ggxref.golden.exact import evaluate
from ggxref.golden.rounding import Format, dyadic, spacing, ulp
from ggxref.golden.stream import Stream
from ggxref.oracle.precision import exact, working

TRIALS = 6
BITS = 128
# How many budgets a change of one ulp of every input may move the result; the budget holds the linear part once.
SLACK = 4
# Largest value of the quantities that have one.
LIMITS: Mapping[str, int] = dict.fromkeys(("cos_i", "f0", "g1_i", "g1_o", "G2", "F", "u", "u3", "rows"), 1)


def nudged(s: Stream, fmt: Format, limit: int | None, x: fmpq) -> fmpq:
    """The number one ulp up or down, within its range."""
    y = x + s.sign() * ulp(x, fmt) if x else x
    return x if limit is not None and abs(y) >= limit else y


def moved_inputs(case: Case, s: Stream) -> dict[str, Any]:
    limits = {a: LIMITS.get(q) for a, q in case.function.arguments.items()}
    return {a: mapped(lambda x, a=a: nudged(s, case.fmt, limits[a], x), values) for a, values in case.values.items()}


def steady(case: Case, budget: int) -> bool:
    """Whether one ulp up or down in every input, at random, leaves the result within a few budgets.

    Exact zeros stay, as do numbers at the end of their range: a test of the horizon itself is meant.
    """
    with working(BITS):
        result = evaluate(case.function, case.values, BITS)
        for trial in range(TRIALS):
            s = Stream("steady", case.function.id, case.fmt.name, trial, *leaves(case.bits))
            moved = evaluate(case.function, moved_inputs(case, s), BITS)
            if not near(moved, result, case.fmt, SLACK * budget):
                return False
    return True


def near(got: Any, result: Any, fmt: Format, limit: int) -> bool:
    """Whether all components are within so many ulp of the largest of their vector."""
    for parts, rights in zip(vectors(got), vectors(result), strict=True):
        if not all(ball.is_finite() for ball in (*parts, *rights)):
            return all(str(a) == str(b) for a, b in zip(parts, rights, strict=True))
        largest = max(abs(ball).mid() for ball in rights)
        # A result that overflows must be as steady as another.
        far = exact(limit * spacing(dyadic(largest), fmt))
        if any(abs(a - b).mid() > far for a, b in zip(parts, rights, strict=True)):
            return False
    return True
