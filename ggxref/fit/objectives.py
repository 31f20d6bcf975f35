r"""What a fit minimises: a mean over samples of a loss, for reflectance and for slopes.

**Reflectance**: the residual is $r = \log\frac{\hat f \cos\theta_o + \epsilon}{f \cos\theta_o + \epsilon}$, relative where the
instrument sees well and absolute below its noise ε; its loss is the pseudo-Huber $\sqrt{1 + r^2} - 1$, quadratic to a factor
of e and linear beyond. **Slopes**: minus the log-likelihood, $-\log P^{22}$.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from ggxref.fit import models


class Objective(NamedTuple):
    """`loss(theta, sample)` of one sample, and where the loss is half a sum of squares, `residual` with those squares."""

    loss: Callable[[Array, tuple[Array, ...]], Array]
    residual: Callable[[Array, tuple[Array, ...]], Array] | None


def log_ratio(theta: Array, sample: tuple[Array, ...]) -> Array:
    """r per band. `sample`: wi (3,), wo (3,), wm (3,), f (bands,), ε ()."""
    wi, wo, wm, measured, noise = sample
    model = models.brdf(theta, wi, wo, wm)
    return jnp.log((model * wo[2] + noise) / (measured * wo[2] + noise))


def robust_residual(theta: Array, sample: tuple[Array, ...]) -> Array:
    """Half the square of this is the mean of the pseudo-Huber losses of the bands."""
    r = log_ratio(theta, sample)
    # √(2(√(1 + r²) − 1)) with the sign of r; the plain form cancels at r = 0 and has no derivative there.
    return r * jnp.sqrt(2 / (1 + jnp.sqrt(1 + r * r)) / len(r))


def robust_loss(theta: Array, sample: tuple[Array, ...]) -> Array:
    r = log_ratio(theta, sample)
    return jnp.mean(r * r / (1 + jnp.sqrt(1 + r * r)))


def log_loss(theta: Array, sample: tuple[Array, ...]) -> Array:
    """`sample`: a slope (2,)."""
    return -jnp.log(models.slope_density(theta, sample[0]))


REFLECTANCE = Objective(robust_loss, robust_residual)
SLOPES = Objective(log_loss, None)

NOISE_QUANTILE = 0.01


def noise_floor(values: np.ndarray, wo: np.ndarray) -> float:
    """ε: the value of f cosθo that one positive measurement in a hundred stays below."""
    radiance = np.maximum(values, 0) * wo[:, 2:]
    return float(np.quantile(radiance[radiance > 0], NOISE_QUANTILE))
