"""Which model is the smallest that suffices: loss on data that the fit did not see, and BIC beside it."""

import math
from collections.abc import Sequence

import numpy as np

from ggxref.fit.problem import Problem


def bic(problem: Problem, loss: float, size: int) -> float:
    """Bayesian information criterion, −2 log-likelihood + size · log n.

    A mean robust loss stands for half a variance, and its likelihood for a normal one. The samples count as
    independent, which they are not: it is too ready to take a larger model.
    """
    n = problem.size
    deviance = math.log(2 * loss) if problem.surface else 2 * loss
    return n * deviance + size * math.log(n)


def choose(names: Sequence[str], losses: np.ndarray, tolerance: float | None = None) -> str:
    """The first model whose held-out loss is within one standard error of the best one's, or within `tolerance` of it.

    - `names`: from the smallest model to the largest. `losses`: (models, folds).

    The folds are paired: what matters is how sure the difference is, not how different the folds are.
    """
    excess = losses - losses[np.argmin(losses.mean(axis=1))]
    allowed = excess.std(axis=1, ddof=1) / math.sqrt(losses.shape[1]) if tolerance is None else tolerance
    return names[int(np.argmax(excess.mean(axis=1) <= allowed))]
