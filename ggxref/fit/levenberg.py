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
    evaluate: Evaluate,
    theta: np.ndarray,
    bases: np.ndarray,
    samples: np.ndarray,
    *,
    settled: float,
    most: int,
    instead: np.ndarray | None = None,
) -> Minima:
    """The minimum of each lane, from `theta` (l, p) along `bases` (l, p, p), whose unused columns are 0.

    - `evaluate(theta, lanes)`: the terms of these lanes at these θ. `samples`: (l,), how many each lane's mean is over.
    - `settled`: a lane is done when its next step is this many standard errors long, were its samples independent.
    - `instead`: (l, p), where a lane begins if its loss there is less.
    """
    theta, begun = _begun(evaluate, bases, theta, instead)
    met = np.zeros(len(theta), bool)
    damping, growth = np.full(len(theta), FIRST_DAMPING), np.full(len(theta), 2.0)
    loss, gradient, hessian = (part.copy() for part in begun)
    active = np.isfinite(loss)
    valley = _Quadratic(*(part.copy() for part in _quadratic(hessian, gradient)))
    for _ in range(most):
        met |= active & (valley.descent() <= settled**2 * loss / samples + NEGLIGIBLE)
        active &= ~met & (damping < LAST_DAMPING)
        lanes = np.flatnonzero(active)
        if not len(lanes):
            break
        step = _Quadratic(*(part[lanes] for part in valley)).step(damping[lanes])
        predicted = -np.einsum("li,li->l", step, gradient[lanes] + np.einsum("lij,lj->li", hessian[lanes], step) / 2)
        there = theta[lanes] + np.einsum("lpi,li->lp", bases[lanes], step)
        trial = _reduced(evaluate(there, lanes), bases[lanes])
        gain = (loss[lanes] - trial.loss) / np.maximum(predicted, 1e-300)
        better = np.isfinite(trial.loss) & (gain > ACCEPT)
        taken = lanes[better]
        theta[taken], loss[taken] = there[better], trial.loss[better]
        gradient[taken], hessian[taken] = trial.gradient[better], trial.hessian[better]
        for part, new in zip(valley, _quadratic(hessian[taken], gradient[taken]), strict=True):
            part[taken] = new
        # Nielsen's rule: less damping the better the quadratic model foretold the descent, and quickly more where it failed.
        damping[taken] *= np.maximum(1 / 10, 1 - (2 * np.minimum(gain[better], 1) - 1) ** 3)
        growth[taken] = 2.0
        refused = lanes[~better]
        damping[refused] *= growth[refused]
        growth[refused] *= 2
        # A step that brings nothing although almost nothing was foretold: the bottom, as far as rounding shows it.
        met[refused] |= predicted[~better] <= NEGLIGIBLE * np.maximum(loss[refused], 1)
    return Minima(theta, loss, met)


def _begun(
    evaluate: Evaluate, bases: np.ndarray, theta: np.ndarray, instead: np.ndarray | None
) -> tuple[np.ndarray, Terms]:
    """Each lane's start and the terms there: θ, or what is lower."""
    everyone = np.arange(len(theta))
    terms = _reduced(evaluate(theta, everyone), bases)
    if instead is None:
        return theta.copy(), terms
    other = _reduced(evaluate(instead, everyone), bases)
    lower = np.flatnonzero(other.loss < terms.loss)
    theta, terms = theta.copy(), Terms(*(part.copy() for part in terms))
    for part, better in zip((theta, *terms), (instead, *other), strict=True):
        part[lower] = better[lower]
    return theta, terms


def _reduced(terms: Terms, bases: np.ndarray) -> Terms:
    """In y; an unused column gets a 1 on the diagonal, which leaves its step 0."""
    sound = (
        np.isfinite(terms.loss) & np.isfinite(terms.hessian).all(axis=(1, 2)) & np.isfinite(terms.gradient).all(axis=1)
    )
    gradient, hessian = (
        np.where(sound.reshape(-1, *[1] * (a.ndim - 1)), a, 0) for a in (terms.gradient, terms.hessian)
    )
    hessian = bases.swapaxes(1, 2) @ hessian @ bases
    lane, column = np.nonzero(~bases.any(axis=1))
    hessian[lane, column, column] = 1.0
    return Terms(np.where(sound, terms.loss, np.inf), np.einsum("lpi,lp->li", bases, gradient), hessian)


class _Quadratic(NamedTuple):
    """Of each lane the quadratic model, in units (l, p) that make the Hessian's diagonal 1: its eigenvalues (l, p), its eigenvectors
    (l, p, p), and the gradient along them (l, p).
    """

    unit: np.ndarray
    curvature: np.ndarray
    axes: np.ndarray
    along: np.ndarray

    def step(self, damping: np.ndarray) -> np.ndarray:
        """To the minimum of the model with its curvatures raised by `damping` (l,)."""
        raised = self.curvature + damping[:, None]
        step = -np.einsum("lij,lj->li", self.axes, _over(self.along, raised, 1e-14)) / self.unit
        return step * np.minimum(1.0, LONGEST / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))

    def descent(self) -> np.ndarray:
        """What the undamped step would bring, gᵀH⁻¹g/2; along valleys, where it cannot be told, nothing."""
        return (self.along * _over(self.along, self.curvature, 1e-9)).sum(axis=1) / 2


def _over(along: np.ndarray, curvature: np.ndarray, least: float) -> np.ndarray:
    """The quotient, and 0 where the curvature is below that share of the largest."""
    steep = curvature > least * curvature.max(axis=1, keepdims=True)
    return np.where(steep, along / np.where(steep, curvature, 1), 0)


def _quadratic(hessian: np.ndarray, gradient: np.ndarray) -> _Quadratic:
    diagonal = np.diagonal(hessian, axis1=1, axis2=2)
    # A direction that changes nothing gets a small unit's inverse, so that it is not followed.
    unit = np.sqrt(np.maximum(diagonal, 1e-12 * np.maximum(diagonal.max(axis=1, keepdims=True, initial=0), 1e-300)))
    curvature, axes = np.linalg.eigh(hessian / (unit[:, :, None] * unit[:, None]))
    return _Quadratic(unit, curvature, axes, np.einsum("lij,li->lj", axes, gradient / unit))
