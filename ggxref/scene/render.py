"""A path tracer for small scenes: unbounded paths, BSDF and light sampling combined, one band, any model and sampler.

A fixed number of lanes takes samples from one queue: a lane whose path ends starts the next sample, so that memory does
not grow with the picture or its samples and no lane idles behind a long path. Every random number is a hash of (seed,
sample, bounce): a picture depends on its seed alone, and two models given one seed walk the same paths until they differ.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ggxref.scene import lights, shading, shapes
from ggxref.scene.lights import Light
from ggxref.scene.materials import Kind, Rows
from ggxref.scene.shapes import Shape
from ggxref.scene.vectors import Vector, ahead, dot, select, unit

LANES = 1 << 14
"""Paths at a time: their state fits in the cache."""
OFFSET = 1e-4
"""How far a path starts from the surface that it leaves; scenes are of order 1, where float32 resolves 1e-7."""
ROULETTE_AFTER = 4
ROULETTE_MOST = 0.95
"""Russian roulette from this bounce on; the largest chance to go on, so that every path ends."""


class Camera(NamedTuple):
    """A pinhole. `right`, `up`, `forward` as columns of the picture's plane at distance 1: (3,) each, scaled to its edge."""

    origin: Array
    right: Array
    up: Array
    forward: Array


class World(NamedTuple):
    """What is rendered. `rows[k]` belongs to the k-th kind; a shape's `material` counts through all of them in turn."""

    camera: Camera
    shapes: tuple[Shape, ...]
    lights: tuple[Light, ...]
    rows: tuple[Rows, ...]


class Lane(NamedTuple):
    """The paths, one a lane. `sample` is its number in the queue, `density` the pdf of its last direction (infinite: the camera)."""

    sample: Array
    bounce: Array
    alive: Array
    origin: Vector
    direction: Vector
    density: Array
    throughput: Array
    radiance: Array


@dataclass(frozen=True)
class Settings:
    """What is compiled besides the kinds. `strategy`: "mis", "bsdf" or "light". `batches`: independent pictures made at once."""

    width: int
    height: int
    strategy: str = "mis"
    lanes: int = LANES
    batches: int = 1

    @property
    def slots(self) -> int:
        """Pixels of all batches."""
        return self.width * self.height * self.batches


@dataclass(frozen=True)
class Picture:
    """`mean`, `variance` (of one sample) and `largest` sample per pixel, (height, width), float64; `samples` per pixel.

    `bounces`: rays that a path sends on, the camera's included, on average.

    Of several batches, (batches, height, width), and `samples` per pixel and batch.

    `seconds`: of processor time, all cores together: what else the machine does is not in it.
    """

    mean: np.ndarray
    variance: np.ndarray
    largest: np.ndarray
    samples: int
    bounces: float
    seconds: float

    @property
    def error(self) -> np.ndarray:
        """Standard error of `mean`."""
        return np.sqrt(self.variance / self.samples)


def look(origin: Sequence, to: Sequence, fov: float, width: int, height: int) -> Camera:
    """A camera at `origin` that sees `to` in its centre, z up; `fov`: the vertical angle of view [rad]."""
    forward = np.subtract(to, origin)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, (0, 0, 1))
    right = right / np.linalg.norm(right)
    edge = math.tan(fov / 2)
    vectors = origin, edge * width / height * right, edge * np.cross(right, forward), forward
    return Camera(*(jnp.asarray(np.asarray(vector, np.float32)) for vector in vectors))


def uniforms(seed, sample, bounce, block: int) -> tuple[Array, ...]:
    """Four numbers in [0, 1) a lane from a hash of the arguments: pcg4d of Jarzynski & Olano 2020."""
    v = [jnp.asarray(x).astype(jnp.uint32) for x in (seed, sample, bounce, block)]
    v = [x * jnp.uint32(1664525) + jnp.uint32(1013904223) for x in v]
    for shift in (True, False):
        for a, b, c in ((0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)):
            v[a] = v[a] + v[b] * v[c]
        if shift:
            v = [x ^ (x >> 16) for x in v]
    # 24 bits: what float32 can hold below 1.
    return tuple((x >> 8).astype(jnp.float32) * jnp.float32(2**-24) for x in v)


