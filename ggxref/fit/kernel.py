"""The compiled call: of rows of 256 samples the losses and the residuals' derivatives, each row at its own θ.

Samples go in as one array (r, 11 + bands, 256) and what is found comes out as one, as each array that crosses has a cost of its own.
"""

from functools import cache, partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ggxref.fit import models
from ggxref.fit.levenberg import Terms
from ggxref.fit.models import Surface
from ggxref.fit.parameters import SHAPE

ROW = 256
WI, WO, WM, NOISE, WEIGHT, VALUES = slice(0, 3), slice(3, 6), slice(6, 9), 9, 10, slice(11, None)
"""Where in a sample its directions stand, the noise ε, its weight, and f per band."""


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
        return assemble(self.loss, self.products())

    def bread(self) -> np.ndarray:
        """(r, p, p): the Hessian with the loss's own second derivative. Like `terms`' it leaves out the residuals' curvature,
        whose mean the minimum makes small.
        """
        return assemble(self.loss, _products(self.factors / (1 + self.losses[:, :, None]))).hessian

    def scores(self) -> np.ndarray:
        """(r, p, 256): each sample's share of the gradient."""
        size, places = _places(*self.factors.shape[1:3])
        scores = np.zeros((len(self.weights), size, ROW))
        for band, place in enumerate(places):
            scores[:, place] += self.factors[:, band, :-1] * self.factors[:, band, -1:]
        return scores


def _products(factors: np.ndarray) -> np.ndarray:
    return factors[:, :, :-1] @ factors.swapaxes(-1, -2)


@cache
def _places(bands: int, factors: int) -> tuple[int, list[np.ndarray]]:
    """The size of θ, and where in it each band's derivatives belong, (6 + m,)."""
    size = len(SHAPE) + bands * (factors - len(SHAPE) - 1)
    return size, [np.r_[: len(SHAPE), len(SHAPE) + band : size : bands] for band in range(bands)]


def assemble(loss: np.ndarray, products: np.ndarray) -> Terms:
    """From the losses and sums of `Each.products`, (…, bands, 6 + m, 6 + m + 1)."""
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


# `rows.each` has a thread for each core already.
@partial(jax.jit, static_argnames=("surface",), compiler_options={"xla_cpu_multi_thread_eigen": False})
def _call(surface: Surface, theta: Array, samples: Array) -> Array:
    """Of r rows at their θ (r, p): (r, bands, 6 + m + 2, 256), the factors of `Each`, and last the losses."""

    def row(theta, samples):
        wi, wo, wm, measured = (samples[part] for part in (WI, WO, WM, VALUES))
        own = theta[len(SHAPE) :].reshape(-1, len(measured)).T
        lobe, *slopes = jax.vmap(partial(_lobe, surface, tuple(theta[: len(SHAPE)])), -1)(wi, wo, wm)
        cosine = wi[0] * wm[0] + wi[1] * wm[1] + wi[2] * wm[2]

        def band(entries, f):
            of_sample = partial(_band, surface, tuple(entries), len(measured))
            loss, of_lobe, *rest = jax.vmap(of_sample)(f, lobe, cosine, wo[2], samples[NOISE], samples[WEIGHT])
            return [*(slope * of_lobe for slope in slopes), *rest, loss]

        return jax.vmap(band)(own, measured)

    # Without the barrier XLA computes each of them anew for every place in the stack.
    return jnp.stack(jax.lax.optimization_barrier(jax.vmap(row)(theta, samples)), axis=2)


def call(surface: Surface, theta: np.ndarray, samples: np.ndarray, size: int) -> Each:
    """Of the first `size` of these rows."""
    found = np.asarray(_call(surface, theta, samples))[:size]
    return Each(samples[:size, WEIGHT], found[:, :, -1], found[:, :, :-1])
