"""Visible GGX normals from a smaller cap: it leaves out reflections that end below the horizon (tokuyoshi2024)."""

import jax.numpy as jnp

from ggxref import _special, ndf, stable
from ggxref._matrix import length
from ggxref._seen import over_ggx
from ggxref._types import Scalar, Turn, Vec2, Vec3
from ggxref.sampling._sphere import half_in_cap, ray, unstretch


def _bound_terms(wi, alpha):
    """k and 1 − k, each without cancellation."""
    a = jnp.minimum(jnp.minimum(alpha[0], alpha[1]), 1)
    square = (wi[2] / (1 + length(wi[0], wi[1], 0))) ** 2
    denominator = 1 + a * a * square
    below = wi[2] <= 0  # said so that a NaN shows
    k = jnp.where(below, 1, stable.one_minus_square(a) / denominator)
    return k, jnp.where(below, 0, a * a * (1 + square) / denominator)


@stable.widened
def bound(wi: Vec3, alpha: Vec2) -> Scalar:
    r"""$k = (1-a^2)s^2/(s^2 + a^2z_i^2)$, $a = \min(\alpha_x, \alpha_y, 1)$, $s = 1 + \|(x_i, y_i)\|$: the cap ends at $-k z_i'$.

    - `wi`: unit, (3,). 1, no bound, where it is not above the horizon.
    - `alpha`: positive, (2,).

    tokuyoshi2024.
    """
    return _bound_terms(wi, alpha)[0]


@stable.widened
def sample(u: Vec2, wi: Vec3, alpha: Vec2, *, turn: Turn = _special.cos_sin_turn) -> Vec3:
    r"""As `spherical_cap.sample` with the cap $\{z > -k z_i'\}$: only for single reflection.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), anywhere but straight below. `alpha`: positive, (2,).
    - `turn`: the form of cos 2πu and sin 2πu.
    - Returns a micronormal with density `pdf`: unit, (3,), above the horizon.

    tokuyoshi2024.
    """
    i = ray(alpha[0] * wi[0], alpha[1] * wi[1], wi[2])
    return unstretch(*half_in_cap(u, i, _bound_terms(wi, alpha)[1] * i.z, turn), alpha)


@stable.widened
def pdf(wm: Vec3, wi: Vec3, alpha: Vec2) -> Scalar:
    r"""$2 D(\omega_m)\max(0, \omega_i\cdot\omega_m)/(k z_i + \|(\alpha_x x_i, \alpha_y y_i, z_i)\|)$ [1/sr], 0 outside the cap.

    - `wm`, `wi`: unit, (3,). `alpha`: positive, (2,).
    - The article's formula is its value on the cap; every `wm` that reflects `wi` above the horizon lies there. The edge
      is widened by a few ulps, so that no generated sample gets density 0.

    tokuyoshi2024.
    """
    cosine = stable.cosine(wi, wm)
    k, cut = _bound_terms(wi, alpha)
    # o'_z + i'_z = 2 (ωi·ωm) z_m / (norm q) has to reach (1 − k) z_i / norm.
    q = (wm[0] / alpha[0]) ** 2 + (wm[1] / alpha[1]) ** 2 + wm[2] ** 2
    slack = 1 - 16 * float(jnp.finfo(wm.dtype).eps)
    outside = (cosine <= 0) | (2 * cosine * wm[2] < slack * cut * wi[2] * q)  # a NaN is not
    share = over_ggx(tuple(wi), tuple(wm), tuple(alpha), k, cosine)
    return jnp.where(outside, 0, 2 * ndf.ggx(wm, alpha) * share)
