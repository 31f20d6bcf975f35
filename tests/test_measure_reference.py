"""Properties: double-double keeps 30 digits; each reference agrees with the oracle on every region; a wrong one does not."""

from fractions import Fraction

import numpy as np
import pytest

from ggxref.measure import doubledouble as dd
from ggxref.measure.accuracy import arguments, exact
from ggxref.measure.reference import REFERENCES
from ggxref.measure.regions import REGIONS, rounded
from ggxref.measure.tables import DRAWS, library
from ggxref.oracle import precision

# An ulp of float64 is 1e-16. Measured worst 1.1e-21 (the skewed densities, whose matrix products cancel).
TOLERANCE = 1e-19
POINTS = 6


def _points(name, region):
    drawn = rounded(REGIONS[region](np.random.default_rng(7), POINTS), np.float32)
    return {
        a: drawn[d] for a, d in zip(arguments(library(name)), DRAWS.get(name, arguments(library(name))), strict=True)
    }


def _oracle(name, points, k) -> np.ndarray:
    """The oracle's digits as a double-double, a row a component: (components, 2)."""
    for bits in (200, 800, 3200):
        value = precision.evaluate(name, {a: v[..., k] for a, v in points.items()}, bits)
        parts = value if isinstance(value, tuple) else (value,)
        if all(part == 0 or part.rel_accuracy_bits() > 110 for part in parts):
            break
    rows = []
    for part in parts:
        if not part.is_finite():
            rows.append((float(part.mid()), 0.0))
            continue
        hi = float(part.mid())
        rows.append((hi, float((part - hi).mid())))
    return np.array(rows)


def _distance(reference, name, region) -> float:
    """Largest error over the points, relative to the value's size (a direction's is 1)."""
    points = _points(name, region)
    value = exact(reference, list(points.values()))
    hi, lo = np.atleast_2d(value.hi), np.atleast_2d(value.lo)
    worst = 0.0
    for k in range(POINTS):
        truth = _oracle(name, points, k)
        size = np.abs(truth[:, 0]).max()
        if 1e-270 < size < 1e300:
            difference = (hi[:, k] - truth[:, 0]) + (lo[:, k] - truth[:, 1])
            worst = max(worst, float(np.abs(difference).max() / size))
        elif size <= 1e-270:  # below it the low part is subnormal
            assert (np.abs(hi[:, k]) < 2e-270).all()
    return worst


@pytest.mark.parametrize("name", REFERENCES)
def test_reference_agrees_with_the_oracle(name):
    for region in REGIONS:
        assert _distance(REFERENCES[name], name, region) < TOLERANCE, region


def test_agreement_can_fail():
    """float64 arithmetic alone, or a factor of 1 + 1e-18, must miss the tolerance."""

    def shifted(wm, alpha):
        return REFERENCES["ndf.ggx"](wm, alpha) * dd.constant(1 + Fraction(1, 10**18))

    assert _distance(shifted, "ndf.ggx", "typical") > TOLERANCE


def _fraction(x, k):
    return Fraction(float(x.hi[k])) + Fraction(float(x.lo[k]))


def test_arithmetic_keeps_thirty_digits():
    rng = np.random.default_rng(3)
    a = dd.DD(rng.normal(size=50), rng.normal(size=50) * 1e-17)
    b = dd.DD(rng.normal(size=50), rng.normal(size=50) * 1e-17)
    root = dd.sqrt(a * a)
    total, product, quotient = a + b, a * b, a / b
    for k in range(50):
        x, y = _fraction(a, k), _fraction(b, k)
        assert abs(_fraction(total, k) - (x + y)) <= abs(x + y) * Fraction(1, 10**30) + Fraction(1, 10**32)
        assert abs(_fraction(product, k) / (x * y) - 1) < Fraction(1, 10**30)
        assert abs(_fraction(quotient, k) * y / x - 1) < Fraction(1, 10**30)
        assert abs(_fraction(root, k) / abs(x) - 1) < Fraction(1, 10**30)


def test_exponential_and_logarithm_are_inverse_to_thirty_digits():
    x = dd.DD(np.geomspace(1e-3, 1e3, 40), np.zeros(40))
    back = dd.exp(dd.log(x)) / x - 1.0
    assert np.abs(back.hi).max() < 1e-29


def test_turn_is_on_the_circle_and_exact_at_the_quarters():
    u = np.concatenate([np.random.default_rng(4).random(100), [0, 0.25, 0.5, 0.75]])
    c, s = dd.cos_sin_turn(u)
    assert np.abs((c * c + s * s - 1.0).hi).max() < 1e-30
    assert c.hi[-4:].tolist() == [1, 0, -1, 0] and s.hi[-4:].tolist() == [0, 1, 0, -1]
