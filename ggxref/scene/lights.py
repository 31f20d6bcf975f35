"""Light by formula: a sky, a sun, a small rectangle. Radiance is of one band; lights are sampled by direction.

A light sample is only a direction from a mixture density; what it brings is the radiance seen along it. So light sampling
and BSDF sampling estimate one integral over directions, and multiple importance sampling needs no case for either.
Points and directions are many (`vectors`).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from ggxref import geometry
from ggxref.scene.vectors import AnyVector, Vector, ahead, combine, cross, dot, minus, root, select, turn, unit


class Sky(NamedTuple):
    """Radiance from `bottom` (straight down) to `top`, linear in the height z of the direction. Equal: a constant sky."""

    bottom: Array
    top: Array


class Sun(NamedTuple):
    """A disk of angular `radius` [rad] about `direction`, unit, added to the sky."""

    direction: Array
    radius: Array
    radiance: Array


class Area(NamedTuple):
    """A rectangle with `edge_u`, `edge_v` (perpendicular) about `center`; it shines on the side of edge_u × edge_v."""

    center: Array
    edge_u: Array
    edge_v: Array
    radiance: Array


Light = Sky | Sun | Area


def _cone_height(sun):
    return 2 * jnp.sin(sun.radius / 2) ** 2  # 1 - cos r


def _in_sun(sun, direction):
    apart = minus(direction, sun.direction)
    return dot(apart, apart) < 2 * _cone_height(sun)


def _rectangle(area, origin, direction):
    """Distance to the rectangle, infinite where it is missed; the cosine there, positive on the bright side; its area."""
    outward = cross(area.edge_u, area.edge_v)
    size = root(dot(outward, outward))
    facing = -dot(direction, outward) / size
    distance = dot(minus(origin, area.center), outward) / size / jnp.where(facing == 0, 1, facing)
    at = ahead(minus(origin, area.center), distance, direction)
    inside = (facing != 0) & (distance > 0)
    for edge in (area.edge_u, area.edge_v):
        inside &= jnp.abs(dot(at, edge)) * 2 <= dot(edge, edge)
    return jnp.where(inside, distance, jnp.inf), facing, size


def seen(lights: Sequence[Light], origin: Vector, direction: Vector, distance: Array) -> tuple[Array, Array]:
    """Radiance emitted along the ray before `distance` (infinite: the sky), and whether a light ends the ray there."""
    nearest, radiance = distance, jnp.zeros_like(distance)
    for light in lights:
        if isinstance(light, Area):
            to_light, facing, _ = _rectangle(light, origin, direction)
            met = jnp.where(facing > 0, to_light, jnp.inf)
            radiance = jnp.where(met < nearest, light.radiance, radiance)
            nearest = jnp.minimum(met, nearest)
    sky = jnp.zeros_like(distance)
    for light in lights:
        if isinstance(light, Sky):
            sky += light.bottom + (light.top - light.bottom) * (1 + direction[2]) / 2
        elif isinstance(light, Sun):
            sky += jnp.where(_in_sun(light, direction), light.radiance, 0)
    return jnp.where(jnp.isinf(nearest), sky, radiance), nearest < distance


def pdf(lights: Sequence[Light], origin: Vector, direction: Vector) -> Array:
    """Density of `sample` [1/sr]: the mean over the lights."""
    total = jnp.zeros_like(direction[0])
    for light in lights:
        if isinstance(light, Sky):
            total += 1 / (4 * math.pi)
        elif isinstance(light, Sun):
            total += jnp.where(_in_sun(light, direction), 1 / (2 * math.pi * _cone_height(light)), 0)
        else:
            distance, facing, size = _rectangle(light, origin, direction)
            met = jnp.isfinite(distance)
            # The back too: it is dark, but samples are drawn towards it.
            total += jnp.where(met, jnp.where(met, distance, 0) ** 2 / jnp.where(met, jnp.abs(facing) * size, 1), 0)
    return total / len(lights)


def _towards(light, u, v, origin):
    if isinstance(light, Area):
        at = ahead(ahead(minus(light.center, origin), u - 0.5, light.edge_u), v - 0.5, light.edge_v)
        return unit(at)
    height = v * (2.0 if isinstance(light, Sky) else _cone_height(light))  # 1 - z on the cap
    c, s = turn(u)
    r = root(height * (2 - height))
    local = (r * c, r * s, 1 - height)
    if isinstance(light, Sky):
        return local
    return combine(local, *geometry.basis(light.direction))


def sample(lights: Sequence[Light], u: AnyVector, origin: Vector) -> Vector:
    """Directions from `origin` to one of the lights, each as likely: unit. `u`: three numbers in [0, 1) a lane."""
    direction = _towards(lights[0], u[0], u[1], origin)
    for k, light in enumerate(lights[1:], start=1):
        direction = select(u[2] * len(lights) >= k, _towards(light, u[0], u[1], origin), direction)
    return direction
