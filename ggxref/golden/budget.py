r"""How far a result may be off: the condition number, and the error in ulp that a careful implementation can keep.

- `condition` is $\max_i \sum_j |x_j\,\partial f_i/\partial x_j| / \max_i |f_i|$ over every number $x_j$ of the input: by what
  factor relative errors of the input grow, in the maximum norm of a vector. Each row of a matrix is a vector of its own;
  of several the largest counts. For an entry of an input matrix the largest entry of its row stands in place of $x_j$, as
  elimination and cross products mix a row's entries. It is 0 where f is infinite, or 0 in a neighbourhood.
- `spread` is $\max_i \sum_j |\frac12\mathrm{ulp}(x_j)\,\partial f_i/\partial x_j|$ in ulp of the vector's largest component: what
  half an ulp of every input does to the result, so what the caller's own rounding has done already.
- `ulp` = ⌈`base` + `condition` + (4 + `condition`) L⌉, in ulp of the vector's largest component. `base` is the number of
  roundings of a good form (`catalogue`). A relative error of one ulp in every input is allowed: half for the rounding
  before the function, half for the function's own first steps. $L = \sum |\,|\omega|-1|$ over the directions, in ulp of 1: an
  implementation may take them for unit. Formulas hold up to fourth powers of the lengths, and where directions cancel,
  a wrong length does what a wrong component does.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from flint import arb, fmpq

from ggxref.golden.cases import Case, leaves
from ggxref.golden.compare import vectors
from ggxref.golden.exact import evaluate
from ggxref.golden.linear import ONE, dot
from ggxref.golden.rounding import Format, Undecided, decimal, ends, rational, ulp
from ggxref.oracle.precision import exact, working

# Relative step of the difference quotient: its own error is 2^-80 of a second derivative.
STEP = fmpq(1, 1 << 80)
# A smaller condition number is written as 0: the enclosure of a derivative that vanishes never proves that it does.
NEGLIGIBLE = fmpq(1, 1 << 20)
MOST_BITS = 4096
# Quantities that are matrices, not lists of vectors.
MATRICES = frozenset({"A", "scatter"})


@dataclass(frozen=True)
class Sensitivity:
    """`condition` and `spread` of a result, to three digits."""

    condition: fmpq
    spread: fmpq


def perturbed(x: Any, matrix: bool, row: fmpq = ONE) -> Iterator[tuple[Any, fmpq, fmpq]]:
    """The nested input with one of its numbers after the other changed by STEP times itself, in a matrix times its row;
    beside it the number, and the change over STEP."""
    if isinstance(x, fmpq):
        size = row if matrix else abs(x)
        if size:
            yield x + STEP * size, x, size
        return
    if matrix and isinstance(x[0], fmpq):
        row = max(map(abs, x))
    for i, part in enumerate(x):
        yield from ((((*x[:i], y, *x[i + 1 :])), number, size) for y, number, size in perturbed(part, matrix, row))


def sensitivity(case: Case, bits: int = 256) -> Sensitivity:
    """Condition number and spread of a case; `OverflowError` where f jumps."""
    with working(bits):
        given = {argument: exact(x) for argument, x in case.values.items()}
        result = evaluate(case.function, given, bits)
        value = [*leaves(result)]
        if not all(f.is_finite() for f in value):
            return Sensitivity(fmpq(0), fmpq(0))
        relative, absolute = [arb(0)] * len(value), [arb(0)] * len(value)
        for argument, x in case.values.items():
            for y, number, size in perturbed(x, case.function.arguments[argument] in MATRICES):
                moved = leaves(evaluate(case.function, given | {argument: y}, bits))
                changes = [abs(m - f) for m, f in zip(moved, value, strict=True)]
                half = exact(ulp(number, case.fmt) / size / 2 if number else fmpq(0))
                relative = [r + c for r, c in zip(relative, changes, strict=True)]
                absolute = [a + c * half for a, c in zip(absolute, changes, strict=True)]
        shares = iter(zip(relative, absolute, strict=True))
        found = [measured(part, [next(shares) for _ in part], case.fmt) for part in vectors(result)]
    if None not in found:
        return Sensitivity(*(max(column) for column in zip(*found, strict=True)))  # pyright: ignore[reportArgumentType]
    if bits >= MOST_BITS:
        raise Undecided(f"no three digits of the condition number at {bits} bits")
    return sensitivity(case, 2 * bits)


def measured(part: Sequence[arb], changes: Sequence[Any], fmt: Format) -> tuple[fmpq, fmpq] | None:
    """Condition number and spread of one vector from both changes of each component; None without three proven digits."""
    relative, absolute = zip(*changes, strict=True)
    (low, high), (size, size_high) = largest(relative), largest(part)
    # A zero has no relative change; where it is a minimum, as F at equal indices, it has no first derivative either.
    if high <= NEGLIGIBLE * STEP * (size if size_high else 1):
        return fmpq(0), fmpq(0)
    if size_high == 0:
        raise OverflowError("the result is 0 here and not 0 beside it")
    if not size:
        return None
    condition = three_digits(low / size, high / size)
    spread = three_digits(*(end / ulp(size, fmt) for end in largest(absolute)))
    return None if condition is None or spread is None else (condition, spread)


def three_digits(low: fmpq, high: fmpq) -> fmpq | None:
    """A difference over STEP that lies between these; None if three digits are not proven."""
    digits = decimal(low / STEP, 3)
    return rational(digits) if digits == decimal(high / STEP, 3) else None


def largest(balls: Sequence[arb]) -> tuple[fmpq, fmpq]:
    """Both ends of the largest magnitude."""
    magnitudes = [ends(abs(ball)) for ball in balls]
    return max(fmpq(0), *(low for low, _ in magnitudes)), max(high for _, high in magnitudes)


def allowance(case: Case, condition: fmpq) -> int:
    """The error in ulp that a careful implementation can keep."""
    # |w|² - 1 is twice |w| - 1.
    lengths = (
        sum((abs(dot(w, w) - 1) for w in case.directions().values()), fmpq(0)) / 2 * (1 << (case.fmt.precision - 1))
    )
    return int((case.function.base + condition + (4 + condition) * lengths).ceil())
