"""Reflectance problems of one kind solved side by side: from many starts on few samples, then on all, then without each fold."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ggxref.fit import levenberg, parameters, rows
from ggxref.fit.found import Found
from ggxref.fit.kernel import NOISE, VALUES, Each
from ggxref.fit.levenberg import Minima
from ggxref.fit.models import Surface
from ggxref.fit.parameters import Space
from ggxref.fit.problem import Problem
from ggxref.fit.rows import Lanes, Rows
from ggxref.fit.uncertainty import Curvature

FEW = 512
"""Samples, evenly through the file, on which the starts run; what they find is a start for all samples."""
AGREE = 1e-3
"""Of the loss on those few: starts that end within this have found the same minimum."""
SETTLED, NEARLY = 1e-3, 0.1
"""Standard errors that may be left to the minimum, of a fit and of what only leads to one."""
MOST_STEPS, FIRST_STEPS, FOLD_STEPS = 100, 40, 8
REFITTED = 8192
"""Samples up to which each fold's fit is carried on after its first Newton step; with more, that step is as good."""


class Bank(NamedTuple):
    """The rows of several problems, all samples' and the few's, and which of them are each problem's."""

    problems: list[Problem]
    all: Rows
    of: list[np.ndarray]
    few: Rows
    few_of: list[np.ndarray]


