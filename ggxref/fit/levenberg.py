"""Levenberg–Marquardt for many problems at once, in NumPy: the matrices are 12 by 12, and what costs is elsewhere.

Each lane has its own θ, space and damping; a step evaluates the lanes that are not done, all in one go.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

FIRST_DAMPING = 1e-3
LAST_DAMPING = 1e12
LONGEST = 2.0
"""Of an entry of a step in y, whose entries are of order 1: a factor of e² in a roughness."""
ACCEPT = 1e-4
"""Share of the predicted descent that a step must bring."""
NEGLIGIBLE = 1e-15
"""Predicted descent of a loss of order 1 that rounding hides."""


class Terms(NamedTuple):
    """Of each lane, in θ: the mean loss (l,), its gradient (l, p), and a positive matrix like its Hessian, (l, p, p)."""

    loss: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray


class Minima(NamedTuple):
    """`theta` (l, p), `loss` (l,), and whether the tolerance was met (l,)."""

    theta: np.ndarray
    loss: np.ndarray
    met: np.ndarray


Evaluate = Callable[[np.ndarray, np.ndarray], Terms]


def minimise(
    evaluate: Evaluate, theta: np.ndarray, bases: np.ndarray, samples: np.ndarray, *, settled: float, most: int
) -> Minima:
    """The minimum of each lane, from `theta` (l, p) along `bases` (l, p, p), whose unused columns are 0.

    - `evaluate(theta, lanes)`: the terms of these lanes at these θ. `samples`: (l,), how many each lane's mean is over.
    - `settled`: a lane is done when its next step is this many standard errors long, were its samples independent.
    """
    theta = theta.copy()
    met = np.zeros(len(theta), bool)
    damping, growth = np.full(len(theta), FIRST_DAMPING), np.full(len(theta), 2.0)
    loss, gradient, hessian = (part.copy() for part in _reduced(evaluate(theta, np.arange(len(theta))), bases))
    active = np.isfinite(loss)
    for _ in range(most):
        left = np.array([_descent(h, g) for h, g in zip(hessian, gradient, strict=True)])
        met |= active & (left <= settled**2 * loss / samples + NEGLIGIBLE)
        active &= ~met & (damping < LAST_DAMPING)
        lanes = np.flatnonzero(active)
        if not len(lanes):
            break
        step = np.stack([_step(hessian[k], gradient[k], damping[k]) for k in lanes])
        predicted = -np.einsum("li,li->l", step, gradient[lanes] + np.einsum("lij,lj->li", hessian[lanes], step) / 2)
        there = theta[lanes] + np.einsum("lpi,li->lp", bases[lanes], step)
        trial = _reduced(evaluate(there, lanes), bases[lanes])
        gain = (loss[lanes] - trial.loss) / np.maximum(predicted, 1e-300)
        better = np.isfinite(trial.loss) & (gain > ACCEPT)
        taken = lanes[better]
        theta[taken], loss[taken] = there[better], trial.loss[better]
        gradient[taken], hessian[taken] = trial.gradient[better], trial.hessian[better]
        # Nielsen's rule: less damping the better the quadratic model foretold the descent, and quickly more where it failed.
        damping[taken] *= np.maximum(1 / 10, 1 - (2 * np.minimum(gain[better], 1) - 1) ** 3)
        growth[taken] = 2.0
        refused = lanes[~better]
        damping[refused] *= growth[refused]
        growth[refused] *= 2
        # A step that brings nothing although almost nothing was foretold: the bottom, as far as rounding shows it.
        met[refused] |= predicted[~better] <= NEGLIGIBLE * np.maximum(loss[refused], 1)
    return Minima(theta, loss, met)


def _reduced(terms: Terms, bases: np.ndarray) -> Terms:
    """In y; an unused column gets a 1 on the diagonal, which leaves its step 0."""
    hessian = np.einsum("lpi,lpq,lqj->lij", bases, terms.hessian, bases)
    unused = ~bases.any(axis=1)
    lane, column = np.nonzero(unused)
    hessian[lane, column, column] = 1.0
    loss = np.where(np.isfinite(terms.loss) & np.isfinite(hessian).all(axis=(1, 2)), terms.loss, np.inf)
    return Terms(loss, np.einsum("lpi,lp->li", bases, terms.gradient), hessian)


def _scale(hessian: np.ndarray) -> np.ndarray:
    """The roots of the diagonal; a direction that changes nothing gets a small one, so that it is not followed."""
    diagonal = np.diag(hessian)
    return np.sqrt(np.maximum(diagonal, 1e-12 * max(diagonal.max(), 1e-300)))


def _step(hessian: np.ndarray, gradient: np.ndarray, damping: float) -> np.ndarray:
    unit = _scale(hessian)
    scaled = hessian / np.outer(unit, unit) + damping * np.eye(len(unit))
    step = -np.linalg.lstsq(scaled, gradient / unit, rcond=1e-14)[0] / unit
    return step * min(1.0, LONGEST / max(np.abs(step).max(), 1e-300))


def _descent(hessian: np.ndarray, gradient: np.ndarray) -> float:
    """What the undamped step would bring, gᵀH⁻¹g/2; along valleys, where it cannot be told, nothing."""
    if not np.isfinite(hessian).all():
        return np.inf
    unit = _scale(hessian)
    inverse = np.linalg.pinv(hessian / np.outer(unit, unit), rcond=1e-9, hermitian=True)
    scaled = gradient / unit
    return float(scaled @ inverse @ scaled) / 2
