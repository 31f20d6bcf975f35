"""NaN in any number of an argument is NaN in the result: neither 0 nor another number that a renderer would take for one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from library import numbers, public
from points import FUNCTIONS

from ggxref import masking

# Their draws are arrays of pairs, until one is accepted.
REJECTION = ("sampling.lune.sample_rejection_sphere", "sampling.lune.sample_rejection_ellipsoid")
NAMES = [n for n in FUNCTIONS if n not in REJECTION]
# Of these a formula depends on the height alone.
HEIGHTS = (("ndf.hemisphere", "wm"), ("jacobian.slope", "wm"), ("bsdf.brdf", "wi"), ("bsdf.brdf", "wo"))
ABSENT = {(*place, k) for place in HEIGHTS for k in (0, 1)}
WI, WO, WM = [0.48, 0.36, 0.8], [-0.6, 0.0, 0.8], [0.0, 0.28, 0.96]
A = [[0.3, 0.1, 0.0], [0.0, 0.5, 0.0], [0.2, -0.1, 1.0]]
POINT = (
    dict.fromkeys(["w", "wi"], WI)
    | dict.fromkeys(["wm", "v"], WM)
    | dict.fromkeys(["A", "M"], A)
    | {
        "wo": WO,
        "alpha": [0.3, 0.5],
        "factors": [0.3, 0.5],
        "slope": [0.2, -0.1],
        "mean": [0.1, 0.2],
        "scatter": [[0.04, 0.01], [0.01, 0.09]],
        "angles": [0.1, 0.2, 0.3],
        "size": 0.5,
        "n_i": 1.0,
        "n_o": 1.5,
        "u": [0.3, 0.6],
        "gamma": 3.0,
        "eta": 0.7,
        "k": 2.0,
        "cos_i": 0.6,
        "f0": 0.04,
        "g1_i": 0.9,
        "g1_o": 0.8,
        "g2": 0.7,
        "D": 1.2,
        "G2": 0.8,
        "F": 0.3,
    }
)


# Draws that are not two numbers.
DRAWS = {"ellipsoid.lune_area": [0.0, 0.6, 0.8], "sampling.v_cavity.sample": [0.3, 0.6, 0.2]}


def lost(name, function) -> set[tuple[str, str, int]]:
    """The numbers, (function, argument, index), whose NaN does not reach the result."""
    point = POINT | {"u": DRAWS.get(name, POINT["u"])}
    inputs = {a: np.asarray(point[a], np.float32) for a in FUNCTIONS[name]}
    places = [(a, k) for a, x in inputs.items() for k in range(x.size)]
    rows = {a: np.stack([x] * (1 + len(places))) for a, x in inputs.items()}
    for row, (a, k) in enumerate(places, start=1):
        rows[a].reshape(len(places) + 1, -1)[row, k] = np.nan
    found = numbers(jax.jit(jax.vmap(lambda row: function(**row)))(rows))
    assert np.all(np.isfinite(found[0])) and np.any(found[0] != 0)  # else nothing depends on anything
    return {(name, a, k) for (a, k), result in zip(places, found[1:], strict=True) if not np.isnan(result).any()}


@pytest.mark.parametrize("name", NAMES)
def test_nan_stays(name):
    assert lost(name, public(name)) <= ABSENT


def test_nan_that_is_lost_is_found():
    def zero_behind(w, wm, alpha):
        return jnp.where(w @ wm > 0, masking.g1_ggx(w, w, alpha), 0)

    found = lost("masking.g1_ggx", zero_behind)
    assert {a for _, a, _ in found} == {"w", "wm"}


def test_a_steep_slope_has_a_normal():
    """Its square is beyond float32."""
    found = public("slopes.to_normal")(jnp.asarray([3e30, -4e30], jnp.float32))
    np.testing.assert_allclose(found, [-0.6, 0.8, 2e-31], rtol=1e-6)
