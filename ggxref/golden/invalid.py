"""Tests of broken inputs: no result is right, and an implementation may choose from a few outcomes.

- `error`: it refuses (an exception, no answer); `nan`: a NaN in the result; `zero`: all components 0; `inf`: an infinity;
- `value`: the formula carried on beyond its domain, within `ulp` of `expected` but for signs. A negative roughness passes
  through most formulas as its square, through some as a factor.
"""

from typing import Any

from ggxref.golden.cases import Case, leaves
from ggxref.golden.exact import evaluate

# What was done to the input -> the flag.
FLAGS = {"negative alpha": "InvalidAlpha", "zero alpha": "InvalidAlpha", "nan": "NotANumber"}
SENTENCES = {
    "InvalidAlpha": "A roughness is negative or zero. The test lists the acceptable outcomes.",
    "NotANumber": "An input is NaN: it must show in the result, or be refused. The test lists the acceptable outcomes.",
}
# A delta in one axis may be infinite; a NaN must not turn into a plausible number.
OUTCOMES = {
    "negative alpha": ("error", "nan", "zero"),
    "zero alpha": ("error", "nan", "zero", "inf"),
    "nan": ("error", "nan", "zero"),
}
ALL_OUTCOMES = ("error", "nan", "zero", "inf", "value")


def broken(case: Case) -> str:
    """What was done to the input of a case, or nothing."""
    post = case.theme.get("_post", "")
    return post if post in FLAGS else ""


def continues(case: Case) -> bool:
    """Whether the formula still has a value."""
    if None in leaves(case.values):
        return False
    try:
        return all(ball.is_finite() for ball in leaves(evaluate(case.function, case.values, 64)))
    except (ArithmeticError, ValueError):
        return False


def outcomes(what: str, valued: bool) -> dict[str, Any]:
    """The part of a test's record that only a broken input has."""
    return {"outcomes": [*OUTCOMES[what], *(["value"] if valued else [])]}
