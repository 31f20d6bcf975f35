"""Reflectance in rows of 256 samples: one compiled call takes 16 rows, each with its own θ, and serves every start, fold,
replicate and file. Calls go round the devices, from a thread for each core.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache, partial
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ggxref.fit import models, solver
from ggxref.fit.levenberg import Terms
from ggxref.fit.models import Surface
from ggxref.fit.parameters import SHAPE
from ggxref.fit.problem import Problem

ROW = 256
CALL = 16

T = TypeVar("T")


class Rows(NamedTuple):
    """Samples of one or more problems. `samples`: arrays (r, …, 256), the objective's; `weights`: (r, 256), 0 for padding.

    - `index`: (r, 256), the sample's number in its problem, −1 for padding; `fold`: (r,), as no row straddles two.
    """

    samples: tuple[np.ndarray, ...]
    weights: np.ndarray
    index: np.ndarray
    fold: np.ndarray


def cut(problem: Problem, kept: np.ndarray | None = None) -> Rows:
    """The problem's samples in rows, or those of them with the numbers `kept`, which are then of fold 0."""
    parts = [kept] if kept is not None else [np.flatnonzero(problem.fold == k) for k in range(problem.fold.max() + 1)]
    padded = [np.pad(part, (0, -len(part) % ROW), constant_values=-1).reshape(-1, ROW) for part in parts]
    index = np.concatenate(padded)
    samples = tuple(np.ascontiguousarray(np.moveaxis(array[..., index], -2, 0)) for array in problem.samples)
    weights = np.where(index >= 0, problem.weights[index], 0.0)
    return Rows(samples, weights, index, np.repeat(np.arange(len(padded)), [len(rows) for rows in padded]))


def cut_by_block(problem: Problem) -> tuple[Rows, np.ndarray]:
    """The problem's samples in rows of which none straddles two blocks, and each row's block."""
    blocks = np.unique(problem.block)
    several = [cut(problem, np.flatnonzero(problem.block == block)) for block in blocks]
    return join(several), np.repeat(blocks, [len(each.weights) for each in several])


def join(several: list[Rows]) -> Rows:
    return Rows(
        tuple(np.concatenate(arrays) for arrays in zip(*(rows.samples for rows in several), strict=True)),
        *(np.concatenate([rows[k] for rows in several]) for k in (1, 2, 3)),
    )


class Each(NamedTuple):
    """Of r rows: `weights` (r, 256), `losses` (r, bands, 256), and `factors` (r, bands, 6 + m + 1, 256): the residual's derivatives by
    the shape and by the band's own m entries, and last the residual r itself, each times the root of weight / √(1 + r²) / bands.

    What a fit needs are their products, which BLAS forms several times faster than XLA.
    """

    weights: np.ndarray
    losses: np.ndarray
    factors: np.ndarray

    @property
    def loss(self) -> np.ndarray:
        """(r,): the weighted sums."""
        return np.einsum("rbn,rn->r", self.losses, self.weights) / self.losses.shape[1]

    def products(self) -> np.ndarray:
        """(r, bands, 6 + m, 6 + m + 1): of the derivatives with each other, and last with the residual."""
        return _products(self.factors)

    def terms(self) -> Terms:
        """The rows' sums: loss, gradient, and the Hessian with each residual's weight in the gradient, so that descent is sure."""
        return _terms(self.loss, self.products())

    def bread(self) -> np.ndarray:
        """(r, p, p): the Hessian with the loss's own second derivative. Like `terms`' it leaves out the residuals' curvature,
        whose mean the minimum makes small.
        """
        return _terms(self.loss, _products(self.factors / (1 + self.losses[:, :, None]))).hessian

    def scores(self) -> np.ndarray:
        """(r, p, 256): each sample's share of the gradient."""
        size, places = _places(*self.factors.shape[1:3])
        scores = np.zeros((len(self.weights), size, ROW))
        for band, place in enumerate(places):
            scores[:, place] += self.factors[:, band, :-1] * self.factors[:, band, -1:]
        return scores


def _products(factors: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):  # a step too far may overflow: the solver refuses it
        return factors[:, :, :-1] @ factors.swapaxes(-1, -2)


@cache
def _places(bands: int, factors: int) -> tuple[int, list[np.ndarray]]:
    """The size of θ, and where in it each band's derivatives belong, (6 + m,)."""
    size = len(SHAPE) + bands * (factors - len(SHAPE) - 1)
    return size, [np.r_[: len(SHAPE), len(SHAPE) + band : size : bands] for band in range(bands)]


def _terms(loss: np.ndarray, products: np.ndarray) -> Terms:
    """From sums of `Each.products`, (…, bands, 6 + m, 6 + m + 1)."""
    size, places = _places(products.shape[1], products.shape[3])
    gradient, matrix = np.zeros((len(loss), size)), np.zeros((len(loss), size, size))
    for band, place in enumerate(places):
        matrix[:, place[:, None], place] += products[:, band, :, :-1]
        gradient[:, place] += products[:, band, :, -1]
    return Terms(loss, gradient, matrix)


