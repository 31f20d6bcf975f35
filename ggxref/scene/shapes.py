"""Shapes with a formula: where rays meet them, and the frames there. World space, z up, lengths of order 1.

Rays are many (`vectors`).
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from ggxref.scene.vectors import AnyVector, Vector, ahead, azimuth, dot, minus, root, scale, select


class Sphere(NamedTuple):
    """Anisotropy follows the parallels: x of the local frame runs round the z axis."""

    center: Array
    radius: Array
    material: Array


class Plane(NamedTuple):
    """Infinite. `tangent` is the local x."""

    point: Array
    normal: Array
    tangent: Array
    material: Array


class Slab(NamedTuple):
    """A box along the axes. Local x is the world's x, and y on the two faces across x."""

    low: Array
    high: Array
    material: Array


Shape = Sphere | Plane | Slab


class Hit(NamedTuple):
    """`distance` is infinite where the ray leaves the scene. `normal` points outward; `material` is a row's number."""

    distance: Array
    normal: Vector
    tangent: Vector
    material: Array


def _sphere(shape: Sphere, origin, direction):
    o = minus(origin, shape.center)
    b = dot(o, direction)
    # |o|² − r² and b² − c both cancel at a distance: the closest point to the centre does not.
    across = ahead(o, -b, direction)
    square = shape.radius**2 - dot(across, across)
    half = root(square)
    near, far = -b - half, half - b
    distance = jnp.where(square > 0, jnp.where(near > 0, near, jnp.where(far > 0, far, jnp.inf)), jnp.inf)
    normal = scale(1 / shape.radius, ahead(o, jnp.where(jnp.isfinite(distance), distance, 0), direction))
    c, s = azimuth(normal[0], normal[1])
    return distance, normal, (-s, c, jnp.zeros_like(c))


def _plane(shape: Plane, origin, direction):
    rate = dot(direction, shape.normal)
    distance = dot(minus(shape.point, origin), shape.normal) / jnp.where(rate == 0, 1, rate)
    return jnp.where((rate != 0) & (distance > 0), distance, jnp.inf), shape.normal, shape.tangent


def _slab(shape: Slab, origin, direction):
    enter, leave = [], []
    for low, high, o, d in zip(shape.low, shape.high, origin, direction, strict=True):
        safe = jnp.where(d == 0, 1e-20, d)
        first, second = (low - o) / safe, (high - o) / safe
        enter.append(jnp.minimum(first, second))
        leave.append(jnp.maximum(first, second))
    near = jnp.maximum(jnp.maximum(enter[0], enter[1]), enter[2])
    far = jnp.minimum(jnp.minimum(leave[0], leave[1]), leave[2])
    outside = near > 0
    distance = jnp.where((near < far) & (far > 0), jnp.where(outside, near, far), jnp.inf)
    across_x, across_y = (jnp.where(outside, enter[k] == near, leave[k] == far) for k in (0, 1))
    on = across_x, across_y & ~across_x, ~across_x & ~across_y
    towards = jnp.where(outside, -1, 1)
    normal = tuple(jnp.where(face, towards * jnp.sign(d), 0) for face, d in zip(on, direction, strict=True))
    one, zero = jnp.ones_like(near), jnp.zeros_like(near)
    return distance, normal, (jnp.where(across_x, zero, one), jnp.where(across_x, one, zero), zero)


_MEETS = {Sphere: _sphere, Plane: _plane, Slab: _slab}


def meet(shapes: Sequence[Shape], origin: AnyVector, direction: Vector) -> Hit:
    """The nearest shape along rays from `origin` along `direction`, unit."""
    zero = jnp.zeros_like(direction[0])
    best = Hit(zero + jnp.inf, (zero, zero, zero), (zero, zero, zero), jnp.zeros(zero.shape, jnp.int32))
    for shape in shapes:
        distance, normal, tangent = _MEETS[type(shape)](shape, origin, direction)
        found = Hit(distance, tuple(normal), tuple(tangent), shape.material)
        best = select(distance < best.distance, found, best)
    return best
