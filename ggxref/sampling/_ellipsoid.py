"""Between directions and the unit sphere that the ellipsoid in canonical form is an image of, in two words: a skewed or
anisotropic ellipsoid makes many of each rounding.
"""

import functools

import jax.numpy as jnp

from ggxref import _pairs, stable
from ggxref._canonical import Canonical
from ggxref._matrix import reciprocal_scale
from ggxref._pairs import Pair, Pairs, Triple
from ggxref._types import Scalar, Vec3

Two = tuple[Scalar, Scalar]


def to_sphere(wi: Vec3, A: Canonical) -> Pairs:
    """`A wi`: along the sphere-space direction. Its sums cancel as soon as `A` is skewed."""
    c00, c10, c11, ex, ey = A
    x, y, z = wi
    return _pairs.dot((c00, c10), (x, y)), _pairs.dot((c11,), (y,)), _pairs.dot((ex, ey, jnp.ones_like(z)), (x, y, z))


def shortened(i: Pairs) -> tuple[Pairs, Scalar]:
    """`i`, which is as long as α, times a power of two that brings its largest component near 1; and that factor."""
    scale = reciprocal_scale(functools.reduce(jnp.maximum, (jnp.abs(c) for c, _ in i)))
    x, y, z = _pairs.one_pass(*(_pairs.scaled(c, scale) for c in i))
    return (x, y, z), scale


def poles(square: Pair, z: Pair) -> tuple[Pair, Pair, Pair]:
    """Of a vector of length N, N² and, without cancellation, N + z and N - z. `square`: N² - z²."""
    norm_square = _pairs.total(square, _pairs.product(z, z))
    below = z[0] < 0
    large = _pairs.total(_pairs.square_root(norm_square), _pairs.choice(below, _pairs.minus(z), z))
    small = _pairs.ratio(square, large)
    return norm_square, _pairs.choice(below, small, large), _pairs.choice(below, large, small)


def ray(i: Pairs, pole: Two) -> tuple[Pair, ...]:
    """Of `i`, of length N: its azimuth times S; then S, N sin θ, N², N + z and N − z. `pole`: the azimuth where it has none."""
    x, y, z = i
    scale = reciprocal_scale(jnp.maximum(jnp.abs(x[0]), jnp.abs(y[0])))
    none, zero = (x[0] == 0) & (y[0] == 0), jnp.zeros_like(x[0])
    X, Y = (
        _pairs.choice(none, (pole[0], zero), _pairs.scaled(x, scale)),
        _pairs.choice(none, (pole[1], zero), _pairs.scaled(y, scale)),
    )
    S = _pairs.square_root(_pairs.square_of_pairs(X, Y))
    flat = _pairs.scaled(S, jnp.where(none, 0, reciprocal_scale(scale)))
    norm_square, rise, fall = poles(_pairs.product(flat, flat), z)
    return X, Y, S, flat, norm_square, rise, fall


def risen(p: Pairs, A: Canonical) -> Pairs:
    """The point, as if its height were constant where most of the normal is that height times (ex, ey, 1), and its x where most
    is x times (c00, c10, 0).
    """
    (x, x_rest), (y, y_rest), (z, z_rest) = p
    c00, c10, c11, ex, ey = A
    by_x, by_y = (c00 + jnp.abs(c10)) * jnp.abs(x), c11 * jnp.abs(y)
    by_z = (1 + jnp.abs(ex) + jnp.abs(ey)) * jnp.abs(z)
    high = by_z > by_x + by_y
    x, y, z = stable.rising(high, x, y, z)
    y, z, x = stable.rising(~high & (by_x > by_y + by_z), y, z, x)
    return (x, x_rest), (y, y_rest), (z, z_rest)


def image(p: Pairs, A: Canonical) -> Triple:
    """`Aᵀ p`. Its height has the sign of p's, exactly."""
    c00, c10, c11, ex, ey = A
    x, _, z = p
    return _pairs.weighted((c00, ex), (x, z)), _pairs.weighted((c10, c11, ey), p), _pairs.rounded(z)


def from_sphere(p: Pairs, A: Canonical) -> Vec3:
    """The micronormal along `Aᵀ p`: unit, (3,)."""
    return stable.direction(*image(risen(p, A), A))
