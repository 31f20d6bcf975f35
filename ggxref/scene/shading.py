"""What a surface answers to a ray: the local frame, the formulas of its kind mapped over the lanes, and back to world space."""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from ggxref.scene import materials, shapes
from ggxref.scene.materials import Kind, Rows
from ggxref.scene.vectors import AnyVector, Vector, ahead, combine, cross, dot, scale, select

Row = Any  # a `Rows` of lanes: its vectors and matrices are tuples of arrays (n,)


class Surface(NamedTuple):
    """Where a path meets a material: the rows t, b, n of the local frame, n on the ray's side, and `wi` in it.

    From `below` all three are reversed (`materials`).
    """

    t: Vector
    b: Vector
    n: Vector
    wi: Vector
    below: Array


def _frame(hit: shapes.Hit, turn: AnyVector, direction: Vector) -> Surface:
    n, tangent = hit.normal, hit.tangent
    t = ahead(scale(turn[0], tangent), turn[1], cross(n, tangent))
    below = dot(direction, n) > 0
    t, b, n = (scale(jnp.where(below, -1.0, 1.0), axis) for axis in (t, cross(n, t), n))
    return Surface(t, b, n, (-dot(direction, t), -dot(direction, b), -dot(direction, n)), below)


class Shading(NamedTuple):
    """A surface's answer to a ray: the light direction's BSDF × |cos| and pdf, and a sampled direction, in world space."""

    light_value: Array
    light_pdf: Array
    n: Vector
    towards: Vector
    value: Array
    pdf: Array


def _shade(
    kind: Kind, rows: Rows, number: Array, hit: shapes.Hit, direction: Vector, light: Vector, u: tuple[Array, ...]
) -> Shading:
    row = row_of(rows, number)
    surface = _frame(hit, row.turn, direction)
    if kind.surface == "dielectric":
        row = row._replace(eta=jnp.where(surface.below, 1 / row.eta, row.eta))
    local = (dot(light, surface.t), dot(light, surface.b), dot(light, surface.n))
    wo, value, pdf, light_value, light_pdf = bounce(kind, row, u, surface.wi, local)
    return Shading(light_value, light_pdf, surface.n, combine(wo, surface.t, surface.b, surface.n), value, pdf)


def bounce(kind: Kind, row: Row, u: tuple[Array, ...], wi: Vector, light: Vector):
    """The formulas of a bounce, in the local frame: a direction drawn, its value and pdf, those of `light`."""
    lanes: Any = Rows._make(0 if _laned(field) else None for field in row)
    return jax.vmap(partial(_bounce, kind), (lanes, 0, 0, 0))(row, u, wi, light)


def _bounce(kind: Kind, row: Row, u: tuple[Array, ...], wi: Vector, light: Vector):
    whole = Rows(*(_whole(field) for field in row))
    drawn = materials.sample(kind, whole, jnp.stack(u), jnp.stack(wi))
    return tuple(drawn.wo), drawn.value, drawn.pdf, *materials.evaluate(kind, whole, jnp.stack(wi), jnp.stack(light))


def _whole(parts) -> Array:
    return jnp.stack([_whole(part) for part in parts]) if isinstance(parts, tuple) else parts


def _parts(whole) -> Any:
    return tuple(_parts(part) for part in whole) if jnp.ndim(whole) else whole


def _laned(field) -> bool:
    return jnp.ndim(jax.tree.leaves(field)[0]) > 0


def row_of(rows: Rows, number: Array) -> Row:
    """The rows of many numbers; a number out of range gives the first or the last. Of one row, no lane has its own."""
    first, *others = (Rows(*(_parts(field[k]) for field in rows)) for k in range(rows.eta.shape[0]))
    if not others:
        return first
    row = jax.tree.map(lambda x: jnp.full(number.shape, x), first)
    for k, other in enumerate(others, start=1):
        row = select(number >= k, other, row)
    return row


def answer(
    kinds: tuple[Kind, ...], every: tuple[Rows, ...], hit: shapes.Hit, direction: Vector, light: Vector, u
) -> Shading:
    """Every kind's shading, of which the hit material's is kept."""
    zero = jnp.zeros_like(hit.distance)
    answer, first = Shading(zero, zero, (zero, zero, zero), (zero, zero, zero), zero, zero), 0
    for kind, rows in zip(kinds, every, strict=True):
        number = hit.material - first
        mine = (number >= 0) & (number < rows.eta.shape[0]) & jnp.isfinite(hit.distance)
        shade = partial(_shade, kind)
        # A branch keeps the formulas apart from the rest, of which XLA's fusion would compute parts many times over
        # (3.1 µs against 0.3), and a kind that no lane has met costs nothing.
        operands = rows, number, hit, direction, light, u
        found = lax.cond(mine.any(), shade, lambda *_, nothing=answer: nothing, *operands)
        answer = select(mine, found, answer)
        first += rows.eta.shape[0]
    return answer
