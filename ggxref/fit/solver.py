"""Minimise the likelihood of slopes with optimistix, in float64."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax import Array

from ggxref.fit.objectives import Loss
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
    """`theta`: (p,); `found`: whether the solver met its tolerance. With a leading axis for lanes."""

    theta: Array | np.ndarray
    found: Array | np.ndarray


@partial(jax.jit, static_argnames=("loss",))
def _losses(loss: Loss, theta: Array, samples: tuple[Array, ...]) -> Array:
    return jax.vmap(loss, (None, -1))(theta, samples)


def losses(loss: Loss, theta: np.ndarray, samples: tuple[Array, ...]) -> np.ndarray:
    """The loss of each sample, (n,); infinite where it is no number. The samples' arrays are components first, (..., n)."""
    found = np.asarray(_losses(loss, jnp.asarray(theta), samples))
    return np.where(np.isnan(found), np.inf, found)


@partial(jax.jit, static_argnames=("loss",))
def _solve(loss, samples, held, basis, start, weights):
    solver = optx.BFGS(rtol=TOLERANCE, atol=TOLERANCE)

    def theta(y):
        return held + basis @ y

    def mean(y, _):
        return jnp.sum(weights * jax.vmap(loss, (None, -1))(theta(y), samples)) / jnp.sum(weights)

    solution = optx.minimise(mean, solver, start, max_steps=MOST_STEPS, throw=False)
    return Minimum(theta(solution.value), solution.result == optx.RESULTS.successful)


def minimise(
    loss: Loss, samples: tuple[Array, ...], space: Space, starts: np.ndarray, weights: Sequence[np.ndarray]
) -> Minimum:
    """The minimum in `space` from each start, as NumPy arrays with a leading axis.

    - `samples`: arrays (..., n). `starts`: θ, (starts, p). `weights`: (n,) for each start.
    """
    held, basis = jnp.asarray(space.held), jnp.asarray(space.basis)
    # One after the other: under one `vmap` all would wait for the slowest, and compile three times as long.
    minima = [
        _solve(loss, samples, held, basis, jnp.asarray(space.coordinates(start)), jnp.asarray(each))
        for start, each in zip(starts, weights, strict=True)
    ]
    return jax.tree.map(lambda *parts: np.stack(parts), *minima)
