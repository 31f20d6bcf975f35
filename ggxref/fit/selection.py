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


def choose(
    names: Sequence[str], losses: np.ndarray, tolerance: float | None = None, blocks: np.ndarray | None = None
) -> str:
    """The first model whose held-out loss is within one standard error of the best one's, or within `tolerance` of it.

    - `names`: from the smallest model to the largest. `losses`: (models, folds). `blocks`: the same of each block, (models, blocks).

    The folds are paired: what matters is how sure the difference is, not how different the folds are.
    """
    best = int(np.argmin(losses.mean(axis=1)))
    of_blocks = losses if blocks is None else blocks
    errors = [standard_error(*each) for each in zip(losses - losses[best], of_blocks - of_blocks[best], strict=True)]
    allowed = np.array(errors) if tolerance is None else tolerance
    return names[int(np.argmax(losses.mean(axis=1) - losses[best].mean() <= allowed))]


def standard_error(folds: np.ndarray, blocks: np.ndarray) -> float:
    """Of the mean of a difference, known for each fold and for each block: the larger of the two.

    What a whole fold shares is seen over the folds alone; but a handful of them can agree by chance, and would then be sure.
    Fits that left out different folds share most of their data, and its chances: Nadeau & Bengio 2003 add to 1/K the ratio of
    what was left out to the rest, 1/(K − 1).
    """
    plain = max(float(each.std(ddof=1)) / math.sqrt(len(each)) for each in (folds, blocks))
    return plain * math.sqrt(1 + len(folds) / (len(folds) - 1))
