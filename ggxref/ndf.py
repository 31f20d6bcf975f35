r"""Normal distribution functions D: density of micronormals per unit solid angle and unit area of macrosurface [1/sr].

$\int D(\omega_m)\,(\omega_m\cdot n)\,d\omega_m = 1$ (heitz2014 (1)). `wm` is unit, (3,); D is 0 where $\omega_m\cdot n \le 0$, and NaN of NaN.
`alpha` is $(\alpha_x, \alpha_y)$, positive, (2,).
"""

import math

import jax.numpy as jnp
from jax import lax

from ggxref import _squares, stable
from ggxref._matrix import near_one
from ggxref._types import Mat3, Real, Scalar, Vec2, Vec3
from ggxref.ellipsoid import inverse_square
from ggxref.slopes import gaussian, student


def hemisphere(wm: Vec3) -> Scalar:
    r"""$D = \chi^+(\omega_m\cdot n)/\pi$: GGX at α = 1. dupuy2023 (3)."""
    z = wm[2]
    return jnp.where(z > 0, 1 / math.pi, jnp.where(z <= 0, 0, z)).astype(wm.dtype)


@stable.widened
def ggx(wm: Vec3, alpha: Vec2) -> Scalar:
    r"""Anisotropic GGX: $D = 1 / (\pi\alpha_x\alpha_y (x^2/\alpha_x^2 + y^2/\alpha_y^2 + z^2)^2)$.

    tokuyoshi2024; dupuy2023 (12); walter2014 (1) with A = diag(αx, αy, 1).
    """
    # A sum of squares: cos²(α² − 1) + 1, its equal on unit vectors, has lost every digit at α = 1e-4.
    q = _squares.stretched_square(wm, alpha)
    D = _squares.lobe(alpha[0], alpha[1], q)
    return jnp.where(wm[2] <= 0, 0, D)


@stable.widened
def beckmann(wm: Vec3, alpha: Vec2) -> Scalar:
    r"""Anisotropic Beckmann: $D = \exp(-(x^2/\alpha_x^2 + y^2/\alpha_y^2)/z^2) / (\pi\alpha_x\alpha_y z^4)$.

    heitz2014 §5 (Beckmann slopes over z⁴).
    """
    return beckmann_times(wm, alpha, 1.0)


def beckmann_times(wm: Vec3, alpha: Vec2, factor: Real) -> Scalar:
    """`beckmann` times a factor, by which its tails may be within the dtype's range where D itself is not.

    - `wm`: unit, (3,). `alpha`: positive, (2,). `factor`: a number.
    """
    below = wm[2] <= 0
    value = gaussian(wm[0], wm[1], jnp.where(below, 1, wm[2]), alpha, factor, stable.excess(wm))
    return jnp.where(below, 0, value)


@stable.widened
def student_t(wm: Vec3, alpha: Vec2, gamma: Real) -> Scalar:
    r"""Student-t slopes: $D = \frac{(\gamma-1)^\gamma}{\pi\alpha_x\alpha_y z^4 (\gamma - 1 + (x^2/\alpha_x^2 + y^2/\alpha_y^2)/z^2)^\gamma}$.

    - `gamma > 1`: 2 is GGX, infinity Beckmann; below 2, D has no bound towards the horizon.

    Ribardière et al. 2017.
    """
    below, longer = wm[2] <= 0, lax.stop_gradient(stable.excess(wm))
    z, gamma = jnp.where(below, 1, wm[2]), jnp.asarray(gamma, wm.dtype)
    D = student(wm[0], wm[1], z, alpha[0], alpha[1], gamma, longer)
    return jnp.where(below, 0, D)


@stable.widened
def ellipsoid(wm: Vec3, A: Mat3) -> Scalar:
    r"""Ellipsoid NDF: $D = \chi^+(\omega_m\cdot n) / (\pi\,|A|\,\|A n\|\,\|A^{-T}\omega_m\|^4)$.

    Unchanged by `A -> c A` and by `A -> Q A` with `Q` orthogonal; `A = diag(αx, αy, 1)` is anisotropic GGX.

    - `A`: shape matrix, (3, 3), non-singular, of either sign; see `ellipsoid`.

    walter2014 (1).
    """
    A, _ = near_one(A)
    return ellipsoid_of(wm, A, *inverse_square(wm, A))


def ellipsoid_of(wm: Vec3, A: Mat3, q: Scalar, det: Scalar) -> Scalar:
    """`ellipsoid` from what `inverse_square(wm, A)` gave."""
    An = jnp.sqrt(stable.dot(A[:, 2], A[:, 2]))
    D = _squares.lobe(det, An, q)
    return jnp.where(wm[2] <= 0, 0, D)
