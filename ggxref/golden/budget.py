r"""How far a result may be off: the condition number, and the error in ulp that a careful implementation can keep.

- `condition` is $\max_i \sum_j |x_j\,\partial f_i/\partial x_j| / \max_i |f_i|$ over every number $x_j$ of the input: by what
  factor relative errors of the input grow, in the maximum norm of a vector. Each row of a matrix is a vector of its own;
  of several the largest counts. For an entry of an input matrix the largest entry of its row stands in place of $x_j$, as
  elimination and cross products mix a row's entries. It is 0 where f is infinite, or 0 in a neighbourhood.
- `ulp` = ⌈`base` + lengths + `condition`/2⌉, in units in the last place of the vector's largest component. `base` is the
  number of roundings of a good form (`catalogue`). `condition`/2 is the change that half an ulp of each input causes:
  the caller's own rounding leaves no better result to be asked for. "Lengths" is $4\sum |\,|\omega|-1|$ in ulp of 1, over the
  directions: an implementation may take them for unit, and the formulas hold up to fourth powers of them.
"""

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

from flint import arb

from ggxref.golden.cases import Case, leaves
from ggxref.golden.compare import vectors
from ggxref.golden.linear import dot
from ggxref.golden.rounding import Undecided, decimal, ends
from ggxref.oracle.precision import evaluate, working

# Relative step of the difference quotient: its own error is 2^-80 of a second derivative.
STEP = Fraction(1, 1 << 80)
# A smaller condition number is written as 0: the enclosure of a derivative that vanishes never proves that it does.
NEGLIGIBLE = Fraction(1, 1 << 20)

# Quantities that are matrices, not lists of vectors.
MATRICES = frozenset({"A", "scatter"})


def perturbed(x: Any, matrix: bool) -> Iterator[Any]:
    """The nested input with one of its numbers after the other changed by STEP times itself, in a matrix times its row."""
    if isinstance(x, Fraction):
        if x:
            yield x * (1 + STEP)
    elif matrix and isinstance(x[0], Fraction):
        step = STEP * max(map(abs, x))
        yield from ((*x[:i], x[i] + step, *x[i + 1 :]) for i in range(len(x)))
    else:
        for i, part in enumerate(x):
            yield from ((*x[:i], changed, *x[i + 1 :]) for changed in perturbed(part, matrix))


def condition(case: Case, bits: int = 256) -> Fraction:
    """The condition number of a case to three digits; `OverflowError` where f jumps."""
    inputs = case.values | case.function.options
    with working(bits):
        result = evaluate(case.function.name, inputs, bits)
        value = [*leaves(result)]
        if not all(f.is_finite() for f in value):
            return Fraction(0)
        changes = [arb(0)] * len(value)
        for argument, x in case.values.items():
            for y in perturbed(x, case.function.arguments[argument] in MATRICES):
                moved = leaves(evaluate(case.function.name, inputs | {argument: y}, bits))
                changes = [c + abs(m - f) for c, m, f in zip(changes, moved, value, strict=True)]
        each = iter(changes)
        ratios = [ratio([next(each) for _ in part], part) for part in vectors(result)]
    if all(r is not None for r in ratios):
        return max(ratios)  # pyright: ignore[reportArgumentType]
    if bits >= 4096:
        raise Undecided(f"no three digits of the condition number at {bits} bits")
    return condition(case, 2 * bits)


def ratio(changes: Sequence[arb], part: Sequence[arb]) -> Fraction | None:
    """Largest change over largest component, for a relative change of 1, to three digits; None if they are not proven."""
    (low, high), (size, size_high) = largest(changes), largest(part)
    # A zero has no relative change; where it is a minimum, such as F at equal indices, it has no first derivative either.
    if high <= NEGLIGIBLE * STEP * (size if size_high else 1):
        return Fraction(0)
    if size_high == 0:
        raise OverflowError("the result is 0 here and not 0 beside it")
    if size and decimal(low / STEP / size, 3) == (digits := decimal(high / STEP / size, 3)):
        return Fraction(digits)
    return None


def largest(balls: Sequence[arb]) -> tuple[Fraction, Fraction]:
    """Both ends of the largest magnitude."""
    magnitudes = [ends(abs(ball)) for ball in balls]
    return max(Fraction(0), *(low for low, _ in magnitudes)), max(high for _, high in magnitudes)


def allowance(case: Case, condition: Fraction) -> int:
    """The error in ulp that a careful implementation can keep."""
    # |w|² - 1 is twice |w| - 1.
    lengths = sum(abs(dot(w, w) - 1) * 2 for w in case.directions().values()) * (1 << (case.fmt.precision - 1))
    return math.ceil(case.function.base + lengths + condition / 2)
