"""Minimise an objective with optimistix: many starts of many models in one compiled call, in float64."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax import Array

from ggxref.fit.objectives import Objective

MOST_STEPS = 256
TOLERANCE = 1e-6
"""Of a quasi-Newton step in y, whose entries are of order 1. Below it, differences of the loss drown in rounding."""
LEAST_SQUARES_TOLERANCE = 1e-9
"""Levenberg–Marquardt steps come from a QR of the Jacobian, not from differences of the loss."""


def float64():
    """Double precision within the block, whatever the caller's configuration."""
    # jax.experimental.enable_x64 became jax.enable_x64.
    return jax.enable_x64(True) if hasattr(jax, "enable_x64") else jax.experimental.enable_x64()


class Minimum(NamedTuple):
    """`theta`: (p,); `found`: whether the solver met its tolerance; `steps` it took. With a leading axis for lanes."""

    theta: Array | np.ndarray
    found: Array | np.ndarray
    steps: Array | np.ndarray


def losses(objective: Objective, theta: Array, samples: tuple[Array, ...]) -> Array:
    """The loss of each sample, (n,). The samples' arrays are components first, (..., n)."""
    return jax.vmap(objective.loss, (None, -1))(theta, samples)


def _mean(objective, theta, samples, weights):
    return jnp.sum(weights * losses(objective, theta, samples)) / jnp.sum(weights)


mean_loss = jax.jit(_mean, static_argnames=("objective",))
"""`mean_loss(objective, theta, samples, weights)`: the weighted mean of the losses."""


def _with_jacobian(residuals):
    """`residuals` with a derivative that is one matrix.

    The solver keeps the derivative of its best point: the plain linearisation holds every intermediate array of it.
    """
    wrapped = jax.custom_jvp(residuals)

    @wrapped.defjvp
    def _(primals, tangents):
        def twice(y):
            r = residuals(y)
            return r, r

        jacobian, r = jax.jacfwd(twice, has_aux=True)(*primals)
        return r, jacobian @ tangents[0]

    return wrapped


def _solve(objective, samples, held, basis, start, weights):
    def theta(y):
        # Row by row and not `basis @ y`, so that a held -inf (no diffuse term) meets no product.
        return held + jnp.sum(basis * y, axis=1)

    solution = (_likelihood if objective.residual is None else _least_squares)(
        objective, theta, samples, start, weights
    )
    return Minimum(theta(solution.value), solution.result == optx.RESULTS.successful, solution.stats["num_steps"])


def _likelihood(objective, theta, samples, start, weights):
    solver = optx.BFGS(rtol=TOLERANCE, atol=TOLERANCE)

    def mean(y, _):
        return _mean(objective, theta(y), samples, weights)

    return optx.minimise(mean, solver, start, max_steps=MOST_STEPS, throw=False)


def _least_squares(objective, theta, samples, start, weights):
    solver = optx.LevenbergMarquardt(rtol=LEAST_SQUARES_TOLERANCE, atol=LEAST_SQUARES_TOLERANCE)
    roots = jnp.sqrt(weights / jnp.sum(weights))

    @_with_jacobian
    def residuals(y):
        return (jax.vmap(objective.residual, (None, -1), -1)(theta(y), samples) * roots).reshape(-1)

    return optx.least_squares(lambda y, _: residuals(y), solver, start, max_steps=MOST_STEPS, throw=False)


LANES = 8
"""Lanes a call. A fixed number, so that one compilation serves starts, folds and any number of models."""


@partial(jax.jit, static_argnames=("objective",))
def _minimise(objective, samples, held, basis, start, weights):
    # One lane after the other: lanes side by side would wait for the slowest, and compile three times as long.
    return jax.lax.map(lambda lane: _solve(objective, samples, *lane), (held, basis, start, weights))


def minimise(
    objective: Objective,
    samples: tuple[Array, ...],
    held: np.ndarray,
    basis: np.ndarray,
    start: np.ndarray,
    weights: Sequence[np.ndarray],
) -> Minimum:
    """The minimum of each lane, as NumPy arrays (lanes, ...).

    - `samples`: arrays (..., n), shared by all lanes. `held`: (lanes, p); `basis`: (lanes, p, p); `start`: y, (lanes, p).
    - `weights`: (n,) for each lane.
    """
    chunks = []
    for first in range(0, len(held), LANES):
        # The last chunk is filled up with its last lane.
        rows = np.minimum(np.arange(first, first + LANES), len(held) - 1)
        lanes = (jnp.asarray(array[rows]) for array in (held, basis, start))
        minima = _minimise(objective, samples, *lanes, jnp.asarray(np.stack([weights[row] for row in rows])))
        chunks.append(jax.tree.map(np.asarray, minima))
    return jax.tree.map(lambda *parts: np.concatenate(parts)[: len(held)], *chunks)
