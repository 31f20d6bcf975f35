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
from ggxref.fit.parameters import Space

MOST_STEPS = 256
TOLERANCE = 1e-6
"""Of a step in y, whose entries are of order 1; below it, the differences of a loss drown in rounding. What is left to the
minimum is checked against the standard errors."""


def float64():
    """Double precision within the block, whatever the caller's configuration."""
    # jax.experimental.enable_x64 became jax.enable_x64.
    return jax.enable_x64(True) if hasattr(jax, "enable_x64") else jax.experimental.enable_x64()


class Minimum(NamedTuple):
    """`theta`: (p,); `found`: whether the solver met its tolerance; `steps` it took. With a leading axis for lanes."""

    theta: Array | np.ndarray
    found: Array | np.ndarray
    steps: Array | np.ndarray


@partial(jax.jit, static_argnames=("objective",))
def terms(objective: Objective, theta: Array, samples: tuple[Array, ...]) -> Array:
    """(bands, n): the residuals, half of whose squares sum to the losses; without residuals the losses themselves, (n,).

    The samples' arrays are components first, (..., n).
    """
    return jax.vmap(objective.residual or objective.loss, (None, -1), -1)(theta, samples)


def losses(objective: Objective, theta: np.ndarray, samples: tuple[Array, ...]) -> np.ndarray:
    """The loss of each sample, (n,); infinite where it is no number."""
    found = np.asarray(terms(objective, jnp.asarray(theta), samples))
    loss = found if objective.residual is None else (found * found).sum(axis=0) / 2
    return np.where(np.isnan(loss), np.inf, loss)


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


def _likelihood(objective, theta, samples, start, weights):
    solver = optx.BFGS(rtol=TOLERANCE, atol=TOLERANCE)

    def mean(y, _):
        each = jax.vmap(objective.loss, (None, -1))(theta(y), samples)
        return jnp.sum(weights * each) / jnp.sum(weights)

    return optx.minimise(mean, solver, start, max_steps=MOST_STEPS, throw=False)


def _least_squares(objective, theta, samples, start, weights):
    solver = optx.LevenbergMarquardt(rtol=TOLERANCE, atol=TOLERANCE)
    roots = jnp.sqrt(weights / jnp.sum(weights))

    @_with_jacobian
    def residuals(y):
        return (jax.vmap(objective.residual, (None, -1), -1)(theta(y), samples) * roots).reshape(-1)

    return optx.least_squares(lambda y, _: residuals(y), solver, start, max_steps=MOST_STEPS, throw=False)


@partial(jax.jit, static_argnames=("objective",))
def _solve(objective, samples, held, basis, start, weights):
    def theta(y):
        # Row by row and not `basis @ y`, so that a held -inf (no diffuse term) meets no product.
        return held + jnp.sum(basis * y, axis=1)

    method = _likelihood if objective.residual is None else _least_squares
    solution = method(objective, theta, samples, start, weights)
    return Minimum(theta(solution.value), solution.result == optx.RESULTS.successful, solution.stats["num_steps"])


def minimise(
    objective: Objective, samples: tuple[Array, ...], space: Space, starts: np.ndarray, weights: Sequence[np.ndarray]
) -> Minimum:
    """The minimum in `space` from each start, as NumPy arrays with a leading axis.

    - `samples`: arrays (..., n). `starts`: θ, (starts, p). `weights`: (n,) for each start.
    """
    held, basis = jnp.asarray(space.held), jnp.asarray(space.basis)
    # One after the other: under one `vmap` all would wait for the slowest, and compile three times as long.
    minima = [
        _solve(objective, samples, held, basis, jnp.asarray(space.coordinates(start)), jnp.asarray(each))
        for start, each in zip(starts, weights, strict=True)
    ]
    return jax.tree.map(lambda *parts: np.stack(parts), *minima)
