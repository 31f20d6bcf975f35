"""Visible GGX normals through the cross-section of the hemisphere: the method of 2018 (dupuy2023 §2)."""

import jax
import jax.numpy as jnp

from ggxref import _special, stable
from ggxref._matrix import length
from ggxref._types import Scalar, Turn, Vec2, Vec3
from ggxref.sampling._sphere import Incident, crescent, incident
from ggxref.sampling._visible import pdf_ggx as pdf

__all__ = ["pdf", "sample"]


def _azimuth(i):
    # The listing's w1 = (-sin, cos, 0) and w2 = (-z cos, -z sin, sin_theta) in the azimuth of wi; w1 = x at the pole.
    return stable.azimuth(i.x, i.y, pole=(0.0, -1.0))


@jax.custom_jvp
def _unstretched(outward: Scalar, across: Scalar, i: Incident, wi: Vec3, alpha: Vec2) -> tuple[Scalar, Scalar]:
    """The horizontal part of the micronormal, not normalised. `i`: made of `wi` and `alpha`, by which its derivatives are."""
    cos_i, sin_i = _azimuth(i)
    return alpha[0] * (cos_i * outward - sin_i * across), alpha[1] * (sin_i * outward + cos_i * across)


@_unstretched.defjvp
def _unstretched_jvp(primals, tangents):
    r"""As $\alpha_x \sin\phi_i$ hardly depends on $\alpha_x$ where that is the larger: its derivative is $\sin^3\phi_i$, of which
    the product's rule makes a difference.
    """
    (o, a, i, wi, (ax, ay)), (do, da, _, dwi, (dax, day)) = primals, tangents
    c, s = _azimuth(i)
    p, q = ax * wi[0], ay * wi[1]
    size = length(p, q, 0)  # not its square, whose square is a divisor of the second derivatives
    turn = jnp.where(size > 0, c * (ay * dwi[1]) - s * (ax * dwi[0]), 0) / jnp.where(size > 0, size, 1)
    do, da = do - a * turn, da + o * turn
    dx = ax * (c * do - s * da) + dax * (c * (1 + s * s) * o - s**3 * a) - day * (ax / ay) * c * s * (s * o + c * a)
    dy = ay * (s * do + c * da) + day * (s * (1 + c * c) * o + c**3 * a) + dax * (ay / ax) * c * s * (s * a - c * o)
    return _unstretched(*primals), (dx, dy)


@stable.widened
def sample(u: Vec2, wi: Vec3, alpha: Vec2, *, turn: Turn = _special.cos_sin_turn) -> Vec3:
    """Stretch `wi`, draw a point of the hemisphere's silhouette, lift it to the hemisphere, unstretch.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), anywhere but straight below. `alpha`: positive, (2,).
    - `turn`: the form of cos 2πu and sin 2πu.
    - Returns a micronormal with density `pdf`: unit, (3,), above the horizon.

    dupuy2023 listings 1 and 2 (Heitz 2018).
    """
    i = incident(alpha[0] * wi[0], alpha[1] * wi[1], wi[2])
    cos_phi, sin_phi = turn(u[0])
    r = stable.sqrt(u[1])
    across, along = r * cos_phi, r * sin_phi
    sin_theta = stable.sqrt(i.x * i.x + i.y * i.y)
    outward, z = crescent(along, 1 - u[1], i, sin_theta)
    x, y = _unstretched(outward, across, i, wi, alpha)
    return stable.direction(x, y, z)
