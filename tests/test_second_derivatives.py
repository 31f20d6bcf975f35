"""Second derivatives in float32 near normal incidence, near the nadir and for small alpha, where squares underflow: finite, and
float64's. `test_derivative_rules.py` has them where all is of the order of 1, from the oracle.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from library import hastily, public

RNG = np.random.default_rng(3)
U = RNG.uniform(0.1, 0.9, 2)
TILTS = [(tilt, sign) for tilt in (1e-6, 1e-12) for sign in (1, -1)]
ALPHAS = [(1e-4, 1e-4), (1e-4, 0.3), (1.0, 1.0)]
POINTS = [(tilt, sign, alpha) for tilt, sign in TILTS for alpha in ALPHAS]
# Beside the nadir of a smooth surface, where the crescent's own width is α² tilt², by alpha two digits are left.
EXACT = np.array([sign > 0 or tilt * max(alpha) > 1e-15 for tilt, sign, alpha in POINTS])
WEIGHTS = (0.3, -0.7, 1.1)
# Of the largest number of each block. Measured at most 5e-5, along the longer axis of an anisotropic surface.
LIMIT = 1e-3


def blocks(name, dtype):
    """Of a fixed combination of the sample's components: (points, in, in) for each two of the arguments."""
    wi = np.array([(tilt, 2 * tilt, sign) for tilt, sign, _ in POINTS], np.float32)
    shape = np.array([alpha for *_, alpha in POINTS], np.float32)
    if "lune" in name:
        shape = np.stack([np.diag([*alpha, 1]) for alpha in shape])
    args = [a.astype(np.float32).astype(dtype) for a in (np.tile(U, (len(wi), 1)), wi, shape)]

    def combined(u, wi, shape):
        return jnp.dot(public(name)(u, wi, shape), jnp.asarray(WEIGHTS, dtype))

    with jax.enable_x64(dtype == np.float64):
        second = hastily(jax.vmap(jax.hessian(combined, (0, 1, 2))), args)
        return [np.asarray(x, np.float64).reshape(len(wi), -1) for x in jax.tree.leaves(second)]


@pytest.mark.parametrize("name", ["sampling.cross_section.sample", "sampling.lune.sample"])
def test_finite_and_those_of_float64(name):
    for found, expected in zip(blocks(name, np.float32), blocks(name, np.float64), strict=True):
        assert np.isfinite(found).all()
        miss, size = np.abs(found - expected).max(1), np.abs(expected).max(1)
        assert np.all((miss <= LIMIT * size)[EXACT]), (miss / size)[EXACT].max()


SECOND_BY_WI = {
    name: jax.jit(jax.hessian(public(f"sampling.{name}.sample"), 1)) for name in ("cross_section", "lune")
}  # compiled once for all points


@pytest.mark.parametrize("name", SECOND_BY_WI)
@pytest.mark.parametrize("wi", [[0, 0, 1], [1e-6, 2e-6, 1], [1e-12, 2e-12, 1], [1e-6, 2e-6, -1]])
def test_second_derivatives_by_the_incident_direction_beside_the_end_of_u(name, wi):
    """Of a rule with a square as divisor the derivative has its square: (αx)⁴ is below float32's range, and 0/0 is NaN."""
    shape = [1e-4, 1e-4] if name == "cross_section" else np.diag([1e-4, 1e-4, 1])
    found = []
    for dtype in (np.float32, np.float64):
        with jax.enable_x64(True):
            args = [np.asarray(x, np.float32).astype(dtype) for x in ([1e-30, 0.3], wi, shape)]
            found.append(np.asarray(SECOND_BY_WI[name](*args), np.float64))
    single, exactly = found
    assert np.abs(single - exactly).max() <= 2e-6 * np.abs(exactly).max()


def test_second_derivatives_of_an_ellipsoid_cap_at_its_centre_are_finite():
    """The sum's distance from the axis is 3·10⁻¹⁶ there, whose cube is 0."""
    wi, A = jnp.asarray([1e-12, 2e-12, 1], jnp.float32), jnp.diag(jnp.asarray([1e-4, 1e-4, 1], jnp.float32))
    twice = jax.jacfwd(jax.jacrev(public("sampling.ellipsoid_cap.sample"), 1), 1)
    assert np.isfinite(jax.jit(twice)(jnp.zeros(2, jnp.float32), wi, A)).all()
