r"""Standard errors of a minimum: the sandwich $H^{-1} M H^{-1}$ over blocks of samples that stand or fall together.

H is the Hessian of the summed loss, M the sum over blocks of the outer product of their gradients. Neighbouring slopes, and
residuals along one lobe, share their errors: over single samples the same formula would be some ten times too sure.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ggxref.fit.models import Space
from ggxref.fit.problem import Problem
from ggxref.fit.solver import losses

SINGULAR = 1e-7
"""Smallest eigenvalue of H, over the largest, of a minimum that is a point and not a valley (H scaled to ones)."""


class Curvature(NamedTuple):
    """In y, of the sum of the weighted losses: `hessian` (p, p), and `scores`, each block's gradient (blocks, p)."""

    hessian: np.ndarray
    scores: np.ndarray


STEP = 1e-4
"""In y, whose entries are of order 1: differences of gradients keep some eight digits, and a standard error shows three."""


@partial(jax.jit, static_argnames=("objective", "blocks"))
def _scores(objective, samples, weights, block, theta, basis, *, blocks):
    def by_block(y):
        each = weights * losses(objective, theta + jnp.sum(basis * y, axis=1), samples)
        return jax.ops.segment_sum(each, block, blocks)

    return jax.jacfwd(by_block)(jnp.zeros_like(theta))


def curvature(problem: Problem, samples: tuple[Array, ...], theta: np.ndarray, space: Space) -> Curvature:
    """The curvature at θ. Second derivatives are differences of first ones: compiling theirs would take longest of all."""
    weights, block = jnp.asarray(problem.weights), jnp.asarray(problem.block)
    blocks = int(problem.block.max()) + 1

    def scores(theta):
        return np.asarray(
            _scores(
                problem.objective, samples, weights, block, jnp.asarray(theta), jnp.asarray(space.basis), blocks=blocks
            )
        )

    hessian = np.zeros_like(space.basis)
    for column in space.columns:
        step = STEP * space.basis[:, column]
        hessian[column] = (scores(theta + step).sum(axis=0) - scores(theta - step).sum(axis=0)) / (2 * STEP)
    return Curvature((hessian + hessian.T) / 2, scores(theta))


class Spread(NamedTuple):
    """`covariance` of θ, (p, p); `newton`: the largest Newton step left, in standard errors; `point`: is H regular?"""

    covariance: np.ndarray
    newton: float
    point: bool


def spread(at: Curvature, basis: np.ndarray) -> Spread:
    """The sandwich of one model, from `Curvature` in its basis; rows and columns of held parameters are 0."""
    free = basis.any(axis=0)
    hessian = at.hessian[np.ix_(free, free)]
    scores = at.scores[:, free]
    gradient = scores.sum(axis=0)
    if not free.any():
        return Spread(np.zeros_like(basis), 0.0, True)
    unit = np.sqrt(np.abs(np.diag(hessian)))
    unit = np.where(unit > 0, unit, 1.0)
    eigenvalues = np.linalg.eigvalsh(hessian / np.outer(unit, unit))
    inverse = np.linalg.pinv(hessian / np.outer(unit, unit), rcond=SINGULAR, hermitian=True) / np.outer(unit, unit)
    groups = len(np.unique(np.flatnonzero(scores.any(axis=1))))
    # The gradient at the minimum is 0, so that one block's score is minus the others': hence groups - 1.
    meat = scores.T @ scores * groups / max(groups - 1, 1)
    y_covariance = inverse @ meat @ inverse
    errors = np.sqrt(np.diag(y_covariance))
    step = np.abs(inverse @ gradient) / np.where(errors > 0, errors, 1.0)
    columns = basis[:, free]
    return Spread(
        columns @ y_covariance @ columns.T, float(step.max()), bool(eigenvalues[0] > SINGULAR * eigenvalues[-1])
    )
