"""Bootstrap intervals: the chosen model fitted again to blocks drawn with replacement, so that what is correlated stays together."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from ggxref.fit import levenberg, objectives, parameters, rows, solver
from ggxref.fit.fitting import Fit, Ladder

SEED = 1
SETTLED = 0.05
"""Standard errors that may be left to a replicate's minimum: nothing beside the spread of the replicates."""
MOST_STEPS = 30
AT_ONCE = 2**20
"""Samples of replicates side by side: each carries its weight, so that they bound the memory."""


def intervals(ladder: Ladder, replicates: int, share: float = 0.95) -> dict[str, tuple[float, float]]:
    """The central `share` of each parameter and of what follows from them, by name."""
    problem, fit = ladder.problem, ladder.best
    blocks, block = np.unique(problem.block, return_inverse=True)
    random, several = np.random.default_rng(SEED), max(AT_ONCE // problem.size, 1)

    def weights(count):
        draws = random.integers(len(blocks), size=(count, len(blocks)))
        times = np.stack([np.bincount(draw, minlength=len(blocks)) for draw in draws])
        return problem.weights * times[:, block]

    solve = _reflectance if problem.surface else _slopes
    counts = [min(several, replicates - start) for start in range(0, replicates, several)]
    found = np.concatenate([solve(ladder, fit, weights(count)) for count in counts])
    zero = np.zeros((len(fit.theta),) * 2)
    values = [parameters.report(theta, zero, problem.parameters)[0] for theta in found]
    ends = (1 - share) / 2, (1 + share) / 2
    return {name: tuple(np.quantile([each[name] for each in values], ends).tolist()) for name in fit.values}


def _reflectance(ladder: Ladder, fit: Fit, weights: np.ndarray) -> np.ndarray:
    surface = ladder.problem.surface
    assert surface is not None
    cut = rows.cut(ladder.problem)
    padded = np.where(cut.index >= 0, weights[:, cut.index], 0.0)
    lanes = rows.Lanes(replace(surface, tail=fit.tail), cut, [np.arange(len(cut.index))] * len(weights), list(padded))
    start = np.tile(fit.theta, (len(weights), 1))
    bases = np.tile(fit.identified.basis, (len(weights), 1, 1))
    return levenberg.minimise(lanes.terms, start, bases, lanes.samples, settled=SETTLED, most=MOST_STEPS).theta


def _slopes(ladder: Ladder, fit: Fit, weights: np.ndarray) -> np.ndarray:
    loss = objectives.slopes(fit.tail)
    with solver.float64():
        samples = tuple(jnp.asarray(array) for array in ladder.problem.samples)
        starts = np.tile(fit.theta, (len(weights), 1))
        return np.asarray(solver.minimise(loss, samples, fit.space, starts, list(weights)).theta)