def _lobe(surface: Surface, shape: tuple[Array, ...], wi, wo, wm) -> tuple[Array, ...]:
    """The specular BRDF of F = 1 and its derivatives by the six entries of the shape."""
    lobe, slope = jax.value_and_grad(lambda shape: models.specular(shape, wi, wo, wm, surface))(shape)
    return lobe, *slope


def _band(
    surface: Surface, entries: tuple[Array, ...], bands: int, f, lobe, cosine, zo, noise, weight
) -> tuple[Array, ...]:
    """Of one sample in one band: its loss, the factor of the lobe's derivatives, and the factors of the band's own and of r."""
    F, dF = jax.value_and_grad(lambda e: models.reflectance(cosine, e, surface.fresnel))(entries[:-1])
    base = models.diffuse(entries[-1])
    radiance = (lobe * F + base) * zo + noise
    r = jnp.log(radiance / (f * zo + noise))
    s = jnp.sqrt(1 + r * r)
    root = jnp.sqrt(weight / (s * bands))
    of_f = root * zo / radiance
    return r * r / (1 + s), of_f * F, *(of_f * lobe * d for d in dF), of_f * base, root * r


# `each` has a thread for each core already.
@partial(jax.jit, static_argnames=("surface",), compiler_options={"xla_cpu_multi_thread_eigen": False})
def _call(surface: Surface, theta: Array, samples: tuple[Array, ...], weights: Array) -> tuple:
    """Of 16 rows: losses, the derivatives of the lobe alone (each 16, 256), and what `_band` says (each 16, bands, 256).

    They leave as they are: to stack them here would compute each of them anew for every place in the stack.
    """

    def row(theta, samples, weights):
        wi, wo, wm, measured, noise = samples
        own = theta[len(SHAPE) :].reshape(-1, len(measured)).T
        lobe, *slopes = jax.vmap(partial(_lobe, surface, tuple(theta[: len(SHAPE)])), -1)(wi, wo, wm)
        cosine = wi[0] * wm[0] + wi[1] * wm[1] + wi[2] * wm[2]

        def band(entries, f):
            of_sample = partial(_band, surface, tuple(entries), len(measured))
            return jax.vmap(of_sample)(f, lobe, cosine, wo[2], noise, weights)

        return slopes, jax.vmap(band)(own, measured)

    return jax.vmap(row)(theta, samples, weights)


def _stacked(slopes: list[np.ndarray], bands: tuple[np.ndarray, ...], size: int) -> tuple[np.ndarray, np.ndarray]:
    """The losses and the factors of `Each`, of the first `size` rows."""
    losses, of_lobe, *own = (part[:size] for part in bands)
    count, number, _ = losses.shape
    factors = np.empty((count, number, len(slopes) + len(own), ROW))
    with np.errstate(all="ignore"):
        for k, slope in enumerate(slopes):
            np.multiply(slope[:size, None], of_lobe, out=factors[:, :, k])
    for k, part in enumerate(own, len(slopes)):
        factors[:, :, k] = part
    return losses, factors


class Piece(NamedTuple):
    """16 rows on a device. `numbers`: which of all rows they are. A short piece, of `size` rows, is filled up with its last, so
    that every call has the one compiled shape.
    """

    numbers: np.ndarray
    size: int
    samples: tuple[Array, ...]
    weights: Array


def pack(rows: Rows, which: np.ndarray, weights: np.ndarray) -> list[Piece]:
    """The rows with the numbers `which`, with `weights` (r, 256), in pieces that go round the devices."""
    devices, pieces = jax.local_devices(), []
    for number, start in enumerate(range(0, len(which), CALL)):
        numbers = np.minimum(np.arange(start, start + CALL), len(which) - 1)
        samples = tuple(a[which[numbers]] for a in rows.samples)
        with solver.float64():
            there = jax.device_put((samples, weights[numbers]), devices[number % len(devices)])
        pieces.append(Piece(numbers, min(CALL, len(which) - start), *there))
    return pieces


def each(surface: Surface, theta: np.ndarray, pieces: list[Piece], of: Callable[[Each], T]) -> list[T]:
    """What `of` makes of each piece's rows at their θ (r, p)."""

    def call(piece: Piece) -> T:
        # The configuration belongs to a thread.
        with solver.float64():
            found = _call(surface, theta[piece.numbers], piece.samples, piece.weights)
            slopes, bands = jax.tree.map(np.asarray, found)
            losses, factors = _stacked(slopes, bands, piece.size)
            return of(Each(np.asarray(piece.weights)[: piece.size], losses, factors))

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
        sums = [np.add.reduceat(np.concatenate(parts), starts) for parts in zip(*pieces, strict=True)]
        return _terms(*(part / total.reshape(-1, *[1] * (part.ndim - 1)) for part in sums))
