"""Every public function against the oracle at random points, in float64 and as compiled.

`experiments/library_against_oracle.py` is the same at 10⁴ points a function.
"""

import library
import numpy as np
import points
import pytest
from exact import error

from ggxref import ndf
from ggxref.oracle.precision import lookup, raised

# The contract: 1e-13 times the condition number, where that exceeds 1.
LIMIT = 1e-13
POINTS = 24


def worst(name, function):
    inputs = points.points(name, POINTS, seed=2)
    got = library.numbers(library.over_rows(function, inputs))

    def true(point):
        return raised(lambda: lookup(name)(**point), 256, name, point)

    rows = ({argument: x[k] for argument, x in inputs.items()} for k in range(POINTS))
    errors = [error(true, point, row, np.finfo(float), LIMIT) for point, row in zip(rows, got.tolist(), strict=True)]
    return max(e.over_condition for e in errors)


@pytest.mark.parametrize("name", points.FUNCTIONS)
def test_agrees_with_the_oracle(name):
    assert worst(name, library.public(name)) <= LIMIT


def test_a_wrong_formula_does_not_agree():
    assert worst("ndf.ggx", lambda wm, alpha: ndf.ggx(wm, alpha) * (1 + 1e-12)) > LIMIT
