"""Reflectance in rows of 256 samples: one compiled call takes 8 rows, each with its own θ, and serves every start, fold,
replicate and file. Calls go round the devices, from a thread for each core.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple, TypeVar

import jax
import numpy as np

from ggxref.fit import kernel, solver
from ggxref.fit.kernel import ROW, WEIGHT, Each
from ggxref.fit.levenberg import Terms
from ggxref.fit.models import Surface
from ggxref.fit.problem import Problem

CALL = 8

T = TypeVar("T")


class Rows(NamedTuple):
    """Samples of one or more problems. `samples`: (r, 11 + bands, 256), as `kernel` has them, of weight 0 where there is none.

    - `index`: (r, 256), the sample's number in its problem, −1 for padding; `fold`: (r,), as no row straddles two.
    """

    samples: np.ndarray
    index: np.ndarray
    fold: np.ndarray

    @property
    def weights(self) -> np.ndarray:
        """(r, 256)."""
        return self.samples[:, WEIGHT]


def cut(problem: Problem, kept: np.ndarray | None = None) -> Rows:
    """The problem's samples in rows, or those of them with the numbers `kept`, which are then of fold 0."""
    parts = [kept] if kept is not None else [np.flatnonzero(problem.fold == k) for k in range(problem.fold.max() + 1)]
    padded = [np.pad(part, (0, -len(part) % ROW), constant_values=-1).reshape(-1, ROW) for part in parts]
    index = np.concatenate(padded)
    *directions, measured, noise = problem.samples
    components = [
        component for array in (*directions, noise[None], problem.weights[None], measured) for component in array
    ]
    samples = np.empty((len(index), len(components), ROW))
    for k, component in enumerate(components):
        samples[:, k] = component[index]
    samples[:, WEIGHT][index < 0] = 0
    return Rows(samples, index, np.repeat(np.arange(len(padded)), [len(rows) for rows in padded]))


def cut_by_block(problem: Problem) -> tuple[Rows, np.ndarray]:
    """The problem's samples in rows of which none straddles two blocks, and each row's block."""
    blocks = np.unique(problem.block)
    several = [cut(problem, np.flatnonzero(problem.block == block)) for block in blocks]
    return join(several), np.repeat(blocks, [len(each.weights) for each in several])


def join(several: list[Rows]) -> Rows:
    return Rows(*(np.concatenate(parts) for parts in zip(*several, strict=True))) if len(several) > 1 else several[0]


def each(
    surface: Surface,
    theta: np.ndarray,
    rows: Rows,
    of: Callable[[Each], T],
    which: np.ndarray | None = None,
    weights: np.ndarray | None = None,
) -> list[T]:
    """What `of` makes of the rows, or of those with the numbers `which` (r,), 8 by 8, at their θ (r, p).

    - `weights`: (r, 256), in place of the rows' own.
    """
    which = np.arange(len(rows.fold)) if which is None else which
    devices = jax.local_devices()

    def call(start: int) -> T:
        # A short piece is filled up with its last row, so that every call has the one compiled shape.
        numbers = np.minimum(np.arange(start, start + CALL), len(which) - 1)
        samples = rows.samples[which[numbers]]
        if weights is not None:
            samples[:, WEIGHT] = weights[numbers]
        device = devices[start // CALL % len(devices)]
        # All three belong to a thread. A step too far may overflow: the solver refuses it.
        with solver.float64(), jax.default_device(device), np.errstate(all="ignore"):
            return of(kernel.call(surface, theta[numbers], samples, min(CALL, len(which) - start)))

    starts = range(0, len(which), CALL)
    return list(map(call, starts) if len(starts) == 1 or _workers() == 1 else _threads().map(call, starts))


def _workers() -> int:
    """A thread for each core that this process may use, or for each device."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(cores, len(jax.local_devices()))


@cache
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(_workers())


class Asked(NamedTuple):
    """Some lanes side by side. `which`, `weights`: their rows; `owner`: (rows,), the lane's place among them; `first`: (lanes,), its
    first row; `total`: (lanes,), its weight.
    """

    lanes: np.ndarray
    which: np.ndarray
    weights: np.ndarray
    owner: np.ndarray
    first: np.ndarray
    total: np.ndarray


@dataclass
class Lanes:
    """Problems to solve side by side. `which`: of each lane, the numbers of its rows; `weights`: those rows', (rows, 256)."""

    surface: Surface
    rows: Rows
    which: list[np.ndarray]
    weights: list[np.ndarray]
    last: Asked | None = None
    """The lanes asked for last mostly are asked for again."""

    @property
    def samples(self) -> np.ndarray:
        return np.array([np.count_nonzero(weights) for weights in self.weights])

    def terms(self, theta: np.ndarray, lanes: np.ndarray) -> Terms:
        """The mean loss of these lanes, its gradient and the matrix like its Hessian."""
        asked = self._asked(lanes)
        at = theta[asked.owner]
        pieces = each(
            self.surface, at, self.rows, lambda each: (each.loss, each.products()), asked.which, asked.weights
        )
        with np.errstate(all="ignore"):  # as in `each`
            loss, products = (
                np.add.reduceat(np.concatenate(parts), asked.first) for parts in zip(*pieces, strict=True)
            )
            return kernel.assemble(loss / asked.total, products / asked.total[:, None, None, None])

    def _asked(self, lanes: np.ndarray) -> Asked:
        if self.last is None or not np.array_equal(lanes, self.last.lanes):
            which, weights = (np.concatenate([part[k] for k in lanes]) for part in (self.which, self.weights))
            sizes = [len(self.which[k]) for k in lanes]
            first = np.cumsum([0, *sizes[:-1]])
            total = np.add.reduceat(weights.sum(axis=1), first)
            self.last = Asked(lanes, which, weights, np.repeat(np.arange(len(lanes)), sizes), first, total)
        return self.last
