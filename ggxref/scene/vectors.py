"""Vectors of many lanes: tuples (x, y, z) of arrays (n,), or a (3,) array that all lanes share.

The renderer is written on these, not under `vmap`: there, what mixes a lane's number with its vector is transposed to and
fro, and each stacked vector is a concatenation that XLA writes element by element. Only the formulas are mapped.
"""

from collections.abc import Sequence
from typing import TypeVar

import jax
import jax.numpy as jnp
from jax import Array

from ggxref import _special, stable

Tree = TypeVar("Tree")
Vector = tuple[Array, Array, Array]
AnyVector = Sequence[Array] | Array

turn = jax.vmap(_special.cos_sin_turn)
azimuth = jax.vmap(stable.azimuth)


def root(x: Array) -> Array:
    """Square root; of the negative number that rounding may leave, 0."""
    return jnp.sqrt(jnp.maximum(x, 0))


def dot(a: AnyVector, b: AnyVector) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: AnyVector, b: AnyVector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def scale(s: Array | float, a: AnyVector) -> Vector:
    return s * a[0], s * a[1], s * a[2]


def unit(a: AnyVector) -> Vector:
    return scale(1 / jnp.sqrt(dot(a, a)), a)


def minus(a: AnyVector, b: AnyVector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def ahead(origin: AnyVector, distance: Array, direction: AnyVector) -> Vector:
    """origin + distance · direction."""
    return tuple(o + distance * d for o, d in zip(origin, direction, strict=True))  # pyright: ignore[reportReturnType]


def combine(w: AnyVector, t: AnyVector, b: AnyVector, n: AnyVector) -> Vector:
    """The vector with coordinates `w` in the frame (t, b, n)."""
    return ahead(ahead(scale(w[0], t), w[1], b), w[2], n)


def select(condition: Array, a: Tree, b: Tree) -> Tree:
    """`where` for vectors and other trees of arrays (n,)."""
    return jax.tree.map(lambda x, y: jnp.where(condition, x, y), a, b)
