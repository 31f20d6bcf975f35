"""Geometry of the unit hemisphere that the linear map turns every GGX and ellipsoid distribution into."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from ggxref import _special, stable
from ggxref._matrix import length, reciprocal_scale
from ggxref._types import Real, Scalar, Turn, Vec2, Vec3


class Incident(NamedTuple):
    """A direction in sphere space, with the sums that would cancel near its poles."""

    x: Scalar
    y: Scalar
    z: Scalar
    rise: Scalar  # 1 + z
    fall: Scalar  # 1 - z


def ray(x: Scalar, y: Scalar, z: Scalar) -> Incident:
    """`incident` times a positive number, ‖v‖ (‖v‖ + |z|) of v = (x, y, z): a half vector needs no more, and no division is left."""
    x, y, z = stable.turning(x, y, z)
    factor, below = stable.sqrt(x * x + y * y + z * z) + jnp.abs(z), z < 0
    # (‖v‖ + |z|) factor and (‖v‖ - |z|) factor, the latter without its cancellation.
    large, small = factor * factor, x * x + y * y
    rise, fall = jnp.where(below, small, large), jnp.where(below, large, small)
    return Incident(factor * x, factor * y, factor * z, rise, fall)


def incident(x: Scalar, y: Scalar, z: Scalar) -> Incident:
    """The sphere-space direction along `(x, y, z)`, which need not be unit."""
    x, y, z = stable.turning(x, y, z)
    square = x * x + y * y
    norm = stable.sqrt(square + z * z)
    norm = jnp.where(norm > 0, norm, 1)
    below = z < 0
    # One of norm + z, norm - z cancels; their product is x² + y².
    large = norm + jnp.abs(z)
    small = square / large
    rise, fall = jnp.where(below, small, large) / norm, jnp.where(below, large, small) / norm
    return Incident(x / norm, y / norm, z / norm, rise, fall)


class Sum(NamedTuple):
    """`i + c`, and what its correction needs."""

    x: Scalar
    y: Scalar
    z: Scalar
    climb: Scalar  # c.z - i.z
    square: Scalar  # c.x² + c.y²


def sum_in_cap(u: Vec2, i: Incident, cut: Real, turn: Turn = _special.cos_sin_turn) -> Sum:
    """`i + c` with `c` uniform on the cap `{z > cut - i.z}`, all in units of i's length.

    `cut = 0` is the whole cap of the reflections of the hemisphere (dupuy2023 listing 3); tokuyoshi2024's is
    `(1 - k) i.z`. The cap's height `1 + i.z - cut` and `c.z + i.z` are formed without
    cancellation, so that half vectors keep z > 0 for every `u` in [0, 1).
    """
    cos_phi, sin_phi = turn(u[0])
    height = i.rise - cut
    depth = u[1] * height  # 1 - c.z
    z = (1 - u[1]) * height + cut
    # Not depth (fall + z): what shares z with it, XLA cuts off from the loop.
    square = depth * ((1 - u[1]) * (i.rise + i.fall) + u[1] * (i.fall + cut))
    sin_theta = stable.sqrt(square)
    return Sum(sin_theta * cos_phi + i.x, sin_theta * sin_phi + i.y, z, i.fall - depth, square)


def half_in_cap(u: Vec2, i: Incident, cut: Real, turn: Turn = _special.cos_sin_turn) -> tuple[Scalar, Scalar, Scalar]:
    r"""`sum_in_cap`, not normalised, with its digits also where `c` is nearly `-i`, at the rim of the cap of a rough surface.

    As `c` is as long as `i`, their sum and difference are perpendicular: $h\cdot(c - i) = 0$. What is left of that product is
    the error of the sum's horizontal part along the azimuth, most of what the sum has lost. Its height is exact.
    """
    h = sum_in_cap(u, i, cut, turn)
    x, y = h.x - 2 * i.x, h.y - 2 * i.y  # c - i
    # Its square by ‖c - i‖² + ‖c + i‖² = 2‖c‖² + 2‖i‖² in the plane: ‖c + i‖² is small wherever a correction matters.
    square = 2 * (h.square + i.rise * i.fall)
    over = lax.stop_gradient(stable.crude_quotient(h.x * x + h.y * y + h.z * h.climb, square))
    return h.x - over * lax.stop_gradient(x), h.y - over * lax.stop_gradient(y), h.z


def _lifted(along, rim, i):
    """The disk point's chord, sqrt(1 - across²), and its parts below and above; of the compressed and lifted point, its coordinates
    towards the pole in i's frame and along `i`.
    """
    s = i.rise / 2
    half_chord = stable.sqrt(rim + along * along)
    opposite = half_chord + jnp.abs(along)
    near = rim / jnp.where(opposite > 0, opposite, 1)
    below_rim = jnp.where(along > 0, near, opposite)  # half_chord - along
    above_rim = jnp.where(along > 0, opposite, near)  # half_chord + along
    # One quantity twice: its first form cancels towards the horizon and below, its second towards the pole.
    moved = jnp.where(i.z < 1 / 3, s * above_rim - half_chord * i.z, half_chord * i.fall / 2 + s * along)
    return half_chord, below_rim, above_rim, moved, stable.sqrt(s * below_rim * (half_chord * i.fall + s * above_rim))


def _crescent(along: Scalar, rim: Scalar, i: Incident, sin_theta: Scalar) -> tuple[Scalar, Scalar]:
    """Compress the unit disk to the silhouette of the lune between `i` and the pole, and lift it to the sphere.

    - `along`: the disk point's coordinate towards the pole; `rim = 1 - r²`, its distance from the rim.
    - `sin_theta = ‖(i.x, i.y)‖`.

    Returns the point's coordinate in the azimuth of `i`, and its height z above the plane through the pole's equator.
    z > 0 in exact arithmetic; here also, as no difference is formed.

    dupuy2023 listing 2; walter2014 (38)–(41).
    """
    half_chord, _, above_rim, moved, lifted = _lifted(along, rim, i)
    # z = lifted i.z + moved sin_theta; where the terms differ in sign, times its conjugate.
    plus, minus = lifted * i.z, moved * sin_theta
    differ = ((plus > 0) & (minus < 0)) | ((plus < 0) & (minus > 0))
    conjugate = jnp.where(differ, plus - minus, 1)
    scale = reciprocal_scale(conjugate)  # of its second derivatives, the divisor is the cube
    z = scale * (i.rise / 2 * above_rim * (half_chord * i.z - moved)) / (scale * conjugate)
    z = jnp.where(differ, z, plus + minus)
    return lifted * sin_theta - moved * i.z, z


def sinking(along: Scalar, rim: Scalar, i: Incident, sin_theta: Scalar) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """The share of i's sinking by which the crescent's point turns about the axis across, and what is left of 1; the point's
    coordinates along `i` and towards the pole.

    What is left is (below_rim/2) sin_theta/lifted, which near the rim may be nearly all. Of `lifted` and (below_rim/2) sin_theta,
    the squares differ by (i.rise/2) rim.
    """
    _, below_rim, _, moved, lifted = _lifted(along, rim, i)
    sunk, divisor = below_rim * sin_theta / 2, jnp.where(lifted > 0, lifted, 1)
    # By one quotient after the other: of their product, the second derivatives have the square.
    share = jnp.where(lifted > 0, i.rise / 2 * rim, 0) / divisor / jnp.where(lifted > 0, lifted + sunk, 1)
    return share, jnp.where(lifted > 0, sunk, 1) / divisor, lifted, moved


crescent = jax.custom_jvp(_crescent)


@crescent.defjvp
def _crescent_jvp(primals, tangents):
    """Where `i` sinks by an angle, the point turns about the axis across by a share of it."""
    along, rim, i, sin_theta = primals
    dalong, drim, di, dsin_theta = tangents
    by_disk = jax.jvp(lambda along, rim: _crescent(along, rim, i, sin_theta), (along, rim), (dalong, drim))
    (outward, z), (doutward, dz) = by_disk
    share, *_ = sinking(along, rim, i, sin_theta)
    turn = share * (i.z * dsin_theta - sin_theta * di.z)
    return (outward, z), (doutward + z * turn, dz - outward * turn)


def unstretch(x: Scalar, y: Scalar, z: Scalar, alpha: Vec2) -> Vec3:
    """The micronormal of the ellipsoid whose sphere-space normal lies along `(x, y, z)`: unit, (3,).

    dupuy2023 listing 1, line 8 (which warps the incident direction instead of the normal: a misprint).
    """
    return stable.direction(alpha[0] * x, alpha[1] * y, z)


@jax.custom_jvp
def _stretched(c: Scalar, s: Scalar, alpha: Vec2) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Of the azimuth with cosine c and sine s, the stretched one's cosine and sine; the cosine times αy and the sine times αx."""
    cosine, sine = stable.azimuth(alpha[0] * c, alpha[1] * s)
    return cosine, sine, alpha[1] * cosine, alpha[0] * sine


