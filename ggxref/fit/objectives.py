r"""What a fit minimises: a mean over samples of a loss, for reflectance and for slopes.

**Reflectance**: the residual is $r = \log\frac{\hat f \cos\theta_o + \epsilon}{f \cos\theta_o + \epsilon}$, relative where the
instrument sees well and absolute below its noise ε; its loss is the pseudo-Huber $\sqrt{1 + r^2} - 1$, quadratic to a factor
of e and linear beyond. **Slopes**: minus the log-likelihood, $-\log P^{22}$.
"""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from ggxref.fit import models
from ggxref.fit.models import Surface

Sample = tuple[Array, ...]


class Objective(NamedTuple):
    """`loss(theta, sample)` of one sample, and where the loss is half a sum of squares, `residual` with those squares."""

    loss: Callable[[Array, Sample], Array]
    residual: Callable[[Array, Sample], Array] | None


@cache
def reflectance(surface: Surface) -> Objective:
    """A sample is wi (3,), wo (3,), wm (3,), f (bands,), ε ()."""

    def log_ratio(theta: Array, sample: Sample) -> Array:
        wi, wo, wm, measured, noise = sample
        model = models.brdf(theta, wi, wo, wm, surface)
        return jnp.log((model * wo[2] + noise) / (measured * wo[2] + noise))

    def loss(theta: Array, sample: Sample) -> Array:
        r = log_ratio(theta, sample)
        return jnp.mean(r * r / (1 + jnp.sqrt(1 + r * r)))

    def residual(theta: Array, sample: Sample) -> Array:
        r = log_ratio(theta, sample)
        # √(2(√(1 + r²) − 1)) with the sign of r; the plain form cancels at r = 0 and has no derivative there.
        return r * jnp.sqrt(2 / (1 + jnp.sqrt(1 + r * r)) / len(r))

    return Objective(loss, residual)


@cache
def slopes(tail: str) -> Objective:
    """A sample is a slope (2,)."""

    def loss(theta: Array, sample: Sample) -> Array:
        return -models.log_slope_density(theta, sample[0], tail)

    return Objective(loss, None)


NOISE_QUANTILE = 0.01


def noise_floor(values: np.ndarray, wo: np.ndarray) -> float:
    """ε: the value of f cosθo that one positive measurement in a hundred stays below."""
    radiance = np.maximum(values, 0) * wo[:, 2:]
    return float(np.quantile(radiance[radiance > 0], NOISE_QUANTILE))
