r"""Standard errors of a minimum: the sandwich $H^{-1} M H^{-1}$ over blocks of samples that stand or fall together.

H is the Hessian of the summed loss, M the sum over blocks of the outer product of their gradients. Neighbouring slopes, and
residuals along one lobe, share their errors: over single samples the same formula would be some ten times too sure.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ggxref.fit.parameters import Space

SINGULAR = 1e-7
"""Smallest eigenvalue of H, over the largest, of a minimum that is a point and not a valley (H scaled to ones)."""
STEP = 1e-3
"""In y, whose entries are of order 1. Second differences of a loss then keep some seven digits; a standard error shows three."""


class Curvature(NamedTuple):
    """In the free y, of the summed losses: `hessian` (k, k), `scores`, each block's gradient (blocks, k), and where they are
    known the blocks' own Hessians, `parts` (blocks, k, k).
    """

    hessian: np.ndarray
    scores: np.ndarray
    parts: np.ndarray | None = None


def curvature(by_block: Callable[[np.ndarray], np.ndarray], theta: np.ndarray, space: Space) -> Curvature:
    """The curvature at θ, by central differences: compiled derivatives would take longer than all the fits.

    - `by_block(theta)`: (blocks,), the blocks' sums of the weighted losses.
    """
    if not space.size:
        return Curvature(np.zeros((0, 0)), np.zeros((len(by_block(theta)), 0)))
    steps = STEP * space.basis[:, space.columns].T
    middle = by_block(theta).sum()
    ahead, behind = (np.array([by_block(theta + sign * step) for step in steps]) for sign in (1, -1))
    hessian = np.diag(ahead.sum(axis=1) + behind.sum(axis=1) - 2 * middle) / STEP**2
    for i in range(len(steps)):
        for j in range(i):
            corners = [by_block(theta + a * steps[i] + b * steps[j]).sum() * a * b for a in (1, -1) for b in (1, -1)]
            hessian[i, j] = hessian[j, i] = sum(corners) / (4 * STEP**2)
    return Curvature(hessian, (ahead - behind).T / (2 * STEP))


class Spread(NamedTuple):
    """`covariance` and `correlation` of θ, (p, p); `newton`: the largest Newton step left, in standard errors.

    `valley`: (p,), of unit length in scaled θ: the direction in which the loss is flat; zeros where the minimum is a point.
    """

    covariance: np.ndarray
    newton: float
    valley: np.ndarray

    @property
    def correlation(self) -> np.ndarray:
        error = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(*[np.where(error > 0, error, 1.0)] * 2)


def spread(at: Curvature, space: Space) -> Spread:
    """The sandwich of one model; rows and columns of held parameters are 0."""
    if not space.size:
        return Spread(np.zeros_like(space.basis), 0.0, np.zeros(len(space.basis)))
    unit = np.sqrt(np.abs(np.diag(at.hessian)))
    units = np.outer(*[np.where(unit > 0, unit, 1.0)] * 2)
    eigenvalues, vectors = np.linalg.eigh(at.hessian / units)
    inverse = np.linalg.pinv(at.hessian / units, rcond=SINGULAR, hermitian=True) / units
    groups = np.count_nonzero(at.scores.any(axis=1))
    # The gradient at the minimum is 0, so that one block's score is minus the others': hence groups - 1.
    meat = at.scores.T @ at.scores * groups / max(groups - 1, 1)
    covariance = inverse @ meat @ inverse if at.parts is None else _jackknife(at, at.parts)
    errors = np.sqrt(np.diag(covariance))
    step = np.abs(inverse @ at.scores.sum(axis=0)) / np.where(errors > 0, errors, 1.0)
    columns = space.basis[:, space.columns]
    flat = eigenvalues[0] <= SINGULAR * eigenvalues[-1]
    valley = np.abs(columns) @ np.abs(vectors[:, 0]) if flat else np.zeros(len(columns))
    return Spread(columns @ covariance @ columns.T, float(step.max()), valley)


def _jackknife(at: Curvature, parts: np.ndarray) -> np.ndarray:
    """The sandwich whose scores are those of a fit without their own block: a block that pulls hard hides its own error.

    With θ₋ the minimum without a block, to one Newton step: Σ (θ₋ − θ)(θ₋ − θ)ᵀ (G − 1)/G over the G blocks.
    """
    moves = np.stack(
        [
            np.linalg.pinv(at.hessian - part, rcond=SINGULAR, hermitian=True) @ g
            for part, g in zip(parts, at.scores, strict=True)
        ]
    )
    return moves.T @ moves * (len(moves) - 1) / len(moves)
