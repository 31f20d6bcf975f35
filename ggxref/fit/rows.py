"""Reflectance in rows of 256 samples: one compiled call takes 8 rows, each with its own θ, and serves every start, fold,
replicate and file. Calls go round the devices, from a thread for each core.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple, TypeVar

import jax
import numpy as np
from jax import Array

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
    every = np.concatenate([*directions, noise[None], problem.weights[None], measured])
    samples = np.ascontiguousarray(every[:, index].swapaxes(0, 1))
    samples[:, WEIGHT][index < 0] = 0
    return Rows(samples, index, np.repeat(np.arange(len(padded)), [len(rows) for rows in padded]))


def cut_by_block(problem: Problem) -> tuple[Rows, np.ndarray]:
    """The problem's samples in rows of which none straddles two blocks, and each row's block."""
    blocks = np.unique(problem.block)
    several = [cut(problem, np.flatnonzero(problem.block == block)) for block in blocks]
    return join(several), np.repeat(blocks, [len(each.weights) for each in several])


def join(several: list[Rows]) -> Rows:
    return Rows(*(np.concatenate(parts) for parts in zip(*several, strict=True)))


class Piece(NamedTuple):
    """8 rows on a device. `numbers`: which of all rows they are. A short piece, of `size` rows, is filled up with its last, so
    that every call has the one compiled shape.
    """

    numbers: np.ndarray
    size: int
    samples: Array


def pack(rows: Rows, which: np.ndarray, weights: np.ndarray | None = None) -> list[Piece]:
    """The rows with the numbers `which`, with their own weights or these, (r, 256), in pieces that go round the devices."""
    devices, pieces = jax.local_devices(), []
    for number, start in enumerate(range(0, len(which), CALL)):
        numbers = np.minimum(np.arange(start, start + CALL), len(which) - 1)
        samples = rows.samples[which[numbers]]
        if weights is not None:
            samples[:, WEIGHT] = weights[numbers]
        with solver.float64():
            there = jax.device_put(samples, devices[number % len(devices)])
        pieces.append(Piece(numbers, min(CALL, len(which) - start), there))
    return pieces


def each(surface: Surface, theta: np.ndarray, pieces: list[Piece], of: Callable[[Each], T]) -> list[T]:
    """What `of` makes of each piece's rows at their θ (r, p)."""

    def call(piece: Piece) -> T:
        # Both belong to a thread. A step too far may overflow: the solver refuses it.
        with solver.float64(), np.errstate(all="ignore"):
            return of(kernel.call(surface, theta[piece.numbers], piece.samples, piece.size))

    if len(pieces) == 1 or _workers() == 1:
        return [call(piece) for piece in pieces]
    return list(_threads().map(call, pieces))


def _workers() -> int:
    """A thread for each core that this process may use, or for each device."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(cores, len(jax.local_devices()))


@cache
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(_workers())


@dataclass
class Lanes:
    """Problems to solve side by side. `which`: of each lane, the numbers of its rows; `weights`: those rows', (rows, 256)."""

    surface: Surface
    rows: Rows
    which: list[np.ndarray]
    weights: list[np.ndarray]
    packed: tuple[np.ndarray, list[Piece]] = field(default_factory=lambda: (np.zeros(0, int), []))
    """The lanes asked for last, which mostly are asked for again, and their rows."""

    @property
    def total(self) -> np.ndarray:
        return np.array([weights.sum() for weights in self.weights])

    @property
    def samples(self) -> np.ndarray:
        return np.array([np.count_nonzero(weights) for weights in self.weights])

    def terms(self, theta: np.ndarray, lanes: np.ndarray) -> Terms:
        """The mean loss of these lanes, its gradient and the matrix like its Hessian."""
        owner = np.repeat(np.arange(len(lanes)), [len(self.which[k]) for k in lanes])
        if not np.array_equal(lanes, self.packed[0]):
            which, weights = (np.concatenate([part[k] for k in lanes]) for part in (self.which, self.weights))
            self.packed = lanes, pack(self.rows, which, weights)
        pieces = each(self.surface, theta[owner], self.packed[1], lambda each: (each.loss, each.products()))
        starts, total = np.searchsorted(owner, np.arange(len(lanes))), self.total[lanes]
        with np.errstate(all="ignore"):  # as in `each`
            sums = [np.add.reduceat(np.concatenate(parts), starts) for parts in zip(*pieces, strict=True)]
            return kernel.assemble(*(part / total.reshape(-1, *[1] * (part.ndim - 1)) for part in sums))
