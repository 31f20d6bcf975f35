"""Which model is the smallest that suffices: loss on data that the fit did not see, and BIC beside it."""

import math
from collections.abc import Sequence

import numpy as np

from ggxref.fit import solver
from ggxref.fit.objectives import Objective
from ggxref.fit.parameters import Space
from ggxref.fit.problem import Problem
from ggxref.fit.uncertainty import Curvature

REFITTED = 2048
"""Samples up to which the folds are fitted again; for more, one Newton step is as good and a hundred times cheaper."""


def held_out(
    problem: Problem, objective: Objective, samples: tuple, space: Space, theta: np.ndarray, at: Curvature
) -> np.ndarray:
    """(folds,): the mean loss on each fold at the minimum of the other folds."""
    inside = [problem.weights * (problem.fold == fold) for fold in range(int(problem.fold.max()) + 1)]
    if problem.size > REFITTED:
        without = _one_newton_step(problem, space, theta, at)
    else:
        outside = [problem.weights - weights for weights in inside]
        without = solver.minimise(objective, samples, space, np.stack([theta] * len(inside)), outside).theta
    each = [solver.losses(objective, row, samples) for row in without]
    return np.array([np.average(loss, weights=weights) for loss, weights in zip(each, inside, strict=True)])


def _one_newton_step(problem: Problem, space: Space, theta: np.ndarray, at: Curvature) -> np.ndarray:
    """(folds, p): the minimum without each fold, to first order in the fold's share.

    The infinitesimal jackknife: with many samples a fold's pull on θ is a fraction of its standard error.
    """
    fold_of_block = np.zeros(len(at.scores), dtype=int)
    fold_of_block[problem.block] = problem.fold
    steps = []
    for fold in range(int(problem.fold.max()) + 1):
        share = problem.weights[problem.fold == fold].sum() / problem.weights.sum()
        score = at.scores[fold_of_block == fold].sum(axis=0)
        steps.append(np.linalg.pinv(at.hessian * (1 - share), hermitian=True) @ score)
    return theta + np.stack(steps) @ space.basis[:, space.columns].T


def bic(problem: Problem, loss: float, size: int) -> float:
    """Bayesian information criterion, −2 log-likelihood + size · log n.

    A mean robust loss stands for half a variance, and its likelihood for a normal one. The samples count as
    independent, which they are not: it is too ready to take a larger model.
    """
    n = problem.size
    deviance = math.log(2 * loss) if problem.surface else 2 * loss
    return n * deviance + size * math.log(n)


def choose(names: Sequence[str], losses: np.ndarray) -> str:
    """The first model whose held-out loss is within one standard error of the best one's.

    - `names`: from the smallest model to the largest. `losses`: (models, folds).

    The folds are paired: what matters is how sure the difference is, not how different the folds are.
    """
    excess = losses - losses[np.argmin(losses.mean(axis=1))]
    error = excess.std(axis=1, ddof=1) / math.sqrt(losses.shape[1])
    return names[int(np.argmax(excess.mean(axis=1) <= error))]
