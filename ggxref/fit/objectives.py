r"""What a fit minimises: a mean over samples of a loss, for reflectance and for slopes.

**Reflectance**: the residual is $r = \log\frac{\hat f \cos\theta_o + \epsilon}{f \cos\theta_o + \epsilon}$, relative where the
instrument sees well and absolute below its noise ε; its loss is the pseudo-Huber $\sqrt{1 + r^2} - 1$, quadratic to a factor
of e and linear beyond (`rows`). **Slopes**: minus the log-likelihood, $-\log P^{22}$.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
from jax import Array

from ggxref.fit import models

Loss = Callable[[Array, tuple[Array, ...]], Array]
"""Of θ and one sample."""


@cache
def slopes(tail: str) -> Loss:
    """A sample is a slope (2,)."""

    def loss(theta: Array, sample: tuple[Array, ...]) -> Array:
        return -models.log_slope_density(theta, sample[0], tail)

    return loss


NOISE_QUANTILE = 0.01


def noise_floor(values: np.ndarray, wo: np.ndarray) -> float:
    """ε: the value of f cosθo that one positive measurement in a hundred stays below."""
    radiance = np.maximum(values, 0) * wo[:, 2:]
    return float(np.quantile(radiance[radiance > 0], NOISE_QUANTILE))