def _ray(width: int, height: int, camera: Camera, pixel: Array, u: Sequence[Array]) -> Vector:
    """Directions through the points `u`, two numbers a lane, of pixels counted along rows from the top left."""
    x = ((pixel % width).astype(jnp.float32) + u[0]) * (2 / width) - 1
    y = 1 - ((pixel // width).astype(jnp.float32) + u[1]) * (2 / height)
    return unit(ahead(ahead(camera.forward, x, camera.right), y, camera.up))


def first_seen(width: int, height: int, camera: Camera, things: tuple[Shape, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Distance (infinite: none) and material's number of what each pixel's middle sees: (height, width) both."""

    pixel = jnp.arange(width * height, dtype=jnp.int32)
    middle = jnp.full(pixel.shape, 0.5, jnp.float32)
    direction = _ray(width, height, camera, pixel, (middle, middle))
    hit = shapes.meet(things, camera.origin, direction)
    return np.asarray(hit.distance).reshape(height, width), np.asarray(hit.material).reshape(height, width)


def _camera_ray(settings: Settings, camera: Camera, seed, sample) -> Lane:
    """Lanes at the start of their samples: a point in the pixel, uniformly (box filter)."""
    pixel = (sample % jnp.uint32(settings.width * settings.height)).astype(jnp.int32)
    u = uniforms(seed, sample, 0, 2)
    direction = _ray(settings.width, settings.height, camera, pixel, u)
    zero, one = jnp.zeros_like(u[0]), jnp.ones_like(u[0])
    x, y, z = (coordinate + zero for coordinate in camera.origin)
    bounce = jnp.zeros(sample.shape, jnp.int32)
    return Lane(sample, bounce, bounce == 0, (x, y, z), direction, zero + jnp.inf, one, zero)


def _start(surface_point: Vector, n: Vector, direction: Vector) -> Vector:
    """Off the surface on the side that the direction leaves by."""
    return ahead(surface_point, jnp.where(dot(direction, n) > 0, OFFSET, -OFFSET), n)


def _step(kinds: tuple[Kind, ...], settings: Settings, world: World, seed, lane: Lane) -> Lane:
    """One bounce: what the ray sees, one light sample, one direction on."""
    hit = shapes.meet(world.shapes, lane.origin, lane.direction)
    emitted, stopped = lights.seen(world.lights, lane.origin, lane.direction, hit.distance)
    ends = stopped | jnp.isinf(hit.distance)
    radiance = lane.radiance + lane.throughput * emitted * _share(settings, world, lane)

    point = ahead(lane.origin, jnp.where(ends, 0, hit.distance), lane.direction)
    u, v = (uniforms(seed, lane.sample, lane.bounce, block) for block in (0, 1))
    light = lights.sample(world.lights, v[:3], point)
    at = shading.answer(kinds, world.rows, hit, lane.direction, light, u)
    if settings.strategy != "bsdf":
        density = lights.pdf(world.lights, point, light) + (at.light_pdf if settings.strategy == "mis" else 0)
        origin = _start(point, at.n, light)
        blocked = shapes.meet(world.shapes, origin, light).distance
        there = lights.seen(world.lights, origin, light, blocked)[0]
        use = ~ends & (at.light_value > 0) & (density > 0)
        arriving = at.light_value * there / jnp.where(use, density, 1)
        radiance += jnp.where(use, lane.throughput * arriving, 0)

    scattered = (at.value > 0) & (at.pdf > 0) & ~ends
    throughput = jnp.where(scattered, lane.throughput * at.value / jnp.where(scattered, at.pdf, 1), 0)
    survive = jnp.where(lane.bounce >= ROULETTE_AFTER, jnp.minimum(throughput, ROULETTE_MOST), 1)
    goes_on = scattered & (v[3] < survive)
    return Lane(
        sample=lane.sample,
        bounce=lane.bounce + 1,
        alive=lane.alive & goes_on,
        origin=_start(point, at.n, at.towards),
        direction=at.towards,
        density=at.pdf,
        throughput=throughput / jnp.where(goes_on, survive, 1),
        radiance=radiance,
    )


def _share(settings: Settings, world: World, lane: Lane) -> Array:
    """The balance heuristic's part of BSDF sampling; the camera's ray has no rival."""
    if settings.strategy == "bsdf":
        return jnp.ones_like(lane.density)
    first = jnp.isinf(lane.density)
    if settings.strategy == "light":
        return first.astype(lane.density.dtype)
    rival = lights.pdf(world.lights, lane.origin, lane.direction)
    return jnp.where(first, 1, lane.density / jnp.where(first, 1, lane.density + rival))


class _Run(NamedTuple):
    lanes: Lane
    next: Array
    total: Array
    square: Array
    largest: Array
    bounces: Array


@partial(jax.jit, static_argnums=(0, 1))
def _block(kinds, settings: Settings, world: World, seed, first, samples):
    """Sums over `samples` samples from number `first` on: radiance, its square, its largest, per slot, (slots,); rays."""
    slots = settings.slots
    step, begin = partial(_step, kinds, settings, world, seed), partial(_camera_ray, settings, world.camera, seed)
    ordinal = jnp.arange(settings.lanes, dtype=jnp.uint32)

    def body(run: _Run) -> _Run:
        lanes = step(run.lanes)
        done = run.lanes.alive & ~lanes.alive
        slot = (lanes.sample % jnp.uint32(slots)).astype(jnp.int32)
        value = jnp.where(done, lanes.radiance, 0)
        free = ~lanes.alive
        number = run.next + jnp.cumsum(free.astype(jnp.uint32)) - 1
        starts = free & (number < samples)
        new = begin(first + number)
        new = new._replace(alive=starts)
        lanes = select(free, new, lanes)
        return _Run(
            lanes,
            run.next + starts.sum(dtype=jnp.uint32),
            run.total.at[slot].add(value),
            run.square.at[slot].add(value * value),
            run.largest.at[slot].max(value),
            run.bounces + run.lanes.alive.sum(dtype=jnp.uint32),
        )

    lanes = begin(first + ordinal)
    lanes = lanes._replace(alive=ordinal < samples)
    empty = jnp.zeros(slots, lanes.radiance.dtype)
    begun = jnp.minimum(jnp.uint32(settings.lanes), samples)
    run = lax.while_loop(
        lambda run: run.lanes.alive.any(), body, _Run(lanes, begun, empty, empty, empty, jnp.uint32(0))
    )
    return run.total, run.square, run.largest, run.bounces


def prepare(kinds: tuple[Kind, ...], world: World, settings: Settings) -> None:
    """Compile, so that a picture's time is not the compiler's."""
    _block(kinds, settings, world, *np.zeros(3, np.uint32))


def render(
    kinds: tuple[Kind, ...],
    world: World,
    settings: Settings,
    *,
    samples: int,
    seconds: float = math.inf,
    seed: int = 0,
    block: int = 64,
) -> Picture:
    """The picture with `samples` per pixel, or as many blocks of `block` samples a pixel as fit in `seconds` of processor time.

    Deterministic: the same arguments give the same bytes (but for `seconds`, which is a clock's).
    """
    slots = settings.slots
    total, square, largest = (np.zeros(slots) for _ in range(3))
    begun, done, bounces = time.process_time(), 0, 0.0
    while done < samples and (not done or time.process_time() - begun < seconds):
        now = min(block, samples - done)
        arguments = np.uint32(seed), np.uint32(done * slots), np.uint32(now * slots)
        *parts, rays = [np.asarray(part, np.float64) for part in _block(kinds, settings, world, *arguments)]
        total, square, largest, done = total + parts[0], square + parts[1], np.maximum(largest, parts[2]), done + now
        bounces += float(rays)
    mean = total / done
    # Of one sample; unbiased.
    variance = np.maximum(square / done - mean**2, 0) * done / max(done - 1, 1)
    shape = (settings.batches,) * (settings.batches > 1) + (settings.height, settings.width)
    taken = time.process_time() - begun
    mean, variance, largest = (part.reshape(shape) for part in (mean, variance, largest))
    return Picture(mean, variance, largest, done, bounces / (done * slots), taken)