@_stretched.defjvp
def _stretched_jvp(primals, tangents):
    """The two products lie along (c, s): by α both change by the same share, in which that of the factors would cancel."""
    (c, s, alpha), (dc, ds, dalpha) = primals, tangents
    cosine, sine, to_y, to_x = values = _stretched(*primals)
    by_x, by_y = dalpha[0] / alpha[0], dalpha[1] / alpha[1]
    share = sine * sine * by_x + cosine * cosine * by_y
    swing = (c * ds - s * dc) * (alpha[0] * alpha[1] / ((alpha[0] * c) ** 2 + (alpha[1] * s) ** 2))
    turn = swing + cosine * sine * (by_y - by_x)
    changes = (
        -sine * turn,
        cosine * turn,
        share * to_y - alpha[1] * sine * swing,
        share * to_x + alpha[0] * cosine * swing,
    )
    return values, changes


def unturned(along: Scalar, across: Scalar, height: Scalar, wi: Vec3, alpha: Vec2) -> tuple[Scalar, Scalar, Scalar]:
    r"""`unstretch` of the normal with these parts along the stretched $\omega_i$, across it and upwards; of any length.

    Unstretched, the direction across is perpendicular to $\omega_i$'s own azimuth, whatever α is. Where its part is the larger one,
    its length is what is held, not the height's: the same change of both would cancel.
    """
    flat = jnp.maximum(jnp.abs(wi[0]), jnp.abs(wi[1]))
    x, y = wi[0] * reciprocal_scale(flat), wi[1] * reciprocal_scale(flat)
    # Beside the pole the derivative, 1/flat, is soon beyond the range; as at the pole, it is 0 then.
    pole = flat * flat == 0
    c, s = stable.azimuth(*(jnp.where(pole, lax.stop_gradient(k), k) for k in (x, y)))
    cos_i, sin_i, to_y, to_x = _stretched(c, s, alpha)
    x, y = alpha[0] * cos_i, alpha[1] * sin_i
    over_width = length(c / alpha[1], s / alpha[0], 0)
    width = lax.stop_gradient(1 / over_width)
    held = (x * x + y * y) * along**2 + height * height < (width * across) ** 2
    share = jnp.where(held, width * over_width, 1)
    along, height = share * along, share * height
    to_x, to_y = jnp.where(held, s * width, to_x), jnp.where(held, c * width, to_y)
    return x * along - to_x * across, y * along + to_y * across, height
