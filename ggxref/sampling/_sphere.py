"""Geometry of the unit hemisphere that the linear map turns every GGX and ellipsoid distribution into."""

from typing import NamedTuple

import jax.numpy as jnp

from ggxref import _special, stable
from ggxref._types import Real, Scalar, Turn, Vec2, Vec3


class Incident(NamedTuple):
    """A direction in sphere space, with the sums that would cancel near its poles."""

    x: Scalar
    y: Scalar
    z: Scalar
    norm: Scalar  # its length before it was normalised
    rise: Scalar  # 1 + z
    fall: Scalar  # 1 - z


def ray(x: Scalar, y: Scalar, z: Scalar) -> Incident:
    """`incident` times a positive factor, ‖(x, y, z)‖ + |z|: a half vector needs no more, and no division is left."""
    x, y, z = stable.turning(x, y, z)
    square = x * x + y * y
    norm = stable.sqrt(square + z * z)
    below = z < 0
    factor = norm + jnp.abs(z)
    # (norm + |z|) factor and (norm - |z|) factor, the latter without its cancellation.
    large, small = factor * factor, square
    rise, fall = jnp.where(below, small, large), jnp.where(below, large, small)
    return Incident(factor * x, factor * y, factor * z, norm, rise, fall)


def incident(x: Scalar, y: Scalar, z: Scalar) -> Incident:
    """The sphere-space direction along `(x, y, z)`, which need not be unit."""
    length = stable.sqrt(x * x + y * y + z * z)
    x, y, z = stable.turning(x, y, z)
    square = x * x + y * y
    norm = stable.sqrt(square + z * z)
    norm = jnp.where(norm > 0, norm, 1)
    below = z < 0
    # One of norm + z, norm - z cancels; their product is x² + y².
    large = norm + jnp.abs(z)
    small = square / large
    rise, fall = jnp.where(below, small, large) / norm, jnp.where(below, large, small) / norm
    return Incident(x / norm, y / norm, z / norm, length, rise, fall)


def half_in_cap(u: Vec2, i: Incident, cut: Real, turn: Turn = _special.cos_sin_turn) -> tuple[Scalar, Scalar, Scalar]:
    """`i + c` (not normalised) with `c` uniform on the cap `{z > cut - i.z}`, all in units of i's length.

    `cut = 0` is the whole cap of the reflections of the hemisphere (dupuy2023 listing 3); tokuyoshi2024's is
    `(1 - k) i.z`. The cap's height `1 + i.z - cut`, its complement to 2 and `c.z + i.z` are all formed without
    cancellation, so that half vectors keep z > 0 for every `u` in [0, 1).
    """
    cos_phi, sin_phi = turn(u[0])
    height, rest = i.rise - cut, i.fall + cut
    depth = u[1] * height  # 1 - c.z
    sin_theta = stable.sqrt(depth * ((1 - u[1]) * (i.rise + i.fall) + u[1] * rest))
    return sin_theta * cos_phi + i.x, sin_theta * sin_phi + i.y, (1 - u[1]) * height + cut


def crescent(along: Scalar, rim: Scalar, i: Incident, sin_theta: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Compress the unit disk to the silhouette of the lune between `i` and the pole, and lift it to the sphere.

    - `along`: the disk point's coordinate towards the pole; `rim = 1 - r²`, its distance from the rim.
    - `sin_theta = ‖(i.x, i.y)‖`.

    Returns the point's coordinate towards the pole in i's frame, its coordinate along `i`, and its height z above the
    plane through the pole's equator. z > 0 in exact arithmetic; here also, as no difference is formed.

    dupuy2023 listing 2; walter2014 (38)–(41).
    """
    s = i.rise / 2
    half_chord = stable.sqrt(rim + along * along)  # sqrt(1 - across²)
    opposite = half_chord + jnp.abs(along)
    near = rim / jnp.where(opposite > 0, opposite, 1)
    below_rim = jnp.where(along > 0, near, opposite)  # half_chord - along
    above_rim = jnp.where(along > 0, opposite, near)  # half_chord + along
    # One quantity twice: its first form cancels towards the horizon and below, its second towards the pole.
    moved = jnp.where(i.z < 1 / 3, s * above_rim - half_chord * i.z, half_chord * i.fall / 2 + s * along)
    lifted = stable.sqrt(s * below_rim * (half_chord * i.fall + s * above_rim))
    # z = lifted i.z + moved sin_theta; where the terms differ in sign, times its conjugate.
    plus, minus = lifted * i.z, moved * sin_theta
    differ = ((plus > 0) & (minus < 0)) | ((plus < 0) & (minus > 0))
    conjugate = jnp.where(differ, plus - minus, 1)
    z = jnp.where(differ, s * above_rim * (half_chord * i.z - moved) / conjugate, plus + minus)
    return moved, lifted, z


def unstretch(x: Scalar, y: Scalar, z: Scalar, alpha: Vec2) -> Vec3:
    """The micronormal of the ellipsoid whose sphere-space normal lies along `(x, y, z)`: unit, (3,).

    dupuy2023 listing 1, line 8 (which warps the incident direction instead of the normal: a misprint).
    """
    return stable.direction(alpha[0] * x, alpha[1] * y, z)
