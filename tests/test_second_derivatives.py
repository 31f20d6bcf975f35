"""Second derivatives in float32 near normal incidence, near the nadir and for small alpha, where squares underflow: finite, and
float64's. `test_derivative_rules.py` has them where all is of the order of 1, from the oracle.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from library import public

RNG = np.random.default_rng(3)
U = RNG.uniform(0.1, 0.9, 2)
TILTS = [(tilt, sign) for tilt in (1e-6, 1e-12) for sign in (1, -1)]
ALPHAS = [(1e-4, 1e-4), (1e-4, 0.3), (1.0, 1.0)]
# Beside the nadir of a smooth surface the crescent's own width, α² tilt², leaves the range.
POINTS = [(tilt, sign, alpha) for tilt, sign in TILTS for alpha in ALPHAS if sign > 0 or tilt * max(alpha) > 1e-15]
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
        second = jax.jit(jax.vmap(jax.hessian(combined, (0, 1, 2))))(*args)
        return [np.asarray(x, np.float64).reshape(len(wi), -1) for x in jax.tree.leaves(second)]


@pytest.mark.parametrize("name", ["sampling.cross_section.sample", "sampling.lune.sample"])
def test_finite_and_those_of_float64(name):
    for found, expected in zip(blocks(name, np.float32), blocks(name, np.float64), strict=True):
        assert np.isfinite(found).all()
        miss, size = np.abs(found - expected).max(1), np.abs(expected).max(1)
        assert np.all(miss <= LIMIT * size), (miss / size).max()
