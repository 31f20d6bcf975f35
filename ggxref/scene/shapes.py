"""Shapes with a formula: where rays meet them, and the frames there. World space, z up, lengths of order 1.

Rays are many (`vectors`).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

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


def _to_sphere(shape: Sphere, origin, direction):
    o = minus(origin, shape.center)
    b = dot(o, direction)
    # |o|² − r² and b² − c both cancel at a distance: the closest point to the centre does not.
    across = ahead(o, -b, direction)
    square = shape.radius**2 - dot(across, across)
    half = root(square)
    near, far = -b - half, half - b
    return jnp.where(square > 0, jnp.where(near > 0, near, jnp.where(far > 0, far, jnp.inf)), jnp.inf)


def _on_sphere(shape: Sphere, origin, direction, distance):
    normal = scale(1 / shape.radius, ahead(minus(origin, shape.center), distance, direction))
    c, s = azimuth(normal[0], normal[1])
    return normal, (-s, c, jnp.zeros_like(c))


def _to_plane(shape: Plane, origin, direction):
    rate = dot(direction, shape.normal)
    distance = dot(minus(shape.point, origin), shape.normal) / jnp.where(rate == 0, 1, rate)
    return jnp.where((rate != 0) & (distance > 0), distance, jnp.inf)


def _on_plane(shape: Plane, origin, direction, distance):
    return shape.normal, shape.tangent


def _faces(shape: Slab, origin, direction):
    """Per axis, the distances at which a ray enters and leaves the two planes across it."""
    enter, leave = [], []
    for low, high, o, d in zip(shape.low, shape.high, origin, direction, strict=True):
        safe = jnp.where(d == 0, 1e-20, d)
        first, second = (low - o) / safe, (high - o) / safe
        enter.append(jnp.minimum(first, second))
        leave.append(jnp.maximum(first, second))
    near = jnp.maximum(jnp.maximum(enter[0], enter[1]), enter[2])
    far = jnp.minimum(jnp.minimum(leave[0], leave[1]), leave[2])
    return enter, leave, near, far


def _to_slab(shape: Slab, origin, direction):
    *_, near, far = _faces(shape, origin, direction)
    return jnp.where((near < far) & (far > 0), jnp.where(near > 0, near, far), jnp.inf)


def _on_slab(shape: Slab, origin, direction, distance):
    enter, leave, near, far = _faces(shape, origin, direction)
    outside = near > 0
    across_x, across_y = (jnp.where(outside, enter[k] == near, leave[k] == far) for k in (0, 1))
    on = across_x, across_y & ~across_x, ~across_x & ~across_y
    towards = jnp.where(outside, -1, 1)
    normal = tuple(jnp.where(face, towards * jnp.sign(d), 0) for face, d in zip(on, direction, strict=True))
    one, zero = jnp.ones_like(near), jnp.zeros_like(near)
    return normal, (jnp.where(across_x, zero, one), jnp.where(across_x, one, zero), zero)


_TO = {Sphere: _to_sphere, Plane: _to_plane, Slab: _to_slab}
_ON = {Sphere: _on_sphere, Plane: _on_plane, Slab: _on_slab}


def meet(shapes: Sequence[Shape], origin: AnyVector, direction: Vector) -> Hit:
    """The nearest shape along rays from `origin` along `direction`, unit."""
    zero = jnp.zeros_like(direction[0])
    hit = Hit(zero + jnp.inf, (zero, zero, zero), (zero, zero, zero), jnp.zeros(zero.shape, jnp.int32))
    for kind in dict.fromkeys(map(type, shapes)):
        distance, shape = _nearest([shape for shape in shapes if type(shape) is kind], origin, direction)
        finite = jnp.where(jnp.isfinite(distance), distance, 0)
        normal, tangent = _ON[kind](shape, origin, direction, finite)
        hit = select(distance < hit.distance, Hit(distance, normal, tangent, shape.material), hit)
    return hit


def _nearest(shapes: Sequence[Shape], origin: AnyVector, direction: Vector) -> tuple[Array, Any]:
    """Of shapes of one type: the distance of the nearest, and the shape itself, its fields a number a lane.

    A loop: of the same written out, XLA would compute all distances again for each component of the frame.
    """
    every = jax.tree.map(lambda *fields: _parts(jnp.stack(fields, axis=-1)), shapes[0], *shapes[1:])
    first = jax.tree.map(lambda field: jnp.full(direction[0].shape, field[0]), every)

    def nearer(best, shape):
        distance = _TO[type(shape)](shape, origin, direction)
        return select(distance < best[0], (distance, shape), best), None

    return lax.scan(nearer, (jnp.full_like(direction[0], jnp.inf), first), every)[0]


def _parts(field: Array):
    return tuple(field) if field.ndim > 1 else field
