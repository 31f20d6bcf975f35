r"""Quotients $\omega\cdot m / \sigma(\omega)$, the heart of G1 and of every visible density, with derivatives that do not cancel.

With $s = \|(\alpha_x x, \alpha_y y)\|$, $\sigma = z\,\partial_z\sigma + s\,\partial_s\sigma$. Near normal incidence on a smooth surface
σ is nearly z, the quotient hardly depends on ω, and the two terms of the quotient rule for z cancel down to
$(m_z\,s\,\partial_s\sigma - (x m_x + y m_y)\,\partial_z\sigma)/\sigma^2$. The cosine comes from outside, in as many digits as it needs.
"""

import math

import jax
import jax.numpy as jnp
from jax.scipy.special import erfc

from ggxref import _squares, stable
from ggxref._pairs import Triple
from ggxref._types import Real, Scalar

Two = tuple[Scalar, Scalar]


@jax.custom_jvp
def over_ggx(w: Triple, m: Triple, alpha: Two, k: Real, cosine: Scalar) -> Scalar:
    r"""$\omega\cdot m/(k z + \|(\alpha_x x, \alpha_y y, z)\|)$: the denominator is 2σ for `k = 1`, as it must be for z < 0.

    0 where the denominator underflows. `cosine` is $\omega\cdot m$.
    """
    return cosine / _unless_underflown(area_ggx(w, alpha, k))


def _square(w, alpha):
    """s²."""
    return (alpha[0] * w[0]) ** 2 + (alpha[1] * w[1]) ** 2


def area_ggx(w: Triple, alpha: Two, k: Real) -> Scalar:
    """The denominator of `over_ggx`."""
    square = _squares.scaled_square(w, alpha)
    t = stable.sqrt(square + w[2] ** 2)
    below = w[2] < 0
    return jnp.where(below, square / jnp.where(below, t - w[2], 1), t + k * w[2])  # t + z cancels below the horizon


def _unless_underflown(area):
    return jnp.where(area < jnp.finfo(area.dtype).tiny, jnp.inf, area)


@over_ggx.defjvp
def _over_ggx_jvp(primals, tangents):
    w, _, alpha, k, cosine = primals
    square, area = _square(w, alpha), _unless_underflown(area_ggx(w, alpha, k))
    t = stable.sqrt(square + w[2] ** 2)
    t = jnp.where(t > 0, t, 1)
    by_z = jnp.where(w[2] < 0, area / t, w[2] / t + k)
    by_z = jnp.where(area < jnp.inf, by_z, 0)
    quotient = cosine / area
    change = _change(primals, tangents, quotient, area, by_z, 1 / t, square / t)
    return quotient, change - quotient * w[2] / area * tangents[3]


@jax.custom_jvp
def over_beckmann(w: Triple, m: Triple, alpha: Two, sigma: Scalar, cosine: Scalar) -> Scalar:
    r"""$\omega\cdot m/\sigma(\omega)$ for Beckmann's σ; 0 where it underflows. `cosine` is $\omega\cdot m$."""
    return cosine / _unless_underflown(sigma)


@over_beckmann.defjvp
def _over_beckmann_jvp(primals, tangents):
    w, _, alpha, sigma, cosine = primals
    square = _square(w, alpha)
    s = jnp.sqrt(jnp.where(square > 0, square, 1))
    a = jnp.where(square > 0, jnp.clip(w[2] / s, -30, 30), 30 * jnp.sign(w[2]))
    by_s = jnp.exp(-a * a) / (2 * math.sqrt(math.pi))
    area = _unless_underflown(sigma)
    quotient = cosine / area
    return quotient, _change(primals, tangents, quotient, area, erfc(-a) / 2, by_s / s, s * by_s)


def _change(primals, tangents, quotient, area, by_z, by_square, s_by_s):
    """Of the quotient; `by_square` is the area's derivative by s²/2."""
    ((x, y, z), (p, q, r), (ax, ay), *_), ((dx, dy, dz), (dp, dq, dr), (dax, day), *_) = primals, tangents
    turned = p * dx + q * dy + x * dp + y * dq + z * dr
    along = (r * (s_by_s / area) - (x * p + y * q) * (by_z / area)) * dz
    half_square = ax * x * (ax * dx + x * dax) + ay * y * (ay * dy + y * day)
    return (turned + along - quotient * (by_square * half_square)) / area
