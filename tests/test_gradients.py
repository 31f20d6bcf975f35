"""Derivatives against difference quotients of the oracle, in float64: one written by hand, or stopped in a wrong place, would
still be finite.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from exact import BITS, STEP, leaves, moved
from flint import arb
from library import gradient, numbers, over_rows, public
from points import FUNCTIONS, points

from ggxref.oracle.precision import exact, lookup, raised

DIRECTIONS = {"w", "wi", "wi_up", "wi_seeing", "wo", "wm", "wm_up", "wm_A"}
# Error over the sum of the terms of the derivative, each term's condition left out. Measured worst over 25 points a
# function: 1.3e-11, of the caps where the half vector cancels.
LIMIT = 1e-9
# Where the terms are this much larger than the value, they have lost too many digits to tell.
HARD = 1e4


def change(rng: np.random.Generator, quantity: str, x: np.ndarray) -> np.ndarray:
    """A way to move: a direction in its tangent plane (the oracle normalises, the library does not), the rest in proportion."""
    if quantity in DIRECTIONS:
        return np.cross(x, rng.normal(size=3))
    factors = rng.uniform(-1, 1, x.shape)
    return x * (factors + factors.T if quantity == "scatter" else factors)


def smooth(name: str, quantity: str, x: np.ndarray) -> bool:
    """Away from kinks and jumps: the horizon, numbers that are 0, azimuths at the pole and where G1 reaches 1 there, equal
    singular values.
    """
    if quantity in DIRECTIONS:
        polar = "sample" in name or name.endswith("g1_ellipsoid")
        return x[2] != 0 and not (polar and abs(x[2]) == 1)
    if quantity == "A" and "ellipsoid_bounded" in name:
        x = np.linalg.qr(x[:, [2, 0, 1]])[1][1:, 1:]  # the C of the canonical form, turned
    if quantity == "A" and ("ellipsoid_bounded" in name or "rejection_sphere" in name):
        *_, above, least = np.linalg.svd(x, compute_uv=False)
        return above > 1.001 * least
    return not (quantity in ("u", "u3", "rows", "cos_i") and np.any(x == 0))


def quotient(name: str, inputs, changes) -> tuple[float, float]:
    """Of the combination of `library.gradient`: its central difference, and its value."""
    function = lookup(name)

    def combined(sign):
        there = {a: moved(exact(x), exact(changes[a]), sign * STEP) for a, x in inputs.items()}
        result = function(**there)
        parts = result if name.endswith("to_slopes") else (result,)
        if "rejection" in name:
            parts = result[:1]  # the other counts the tries
        return sum((arb(k) * v for part in parts for k, v in enumerate(leaves(part), start=1)), arb(0))

    def both():
        return float(((combined(1) - combined(-1)) / (2 * STEP)).mid()), float(combined(0).mid())

    return raised(both, BITS, name, inputs)


def errors(function, name: str, count: int) -> list[float]:
    """Relative errors of the derivative of `function`, which stands for the public one, at random smooth points."""
    quantities, inputs = FUNCTIONS[name], points(name, count, seed=5)
    slopes = over_rows(gradient(function), inputs)
    rng = np.random.default_rng(6)
    found = []
    for i in range(count):
        row = {a: x[i] for a, x in inputs.items()}
        changes = {a: change(rng, quantities[a], x) for a, x in row.items()}
        if not all(smooth(name, quantities[a], x) for a, x in row.items()):
            continue
        exact_slope, value = quotient(name, row, changes)
        terms = np.concatenate([np.ravel(slopes[a][i] * changes[a]) for a in row])
        size = np.sum(np.abs(terms)) + abs(value)
        if 1e-290 < size < HARD * abs(value):
            found.append(abs(np.sum(terms) - exact_slope) / size)
    return found


@pytest.mark.parametrize("name", FUNCTIONS)
def test_gradient(name):
    found = errors(public(name), name, 60 if any(rare in name for rare in ("pdf", "rejection_sphere")) else 20)
    assert len(found) > 5
    assert max(found) <= LIMIT


def test_a_lost_term_is_caught():
    """A square root whose derivative is stopped too early: the value stays right."""

    def frozen(w, alpha):
        x, y, z = w
        s = jax.lax.stop_gradient(jnp.hypot(alpha[0] * x, alpha[1] * y))
        return s * s / (2 * jnp.abs(z) * (jnp.abs(z) + jnp.hypot(s, z)))

    name = "masking.lambda_ggx"
    inputs = points(name, 25, seed=5)
    keep = inputs["w"][:, 2] != 0
    a, b = (numbers(over_rows(f, inputs))[keep] for f in (frozen, public(name)))
    np.testing.assert_allclose(a, b, rtol=1e-12)
    assert max(errors(frozen, name, 25)) > LIMIT
