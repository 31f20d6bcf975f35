"""Reflectance in rows of 256 samples: one compiled call takes 16 rows, each with its own θ, and serves every start, fold,
replicate and file. Calls go round the devices, from a thread for each core.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

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
    """Of every row: `losses` (r, bands, 256), weighted `scores` (r, p, 256), the summed `hessian` and `bread` (r, p, p).

    `hessian` has the weight of each residual in its loss's gradient and is never too small, so that descent is sure;
    `bread` has the loss's own second derivative. Both leave out the residuals' curvature, whose mean the minimum makes small.
    """

    losses: np.ndarray
    scores: np.ndarray
    hessian: np.ndarray
    bread: np.ndarray


def _sample(surface: Surface, theta: Array, wi, wo, wm, measured, noise):
    """Of one sample: the log ratios r (bands,), and their derivatives (bands, 6 + m) by the shape and by a band's own m entries."""
    shape, own = theta[: len(SHAPE)], theta[len(SHAPE) :].reshape(-1, len(measured)).T
    cosine = wi[0] * wm[0] + wi[1] * wm[1] + wi[2] * wm[2]
    # The lobe's derivatives are the same in all bands, and a band's own entries move that band alone: 6 tangents serve all.
    lobe, tangent = jax.linearize(lambda shape: models.specular(shape, wi, wo, wm, surface), shape)
    slope = jax.vmap(tangent)(jnp.eye(len(SHAPE), dtype=theta.dtype))

    def band(entries, f):
        F, dF = jax.value_and_grad(lambda e: models.reflectance(cosine, tuple(e), surface.fresnel))(entries[:-1])
        base = models.diffuse(entries[-1])
        radiance = (lobe * F + base) * wo[2] + noise
        derivative = jnp.concatenate([slope * F, lobe * dF, base[None]])
        return jnp.log(radiance / (f * wo[2] + noise)), derivative * (wo[2] / radiance)

    return jax.vmap(band)(own, measured)


# Its results are the fields of Each.
@partial(jax.jit, static_argnames=("surface",))
def _call(surface: Surface, theta: Array, samples: tuple[Array, ...], weights: Array) -> tuple[Array, ...]:
    def row(theta, samples, weights):
        r, J = jax.vmap(partial(_sample, surface, theta), in_axes=-1, out_axes=-1)(*samples)
        bands, own = len(r), J.shape[1] - len(SHAPE)
        s = jnp.sqrt(1 + r * r)
        losses, scores = r * r / (1 + s), J * (weights * r / s / bands)[:, None]
        split = scores[:, len(SHAPE) :].swapaxes(0, 1).reshape(own * bands, -1)
        # Where the entries that a band moves are in θ: (bands, 6 + m, p).
        place = np.zeros((bands, J.shape[1], len(theta)))
        for b in range(bands):
            place[b, range(J.shape[1]), [*range(len(SHAPE)), *(len(SHAPE) + e * bands + b for e in range(own))]] = 1

        def matrix(weight):
            return jnp.einsum("bip,bij,bjq->pq", place, jnp.einsum("bin,bjn->bij", J * weight[:, None], J), place)

        weight = weights / s / bands
        both = jnp.concatenate([scores[:, : len(SHAPE)].sum(axis=0), split])
        return losses, both, matrix(weight), matrix(weight / (s * s))

    return jax.vmap(row)(theta, samples, weights)


def each(surface: Surface, theta: np.ndarray, rows: Rows, which: np.ndarray, weights: np.ndarray) -> list[Each]:
    """The rows with the numbers `which` at θ (r, p) and with `weights` (r, 256), in pieces of 16, the last one cut short."""
    devices = jax.local_devices()

    def call(number: int) -> Each:
        part = slice(number * CALL, (number + 1) * CALL)
        size = len(which[part])
        # A short call is filled up with its last row: every call has the one compiled shape.
        fill = np.minimum(np.arange(CALL), size - 1)
        chosen = which[part][fill]
        # The configuration belongs to a thread.
        with solver.float64(), jax.default_device(devices[number % len(devices)]):
            found = _call(surface, theta[part][fill], tuple(a[chosen] for a in rows.samples), weights[part][fill])
            return Each(*(np.asarray(array)[:size] for array in found))

    count = -(-len(which) // CALL)
    if count == 1:
        return [call(0)]
    with ThreadPoolExecutor(max(os.cpu_count() or 1, len(devices))) as pool:
        return list(pool.map(call, range(count)))


class Lanes(NamedTuple):
    """Problems to solve side by side. `which`: of each lane, the numbers of its rows; `weights`: those rows', (rows, 256)."""

    surface: Surface
    rows: Rows
    which: list[np.ndarray]
    weights: list[np.ndarray]

    @property
    def total(self) -> np.ndarray:
        return np.array([weights.sum() for weights in self.weights])

    @property
    def samples(self) -> np.ndarray:
        return np.array([np.count_nonzero(weights) for weights in self.weights])

    def terms(self, theta: np.ndarray, lanes: np.ndarray) -> Terms:
        """The mean loss of these lanes, its gradient and the matrix like its Hessian."""
        owner = np.repeat(np.arange(len(lanes)), [len(self.which[k]) for k in lanes])
        which = np.concatenate([self.which[k] for k in lanes])
        weights = np.concatenate([self.weights[k] for k in lanes])
        pieces = each(self.surface, theta[owner], self.rows, which, weights)
        loss = np.concatenate([piece.losses.mean(axis=1) for piece in pieces])
        sums = (loss * weights).sum(axis=1), *(np.concatenate(list(part)) for part in zip(
            *((piece.scores.sum(axis=-1), piece.hessian) for piece in pieces), strict=True))  # fmt: skip
        starts = np.searchsorted(owner, np.arange(len(lanes)))
        total = self.total[lanes]
        return Terms(*(np.add.reduceat(s, starts) / total.reshape(-1, *[1] * (s.ndim - 1)) for s in sums))
