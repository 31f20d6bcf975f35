"""The slope density's maximum likelihood: from each start by optimistix, and the curvature by differences."""

import jax.numpy as jnp
import numpy as np

from ggxref.fit import parameters, solver
from ggxref.fit.found import Found
from ggxref.fit.objectives import slopes
from ggxref.fit.parameters import Space
from ggxref.fit.problem import Problem
from ggxref.fit.uncertainty import Curvature, curvature

AGREE = 1e-5
"""Starts agree when their losses, of order 1, do."""


def solve(problem: Problem, tail: str, space: Space, starts: np.ndarray) -> Found:
    """The model's best minimum from all starts θ, (starts, p)."""
    loss_of = slopes(tail)
    with solver.float64():
        samples = tuple(jnp.asarray(array) for array in problem.samples)
        minima = solver.minimise(loss_of, samples, space, starts, [problem.weights] * len(starts))
        each = [solver.losses(loss_of, theta, samples) for theta in minima.theta]
        loss = np.array([np.average(losses, weights=problem.weights) for losses in each])
        best = int(np.argmin(loss))
        theta = np.asarray(minima.theta[best])

        def by_block(theta):
            return np.bincount(problem.block, problem.weights * solver.losses(loss_of, theta, samples))

        space = parameters.without(space, parameters.at_bounds(space, theta, problem.parameters), problem.parameters)
        at = curvature(by_block, theta, space)
        without = _without(problem, space, theta, at)
        inside = [problem.fold == fold for fold in range(len(without))]
        held_out = [np.average(solver.losses(loss_of, row, samples)[part], weights=problem.weights[part])
                    for row, part in zip(without, inside, strict=True)]  # fmt: skip
    return Found(
        theta=theta,
        loss=float(loss[best]),
        met=bool(minima.found[best]),
        space=space,
        agreeing=(int(np.sum(loss <= loss[best] + AGREE)), len(starts)),
        at=at,
        held_out=np.array(held_out),
        # A tile of a curved surface has slopes of its own and no chance of the whole's; a fold has tiles of all rows and columns.
        held_out_blocks=np.array(held_out),
        residuals=np.zeros((0, 0)),
    )


def _without(problem: Problem, space: Space, theta: np.ndarray, at: Curvature) -> np.ndarray:
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
