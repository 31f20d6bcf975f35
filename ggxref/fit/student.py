r"""Projected area of surfaces with Student-t slopes, which Smith's G1 needs, for any tail γ > 3/2.

The slopes of `ndf.student_t` along one azimuth have a Student-t distribution with ν = 2γ − 2 degrees of freedom. At γ = 3/2
their mean length, and with it the area of the surface, becomes infinite, and nothing is left visible: that is the bound.
"""

import math

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.polynomial import chebyshev, polynomial

TERMS = 34
"""Of each power series, whose argument is at most 1/2: what is left out is 1e-11 of the sum."""
ORDERS = np.arange(TERMS)
BINOMIAL = np.cumprod(np.r_[1.0, (ORDERS[1:] - 0.5) / ORDERS[1:]])
"""(1/2)_j / j!, the coefficients of 1/√(1 − x)."""

DEGREE = 20
"""Of the polynomial that takes a series' place: on [0, 1/2] a Chebyshev series loses a factor of 3 + √8 a term, a power series 2.
For γ = 30, where far from 45° the integrand is (1 − x)^28, its terms fall later: 15 are 1e-7 off."""


def _economised() -> np.ndarray:
    """(TERMS, DEGREE + 1): from coefficients of powers of x to those of powers of t = 4x − 1, cut as a Chebyshev series."""
    rows, power = [], np.ones(1)
    for _ in ORDERS:
        cut = chebyshev.cheb2poly(chebyshev.poly2cheb(power)[: DEGREE + 1])
        rows.append(np.pad(cut, (0, DEGREE + 1 - len(cut))))
        power = polynomial.polymul(power, [0.25, 0.25])
    return np.array(rows)


ECONOMISED = _economised()

GAUSSIAN = 30.0


def _polynomial(coefficients: Array, x: Array) -> Array:
    """Σ c_j x^j for x in [0, 1/2]. The coefficients hold ν alone, so that many angles share what is made of them here."""
    t, cut = 4 * x - 1, coefficients @ jnp.asarray(ECONOMISED)
    total = cut[DEGREE]
    for k in reversed(range(DEGREE)):
        total = total * t + cut[k]
    return total


def _series(sine: Array, cosine: Array, nu: Array) -> Array:
    r"""With x = sin t, $\int_0^{\sin\psi} x^{\nu-1}(1-x^2)^{-1/2}dx$; past 45° the whole less $\int_0^{\cos\psi}(1-x^2)^{\nu/2-1}dx$."""
    low = sine * sine <= 0.5
    near = _polynomial(jnp.asarray(BINOMIAL) / (nu + 2 * ORDERS), jnp.where(low, sine * sine, 0.5))
    ratios = jnp.concatenate([jnp.ones_like(nu)[None], (ORDERS[1:] - nu / 2) / ORDERS[1:]])
    far = _polynomial(jnp.cumprod(ratios) / (2 * ORDERS + 1), jnp.where(low, 0.5, cosine * cosine))
    whole = math.sqrt(math.pi) / 2 * jnp.exp(jax.lax.lgamma(nu / 2) - jax.lax.lgamma((nu + 1) / 2))
    return jnp.where(low, sine**nu * near, whole - cosine * far)


@jax.custom_jvp
def sine_integral(sine: Array, cosine: Array, nu: Array) -> Array:
    r"""$\int_0^\psi \sin^{\nu-1}$ for ψ in (0, π/2], given by its sine and cosine, and ν > 1."""
    return _series(sine, cosine, nu)


@sine_integral.defjvp
def _sine_integral_jvp(primals, tangents):
    (sine, cosine, nu), (d_sine, d_cosine, d_nu) = primals, tangents
    value, by_nu = jax.jvp(lambda nu: _series(sine, cosine, nu), (nu,), (jnp.ones_like(nu),))
    return value, sine ** (nu - 1) * (cosine * d_sine - sine * d_cosine) + by_nu * d_nu


def sigma(w: Array | tuple[Array, Array, Array], gamma: Array) -> Array:
    r"""$\sigma(w) = \int \max(0, w\cdot m)\,D(m)\,dm$ for `ndf.student_t` with α = 1, and `w` (3,) of any length.

    With $r = \sqrt{\gamma-1}\,\|(x, y)\|$, ψ the angle of (r, z) from z, and $K = \Gamma(\gamma-\frac12)/(\sqrt\pi\,
    \Gamma(\gamma-1))$: $\sigma = z\,(1 - K\int_0^\psi\sin^{2\gamma-3}) + \frac{K r}{2\gamma-3}\sin^{2\gamma-3}\psi$, the
    partial mean of a Student-t variable. At γ = 2 it is `slopes.sigma_ggx`.

    Beyond γ = 30 the area is that of 30, which is within 1.5 % of Beckmann's.
    """
    gamma = jnp.minimum(gamma, GAUSSIAN)
    square = w[0] * w[0] + w[1] * w[1]
    # The inner `where` keeps normal incidence, where the area is z, away from sin^(ν−1) of 0 and its derivative.
    slanted = square > 1e-24 * w[2] * w[2]
    r = jnp.sqrt((gamma - 1) * jnp.where(slanted, square, 1))
    nu = 2 * gamma - 2
    length = jnp.sqrt(r * r + w[2] * w[2])
    sine, cosine = r / length, jnp.abs(w[2]) / length
    K = jnp.exp(jax.lax.lgamma(gamma - 0.5) - jax.lax.lgamma(gamma - 1)) / math.sqrt(math.pi)
    part = K * sine_integral(sine, cosine, nu)
    area = w[2] * jnp.where(w[2] < 0, part, 1 - part) + K * r / (nu - 1) * sine ** (nu - 1)
    return jnp.where(slanted, area, w[2])
