"""The lune's point of the unit sphere in two words: between the disk and the micronormal lie thirty roundings, and what an
anisotropic or skewed ellipsoid makes of each is many times as large.

In the frame of the pole: its coordinates are those of a canonical matrix, so that a micronormal's height is the point's own.
"""

import jax
import jax.numpy as jnp
from jax import lax

from ggxref import _special, stable
from ggxref._errorfree import two_sum
from ggxref._matrix import length
from ggxref._pairs import (
    Pair,
    Pairs,
    choice,
    less,
    minus,
    one_pass,
    or_one,
    product,
    ratio,
    scaled,
    square_root,
    sum_by_squares,
    total,
)
from ggxref._types import Scalar, Vec2
from ggxref.sampling._ellipsoid import Two, ray
from ggxref.sampling._sphere import crescent, incident


def _square(u):
    """The disk's square: which half, its coordinates `2u - 1` the larger first, and `1 - |r|`, exact."""
    a, b = (two_sum(2 * x, -jnp.ones_like(x)) for x in (u[0], u[1]))
    wide = jnp.abs(a[0]) > jnp.abs(b[0])
    edge = 2 * jnp.minimum(jnp.minimum(u[0], 1 - u[0]), jnp.minimum(u[1], 1 - u[1]))
    return wide, choice(wide, a, b), choice(wide, b, a), edge


def _concentric(u: Vec2) -> Pairs:
    """Point of the unit disk and its `1 - r²`: walter2014 (34)–(37) (Shirley & Chiu 1997)."""
    wide, r, other, edge = _square(u)
    c, s = _special.cos_sin_eighth(ratio(other, or_one(r[0] != 0, scaled(r, 8))))
    rim = product((edge, jnp.zeros_like(edge)), two_sum(jnp.full_like(edge, 2), -edge))
    return product(r, choice(wide, c, s)), product(r, choice(wide, s, c)), rim


def _chord(along: Pair, rim: Pair) -> Pairs:
    """Half of the disk's chord through the point, and the two parts that the point cuts it in."""
    half = square_root(total(rim, product(along, along)))
    up = along[0] > 0
    far = total(half, choice(up, along, minus(along)))
    near = ratio(rim, or_one(far[0] > 0, far))
    return half, choice(up, near, far), choice(up, far, near)


def _compressed(half: Pair, below_rim: Pair, above_rim: Pair, z: Pair, rise: Pair, fall: Pair) -> Pairs:
    """The point in i's frame, towards the pole and along `i`, times N; then the height's numerator: walter2014 (38)–(41)."""
    share, level = scaled(product(rise, above_rim), 0.5), product(half, z)
    moved = less(share, level)
    lifted = square_root(product(scaled(product(rise, below_rim), 0.5), total(product(half, fall), share)))
    return moved, lifted, product(share, less(level, moved))


def _tilted(moved: Pair, lifted: Pair, numerator: Pair, z: Pair, flat: Pair, norm_square: Pair) -> tuple[Pair, Pair]:
    """The point away from the pole, towards `i`, and its height, both times N²."""
    height = sum_by_squares(product(lifted, z), product(moved, flat), product(numerator, norm_square))
    return less(product(flat, lifted), product(z, moved)), height


@jax.custom_jvp
def point(u: Vec2, i: Pairs, side: Scalar, pole: Two) -> Pairs:
    """`plain_point` in two words, times a number near 1.

    - `i`: along A ω_i for a canonical `A`, its largest component near 1.
    """
    z = i[2]
    X, Y, S, flat, norm_square, rise, fall = one_pass(*ray(i, pole))
    along, across, rim = _concentric(u)
    along, across, rim = one_pass(along, scaled(across, side), rim)
    half, below_rim, above_rim = one_pass(*_chord(along, rim))
    moved, lifted, numerator = one_pass(*_compressed(half, below_rim, above_rim, z, rise, fall))
    out, height = _tilted(moved, lifted, numerator, z, flat, norm_square)
    out, height = one_pass(out, product(S, height))
    across = product(across, norm_square)
    x, y = total(product(out, X), product(across, Y)), less(product(out, Y), product(across, X))
    return x, y, height


@point.defjvp
def _point_jvp(primals, tangents):
    """A direction does not depend on the length of what it is made of, which is taken as constant."""
    u, i, side, pole = primals
    du, di, _, dpole = tangents
    values = point(*primals)
    size = lax.stop_gradient(length(*(hi for hi, _ in values)))
    hi, dhi = tuple(hi for hi, _ in i), tuple(d for d, _ in di)
    _, change = jax.jvp(lambda u, i, pole: plain_point(u, i, side, pole), (u, hi, pole), (du, dhi, dpole))
    x, y, z = ((size * d, jnp.zeros_like(d)) for d in change)
    return values, (x, y, z)


def plain_point(u: Vec2, i: tuple[Scalar, Scalar, Scalar], side: Scalar, pole: Two) -> tuple[Scalar, Scalar, Scalar]:
    """The disk's point, compressed to the crescent that `i` sees, lifted to the sphere, and turned to the frame of the pole.

    - `side`: -1 where a reflection made the matrix canonical. `pole`: cosine and sine of the azimuth of an `i` without one, times a number.
    """
    w = incident(*i)
    wide, (r, _), (other, _), edge = _square(u)
    c, s = _special.cos_sin_turn(other / (8 * jnp.where(r == 0, 1, r)))
    along, across = r * jnp.where(wide, c, s), side * r * jnp.where(wide, s, c)
    sin_theta, (cosine, sine) = length(w.x, w.y, 0), stable.azimuth(w.x, w.y, stable.azimuth(*pole))
    outward, height = crescent(along, edge * (2 - edge), w, sin_theta)
    return outward * cosine + across * sine, outward * sine - across * cosine, height
