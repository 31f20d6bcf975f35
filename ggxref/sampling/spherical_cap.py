"""Visible GGX normals as half vectors of a uniform spherical cap (dupuy2023)."""

import math

import jax.numpy as jnp

from ggxref import _special, stable
from ggxref._matrix import length
from ggxref._types import Scalar, Turn, Vec2, Vec3
from ggxref.sampling._sphere import half_in_cap, ray, unstretch
from ggxref.sampling._visible import pdf_ggx as pdf

__all__ = ["cap_pdf", "pdf", "sample"]


@stable.widened
def sample(u: Vec2, wi: Vec3, alpha: Vec2, *, turn: Turn = _special.cos_sin_turn) -> Vec3:
    """Stretch `wi`, draw a direction of the cap `{z > -z_i}`, take the half vector, unstretch.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), anywhere but straight below. `alpha`: positive, (2,).
    - `turn`: the form of cos 2πu and sin 2πu.
    - Returns a micronormal with density `pdf`: unit, (3,), above the horizon.

    dupuy2023 listings 1 and 3.
    """
    return unstretch(*half_in_cap(u, ray(alpha[0] * wi[0], alpha[1] * wi[1], wi[2]), 0, turn), alpha)


@stable.widened
def cap_pdf(wo: Vec3, wi: Vec3) -> Scalar:
    r"""Density of the hemisphere's reflections: $1/(2\pi(1+z_i))$ where $z_o > -z_i$, else 0 [1/sr].

    - `wo`, `wi`: unit, (3,), in sphere space.

    dupuy2023 (10).
    """
    square = wi[0] ** 2 + wi[1] ** 2
    below = wi[2] < 0
    height = jnp.where(below, square / jnp.where(below, 1 - wi[2], 1), 1 + wi[2])
    # z_o > −z_i, in the sine of the sum of the polar angles: near the poles the heights have lost the angles.
    sine = length(wi[0], wi[1], 0) * wo[2] + length(wo[0], wo[1], 0) * wi[2]
    inside = (((wi[2] > 0) & (wo[2] > 0)) | (sine > 0)) & (height > 0)
    density = jnp.where(inside, 1 / (2 * math.pi * jnp.where(inside, height, 1)), 0)
    return jnp.where(jnp.isnan(sine), sine, density)
