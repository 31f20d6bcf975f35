"""The linear algebra of a shape matrix and of vectors in components: XLA fuses it, where arrays of three would be stored."""

import jax.numpy as jnp
from jax import lax

from ggxref import _pairs, stable
from ggxref._types import Mat3, Real, Scalar


def times(A: Mat3, x: Real, y: Real, z: Real) -> tuple[Scalar, Scalar, Scalar]:
    """`A (x, y, z)` written out: XLA fuses it, and no accelerator computes it in fewer bits than were given."""
    (a, b, c), (d, e, f), (g, h, i) = A
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


@stable.widened
def length(x: Real, y: Real, z: Real) -> Scalar:
    """Euclidean norm of a vector in components; its gradient at the zero vector is 0."""
    return stable.sqrt(x * x + y * y + z * z)


def length_of_pairs(a: _pairs.Pairs) -> _pairs.Pair:
    return _pairs.square_root(_pairs.square_of_pairs(*a))


def normal_square(A: Mat3) -> Scalar:
    r"""$\|A n\|^2$, rounded once. `A`: (3, 3)."""
    n = A[0, 2], A[1, 2], A[2, 2]
    return _pairs.rounded(_pairs.dot(n, n))


def reciprocal_scale(x: Scalar) -> Scalar:
    """A power of two near 1/|x|: a factor that rounds nothing."""
    integer = jnp.int32 if x.dtype == jnp.float32 else jnp.int64
    one, infinity = (lax.bitcast_convert_type(jnp.asarray(c, x.dtype), integer) for c in (1, jnp.inf))
    # By its exponent's bits: a division, which XLA computes once for all its uses, would cut the expression in pieces.
    scale = 2 * one - (lax.bitcast_convert_type(x, integer) & infinity)
    least = lax.bitcast_convert_type(jnp.asarray(jnp.finfo(x.dtype).tiny, x.dtype), integer)
    return lax.stop_gradient(lax.bitcast_convert_type(jnp.maximum(scale, least), x.dtype))


def near_one(A: Mat3) -> tuple[Mat3, Scalar]:
    """`A` times a power of two that brings A n to about 1, and that factor: `c A` is the same distribution, but its minors, of
    which there are products, would leave the range for c = 1e12.
    """
    scale = reciprocal_scale(jnp.abs(A[0, 2]) + jnp.abs(A[1, 2]) + jnp.abs(A[2, 2]))
    return A * scale, scale


def plain_dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def plain_cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
