"""Visible GGX normals through the cross-section of the hemisphere: the method of 2018 (dupuy2023 §2)."""

import jax
import jax.numpy as jnp
from jax import lax

from ggxref import _special, stable
from ggxref._matrix import length
from ggxref._types import Scalar, Turn, Vec2, Vec3
from ggxref.sampling._sphere import crescent, incident, sinking
from ggxref.sampling._visible import pdf_ggx as pdf

__all__ = ["pdf", "sample"]


def _azimuth(i):
    # The listing's w1 = (-sin, cos, 0) and w2 = (-z cos, -z sin, sin_theta) in the azimuth of wi; w1 = x at the pole.
    return stable.azimuth(i.x, i.y, pole=(0.0, -1.0))


def _stretched(wi, alpha):
    """`incident` of the stretched `wi`, and the sine of its inclination."""
    i = incident(alpha[0] * wi[0], alpha[1] * wi[1], wi[2])
    return i, stable.sqrt(i.x * i.x + i.y * i.y)


@jax.custom_jvp
def _micronormal(along: Scalar, across: Scalar, rim: Scalar, wi: Vec3, alpha: Vec2) -> tuple[Scalar, Scalar, Scalar]:
    """The disk's point lifted to the hemisphere and unstretched; not normalised."""
    i, sin_theta = _stretched(wi, alpha)
    outward, z = crescent(along, rim, i, sin_theta)
    cos_i, sin_i = _azimuth(i)
    return alpha[0] * (cos_i * outward - sin_i * across), alpha[1] * (sin_i * outward + cos_i * across), z


@_micronormal.defjvp
def _micronormal_jvp(primals, tangents):
    """By `alpha`, what turns the incident direction and what unstretches the normal are taken together, as they cancel."""
    (along, a, rim, wi, alpha), (dalong, da, drim, dwi, dalpha) = primals, tangents
    (i, sin_theta), (ax, ay) = _stretched(wi, alpha), alpha
    c, s = _azimuth(i)
    (o, z), (do, dz) = jax.jvp(lambda along, rim: crescent(along, rim, i, sin_theta), (along, rim), (dalong, drim))
    # By ω_i: as the stretched one sinks, and as it turns about the pole.
    share, rest, by_i, by_pole = sinking(along, rim, i, sin_theta)
    p, q, dp, dq = ax * wi[0], ay * wi[1], ax * dwi[0], ay * dwi[1]
    # Not their squares, whose squares are divisors of the second derivatives.
    norm, size = length(p, q, wi[2]), length(p, q, 0)
    sink = share * (i.z * (c * dp + s * dq) - sin_theta * dwi[2]) / jnp.where(norm > 0, norm, 1)
    turn = jnp.where(size > 0, c * dq - s * dp, 0) / jnp.where(size > 0, size, 1)
    do, da, dz = do + z * sink - a * turn, da + o * turn, dz - o * sink
    one, (by_x, by_y, by_z) = _by_alpha((o, a), (share, rest, by_i, by_pole), (i.z, sin_theta), (c, s), alpha, dalpha)
    dx, dy, dz = ax * (c * do - s * da + by_x), ay * (s * do + c * da + by_y), dz + by_z
    return _micronormal(*primals), (one * dx, one * dy, one * dz)


def _by_alpha(point, sinking, inclination, azimuth, alpha, dalpha):
    """By alpha, how the point changes, but for its scale, before it is unstretched; and 1, whose derivative is what was left out.

    The point is a sum along i, towards the pole and across. The micronormal of the second part is perpendicular to ω_i: in their
    plane it is that whatever alpha is, and all of its change is one of length. Where it is the longest, that is left out.
    """
    (o, a), (share, rest, by_i, by_pole), (z, w), (c, s) = point, sinking, inclination, azimuth
    flat, wide = (alpha[0] * c) ** 2 + (alpha[1] * s) ** 2, (alpha[0] * s) ** 2 + (alpha[1] * c) ** 2
    others = (flat * w * w + z * z) * by_i**2 + wide * a * a
    upright = (by_pole > 0) & ((flat * z * z + w * w) * by_pole**2 > others)

    def longer(x, y):
        return jnp.where(upright, share * z * z * (c * c * x + s * s * y), 0)

    x, y = dalpha[0] / alpha[0], dalpha[1] / alpha[1]
    stretch, across = c * c * x + s * s * y, (s * s * x + c * c * y - longer(x, y)) * a
    # In o = w by_i - z by_pole the changes along the azimuth are 2x o + stretch (w z share h - o), h the point's height, and the same
    # of y: beside the pole, where w and by_pole are small, that cancels in one way, and less what is left out in another.
    both = jnp.where(
        upright, w * by_i - z * rest * by_pole, z * (1 + w * w * share) * by_pole - w * (w * w + z * z * rest) * by_i
    )
    of_x, of_y = jnp.where(upright, 2 * s * s * (x - y), 2 * x), jnp.where(upright, 2 * c * c * (y - x), 2 * y)
    by_x, by_y = c * (of_x * o + stretch * both) - s * across, s * (of_y * o + stretch * both) + c * across
    by_z = -share * z * stretch * jnp.where(upright, by_i, w * o)
    return 1 - longer(*((alpha - lax.stop_gradient(alpha)) / alpha)), (by_x, by_y, by_z)


@stable.widened
def sample(u: Vec2, wi: Vec3, alpha: Vec2, *, turn: Turn = _special.cos_sin_turn) -> Vec3:
    """Stretch `wi`, draw a point of the hemisphere's silhouette, lift it to the hemisphere, unstretch.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), anywhere but straight below. `alpha`: positive, (2,).
    - `turn`: the form of cos 2πu and sin 2πu.
    - Returns a micronormal with density `pdf`: unit, (3,), above the horizon.

    dupuy2023 listings 1 and 2 (Heitz 2018).
    """
    cos_phi, sin_phi = turn(u[0])
    r = stable.sqrt(u[1])
    return stable.direction(*_micronormal(r * sin_phi, r * cos_phi, 1 - u[1], wi, alpha))
