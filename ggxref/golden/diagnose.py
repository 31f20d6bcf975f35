"""Which mistake explains the wrong answers: the mutant whose results they are."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flint import arb, fmpq

from ggxref.golden.cases import leaves, mapped
from ggxref.golden.compare import distance
from ggxref.golden.mistakes import MUTANTS
from ggxref.golden.mutants import Mutant
from ggxref.golden.reading import Test
from ggxref.golden.rounding import decode, encode, ends
from ggxref.golden.verdict import Verdict, judge

# Enough to tell the mutants apart, few enough to answer at once.
MOST_FAILURES, MOST_PASSES = 40, 20
# Of so many failures a mutant must explain so many to be looked at closely.
FIRST_LOOK, LEAST_FIRST = 8, 2
# A mutant is named if it explains at least this share of the failures and of its own.
LEAST_SHARE = fmpq(1, 2)


@dataclass(frozen=True)
class Diagnosis:
    """`explained` of the `failures` that were looked at are the mutant's own wrong results."""

    function: str
    mutant: Mutant
    explained: int
    failures: int


def prediction(mutant: Mutant, test: Test) -> Any:
    """The mutant's answer to a test as bits; None where it has none."""
    try:
        values = {a: mapped(lambda b: decode(b, test.fmt), x) for a, x in test.inputs.items()}
        result = mutant.answer(test.function, values)
        return None if result is None else mapped(lambda ball: rounded(ball, test), result)
    except (ArithmeticError, ValueError):
        return None


def rounded(ball: arb, test: Test) -> int:
    """The middle of the ball, rounded: a mutant needs no proof."""
    if ball == arb.pos_inf():
        return test.fmt.infinity
    return encode(sum(ends(ball), fmpq(0)) / 2, test.fmt)


def alike(got: Any, predicted: Any, test: Test) -> bool:
    """Whether an answer is a prediction, within twice the error that the right answer is allowed."""
    assert test.result is not None
    error = distance(got, predicted, test.fmt)
    return error is not None and error <= 2 * test.result.ulp


def spread_out(verdicts: Sequence[Verdict], most: int) -> list[Verdict]:
    """At most so many of them, evenly."""
    step = max(1, -(-len(verdicts) // most))
    return list(verdicts[::step])


def share(mutant: Mutant, wrong: Sequence[Verdict], right: Sequence[Verdict]) -> tuple[fmpq, int]:
    """How well the mutant explains the verdicts: explained failures over those and what it explains wrongly."""
    explained = against = 0
    for v in wrong:
        predicted = prediction(mutant, v.test)
        # A mutant that is right here explains nothing.
        if predicted is not None and v.got is not None and alike(v.got, predicted, v.test):
            explained += not judge(v.test, predicted).passed
    if explained:
        for v in right:
            predicted = prediction(mutant, v.test)
            against += predicted is not None and not judge(v.test, predicted).passed
    return fmpq(explained, len(wrong) + against), explained


def diagnose(verdicts: Sequence[Verdict]) -> Diagnosis | None:
    """The best explanation of one function's failures, if any is good."""
    valid = [v for v in verdicts if v.test.result and not v.test.outcomes and measurable(v)]
    wrong = spread_out([v for v in valid if not v.passed and v.got is not None], MOST_FAILURES)
    right = spread_out([v for v in valid if v.passed], MOST_PASSES)
    if not wrong:
        return None
    first = spread_out(wrong, FIRST_LOOK)
    likely = [m for m in MUTANTS if share(m, first, [])[1] >= min(LEAST_FIRST, len(first))]
    # Of equals the first: `max` keeps it.
    scores = [(*share(m, wrong, right), m) for m in likely]
    best, explained, mutant = max(scores, key=lambda s: s[:2], default=(fmpq(0), 0, None))
    if mutant is None or best < LEAST_SHARE:
        return None
    return Diagnosis(verdicts[0].test.function.id, mutant, explained, len(wrong))


def measurable(v: Verdict) -> bool:
    """Whether all inputs are finite."""
    return all(b & (v.test.fmt.sign - 1) < v.test.fmt.infinity for b in leaves(v.test.inputs))