def bank(problems: list[Problem]) -> Bank:
    whole = [rows.cut(problem) for problem in problems]
    few = [rows.cut(p, np.arange(min(FEW, p.size)) * p.size // min(FEW, p.size)) for p in problems]
    return Bank(problems, rows.join(whole), _numbers(whole), rows.join(few), _numbers(few))


def _numbers(several: list[Rows]) -> list[np.ndarray]:
    ends = np.cumsum([len(each.weights) for each in several])
    return [np.arange(end - len(each.weights), end) for end, each in zip(ends, several, strict=True)]


def solve(
    bank: Bank, tail: str, spaces: list[Space], starts: list[np.ndarray], smaller: list[np.ndarray] | None = None
) -> list[Found]:
    """The minimum of each problem in its space, from its starts θ, (starts, p), as `minima` has it."""
    surface = bank.problems[0].surface
    assert surface is not None
    surface = replace(surface, tail=tail)
    found, agreeing = minima(bank, surface, spaces, starts, smaller)
    names = [problem.parameters for problem in bank.problems]
    pinned = [parameters.at_bounds(*each) for each in zip(spaces, found.theta, names, strict=True)]
    spaces = [parameters.without(*each) for each in zip(spaces, pinned, names, strict=True)]
    at = [_curvature(bank, surface, k, found.theta[k], spaces[k]) for k in range(len(spaces))]
    held_out = _held_out(bank, surface, found.theta, spaces, [each[1] for each in at])
    return [
        Found(
            theta=found.theta[k],
            loss=float(found.loss[k]),
            met=bool(found.met[k]),
            space=spaces[k],
            agreeing=agreeing[k],
            at=at[k][0],
            held_out=held_out[k][0],
            held_out_blocks=held_out[k][1],
            residuals=_residuals(bank, surface, k, found.theta[k]),
        )
        for k in range(len(spaces))
    ]


def _lanes(surface: Surface, rows: Rows, which: list[np.ndarray]) -> Lanes:
    return Lanes(surface, rows, which, [rows.weights[numbers] for numbers in which])


def minima(
    bank: Bank,
    surface: Surface,
    spaces: list[Space],
    starts: list[np.ndarray],
    smaller: list[np.ndarray] | None = None,
) -> tuple[Minima, list[tuple[int, int]]]:
    """The minimum of each problem, and how many of how many starts agreed on it: from all of them on few samples, from the best on all.

    - `smaller`: θ (p,) of each problem, the minimum of a smaller model: one start more.
    """
    inside = [_inside(*each) for each in zip(spaces, starts, strict=True)]
    last = None
    if smaller:
        last = np.concatenate([_inside(space, theta[None]) for space, theta in zip(spaces, smaller, strict=True)])
        inside = [np.vstack(each) for each in zip(inside, last, strict=True)]
    begun, agreeing = _from_starts(bank, surface, spaces, inside)
    bases = np.stack([space.basis for space in spaces])
    lanes = _lanes(surface, bank.all, bank.of)
    # The smaller model's minimum may be lower on all samples than what the few led to.
    return levenberg.minimise(
        lanes.terms, begun, bases, lanes.samples, settled=SETTLED, most=MOST_STEPS, instead=last
    ), agreeing


def _inside(space: Space, starts: np.ndarray) -> np.ndarray:
    """The points of the space nearest to the starts (starts, p)."""
    return np.stack([space.held + space.basis @ space.coordinates(row) for row in starts])


def _from_starts(
    bank: Bank, surface: Surface, spaces: list[Space], starts: list[np.ndarray]
) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Where to begin with all samples, (problems, p), and how many of how many starts ended there."""
    owner = np.repeat(np.arange(len(starts)), [len(each) for each in starts])
    few = _lanes(surface, bank.few, [bank.few_of[k] for k in owner])
    bases = np.stack([spaces[k].basis for k in owner])
    found = levenberg.minimise(few.terms, np.concatenate(starts), bases, few.samples, settled=NEARLY, most=FIRST_STEPS)
    several = [(found.theta[owner == k], found.loss[owner == k]) for k in range(len(starts))]
    agreeing = [(int(np.sum(loss <= loss.min() * (1 + AGREE))), len(loss)) for _, loss in several]
    return np.stack([theta[np.argmin(loss)] for theta, loss in several]), agreeing


class _Folds(NamedTuple):
    """Summed gradient (folds, p) and bread (folds, p, p) of each fold."""

    gradient: np.ndarray
    bread: np.ndarray


MOST_BLOCKS = 128
"""With more, no block pulls hard, and the plain sandwich over them will do."""


def _curvature(bank: Bank, surface, k: int, theta: np.ndarray, space: Space) -> tuple[Curvature, _Folds]:
    problem = bank.problems[k]
    columns = space.basis[:, space.columns]
    few = len(np.unique(problem.block)) <= MOST_BLOCKS
    cut, block = rows.cut_by_block(problem) if few else (rows.cut(problem), np.zeros(0, int))

    def of(each: Each) -> tuple[np.ndarray, ...]:
        # Where no row straddles two blocks, the rows' sums will do.
        return each.terms().gradient, each.bread(), np.zeros(0) if few else each.scores()

    at = np.tile(theta, (len(cut.fold), 1))
    gradient, bread, each = _joined(rows.each(surface, at, cut, of))
    if few:
        numbers = np.unique(block)
        scores = np.stack([gradient[block == b].sum(axis=0) for b in numbers]) @ columns
        parts = np.stack([columns.T @ bread[block == b].sum(axis=0) @ columns for b in numbers])
        # All of a block is in one fold.
        fold = problem.fold[cut.index[:, 0]]
    else:
        inside = cut.index >= 0
        each = columns.T @ each.swapaxes(0, 1)[:, inside]
        scores = np.stack([np.bincount(problem.block[cut.index[inside]], row) for row in each], axis=1)
        parts, fold = None, cut.fold
    sums = [np.stack([part[fold == f].sum(axis=0) for f in range(fold.max() + 1)]) for part in (gradient, bread)]
    return Curvature(columns.T @ bread.sum(axis=0) @ columns, scores, parts), _Folds(*sums)


def _joined(pieces: list[tuple[np.ndarray, ...]]) -> list[np.ndarray]:
    return [np.concatenate(parts) for parts in zip(*pieces, strict=True)]


def _held_out(
    bank: Bank, surface, theta: np.ndarray, spaces: list[Space], folds: list[_Folds]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Of each problem the mean loss on each fold, at the minimum of the other folds, and there on each block."""
    begun = [_without(theta[k], spaces[k], folds[k]) for k in range(len(spaces))]
    owner = np.repeat(np.arange(len(begun)), [len(each) for each in begun])
    number = np.concatenate([np.arange(len(each)) for each in begun])
    outside = [bank.of[k][bank.all.fold[bank.of[k]] != f] for k, f in zip(owner, number, strict=True)]
    there = np.concatenate(begun)
    again = np.flatnonzero([bank.problems[k].size <= REFITTED for k in owner])
    if len(again):
        lanes = _lanes(surface, bank.all, [outside[k] for k in again])
        bases = np.stack([spaces[owner[k]].basis for k in again])
        there[again] = levenberg.minimise(
            lanes.terms, there[again], bases, lanes.samples, settled=NEARLY, most=FOLD_STEPS
        ).theta
    return [_losses_of(bank, surface, k, there[owner == k]) for k in range(len(spaces))]


def _losses_of(bank: Bank, surface, k: int, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The mean loss on each fold f of problem k at θ_f (folds, p), and there on each block."""
    problem, which = bank.problems[k], bank.of[k]
    of_row = theta[bank.all.fold[which]]
    found = rows.each(surface, of_row, bank.all, lambda each: each.losses.mean(axis=1), which)
    index, loss = bank.all.index[which], np.concatenate(found)
    every = np.empty(problem.size)
    every[index[index >= 0]] = loss[index >= 0]
    weights = problem.weights
    return np.bincount(problem.fold, every * weights) / np.bincount(problem.fold, weights), problem.by_block(every)


def _without(theta: np.ndarray, space: Space, folds: _Folds) -> np.ndarray:
    """(folds, p): the minimum without each fold, by one Newton step from the minimum with it."""
    columns = space.basis[:, space.columns]
    steps = [
        np.linalg.pinv(columns.T @ (folds.bread.sum(axis=0) - bread) @ columns, rcond=1e-10, hermitian=True)
        @ (columns.T @ gradient)
        for gradient, bread in zip(folds.gradient, folds.bread, strict=True)
    ]
    return theta + np.clip(np.stack(steps), -levenberg.LONGEST, levenberg.LONGEST) @ columns.T


def _residuals(bank: Bank, surface, k: int, theta: np.ndarray) -> np.ndarray:
    """(n, bands): log(f̂/f), with the sign lost; NaN where f is not positive."""
    problem, which = bank.problems[k], bank.of[k]
    plain = bank.all.samples[which]
    plain[:, NOISE] = 0
    measured = plain[:, VALUES]
    measured[measured <= 0] = 1
    at, alone = np.tile(theta, (len(which), 1)), Rows(plain, bank.all.index[which], bank.all.fold[which])
    found = np.concatenate(rows.each(surface, at, alone, lambda each: each.losses))
    index = bank.all.index[which]
    residuals = np.empty((problem.size, measured.shape[1]))
    # The pseudo-Huber loss l = √(1 + r²) − 1, turned round: r² = l (l + 2).
    loss = found.swapaxes(1, 2)[index >= 0]
    residuals[index[index >= 0]] = np.sqrt(loss * (loss + 2))
    return np.where(problem.samples[3].T > 0, residuals, np.nan)
