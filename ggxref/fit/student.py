r"""Projected area of surfaces with Student-t slopes, which Smith's G1 needs, for any tail γ > 3/2.

The slopes of `ndf.student_t` along one azimuth have a Student-t distribution with ν = 2γ − 2 degrees of freedom. At γ = 3/2
their mean length, and with it the area of the surface, becomes infinite, and nothing is left visible: that is the bound.
"""

import math

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

# The integrand's power at 0 is fractional. Cubed nodes make it flat there, and 24 of them reach 1e-10 up to γ = 10 and 1e-5 at 30.
_NODES, _WEIGHTS = (array for array in np.polynomial.legendre.leggauss(24))
_NODES, _WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2
_CUBES, _JACOBIAN = _NODES**3, 3 * _NODES**2 * _WEIGHTS


GAUSSIAN = 30.0


def _powers(psi, nu):
    """sin^(ν−1) at the nodes of [0, ψ] times their weights, and the logarithms of the sines there."""
    logarithm = jnp.log(jnp.sin(psi * _CUBES))
    return psi * _JACOBIAN * jnp.exp((nu - 1) * logarithm), logarithm


@jax.custom_jvp
def sine_integral(psi: Array, nu: Array) -> Array:
    r"""$\int_0^\psi \sin^{\nu-1}$ for ψ in (0, π/2] and ν > 1."""
    return jnp.sum(_powers(psi, nu)[0])


@sine_integral.defjvp
def _sine_integral_jvp(primals, tangents):
    (psi, nu), (d_psi, d_nu) = primals, tangents
    powers, logarithm = _powers(psi, nu)
    return jnp.sum(powers), jnp.sin(psi) ** (nu - 1) * d_psi + jnp.sum(powers * logarithm) * d_nu


def sigma(w: Array, gamma: Array) -> Array:
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
    # Beyond π/2 the integrand's peak would lie between the nodes; K times the whole of it is 1.
    psi = jnp.arctan2(r, jnp.abs(w[2]))
    K = jnp.exp(jax.lax.lgamma(gamma - 0.5) - jax.lax.lgamma(gamma - 1)) / math.sqrt(math.pi)
    part = K * sine_integral(psi, nu)
    area = w[2] * jnp.where(w[2] < 0, part, 1 - part) + K * r / (nu - 1) * jnp.sin(psi) ** (nu - 1)
    return jnp.where(slanted, area, w[2])
