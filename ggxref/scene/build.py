"""From a scene file and a choice of models to what the renderer takes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np

from ggxref.scene import lights, materials, render, shapes
from ggxref.scene.materials import Kind, Rows
from ggxref.scene.read import Material, Scene, from_slopes

MODELS = ("isotropic", "anisotropic", "ellipsoid")
"""From the plainest; the anisotropic one has its own axes."""


@dataclass(frozen=True)
class Choice:
    """How one material is computed. The order of each axis' options, plainest first, is its ladder."""

    model: str
    g2: str
    fresnel: str
    sampler: str
    trigonometry: str = "exact"
    precision: str = "float32"


def richest(material: Material) -> Choice:
    """All that the file states about the material, by the sampler that every comparison shares."""
    ellipsoid = material.ndf == "ggx"
    known = "schlick" if math.isnan(material.eta) else "exact"
    sampler = "ellipsoid_cap" if ellipsoid else "slope_beckmann"
    return Choice(MODELS[2 if ellipsoid else 1], "height_correlated", known, sampler)


def plainer(A: np.ndarray, model: str) -> tuple[np.ndarray, float]:
    """`A`, canonical, reduced to a plainer model, and the angle that turns its own axes from the old [rad].

    Anisotropic drops the mean slope and keeps the scatter Σ, on its principal axes; isotropic keeps √|Σ|, the geometric
    mean of the two α.
    """
    if model == "ellipsoid":
        return A, 0.0
    scatter = A[:2, :2].T @ A[:2, :2]
    if model == "isotropic":
        return np.diag([np.linalg.det(scatter) ** 0.25] * 2 + [1.0]), 0.0
    if scatter[0, 1] == 0:
        return from_slopes(np.zeros(2), scatter), 0.0
    squares, axes = np.linalg.eigh(scatter)
    return np.diag([*np.sqrt(squares[::-1]), 1.0]), math.atan2(axes[1, 1], axes[0, 1])


def kind_of(material: Material, choice: Choice) -> Kind:
    """The kind that is compiled for a material under a choice."""
    if material.surface == "diffuse":
        return Kind("diffuse", sampler="", ndf="ggx")
    ndf = material.ndf if material.ndf == "beckmann" or choice.model != "ellipsoid" else "ellipsoid"
    fresnel = ("exact",) if material.surface == "dielectric" else (choice.fresnel,)
    turn = (choice.trigonometry,) if choice.sampler in materials.TURNING else ("exact",)
    forms = (choice.g2,), fresnel, choice.sampler, material.albedo > 0, turn, (choice.precision,)
    return Kind(material.surface, ndf, *forms)


def any_form(kind: Kind) -> Kind:
    """The kind with every form, of which the row names one: one compilation for many comparisons."""
    if kind.surface == "diffuse":
        return kind
    fresnel = materials.FRESNELS if kind.surface == "conductor" else ("exact",)
    turns = tuple(materials.TURNS) if kind.sampler in materials.TURNING else kind.trigonometry
    return replace(
        kind, g2=materials.G2S[:2], fresnel=fresnel, trigonometry=turns, precision=tuple(materials.PRECISIONS)
    )


def row(material: Material, choice: Choice, kind: Kind) -> tuple:
    """The material's numbers, in the order of `Rows`."""
    A, turn = plainer(material.A, choice.model)
    angle = material.turn + turn
    eta = 1.0 if math.isnan(material.eta) else material.eta
    of_kind, wanted = ([getattr(each, form) for form in materials.FORMS] for each in (kind, choice))
    forms = [names.index(name) if name in names else 0 for names, name in zip(of_kind, wanted, strict=True)]
    turned = math.cos(angle), math.sin(angle)
    return A.diagonal()[:2], A, turned, eta, material.k, material.f0, material.albedo, *forms


def world(
    scene: Scene, choices: Mapping[str, Choice], *, by_row: bool = False
) -> tuple[tuple[Kind, ...], render.World]:
    """The renderer's arguments for the scene with each material by its choice. `by_row`: see `any_form`.

    Materials that differ in forms alone share a kind that has the forms of all: a second kind is a second branch.
    """
    alone = [kind_of(material, choices[material.name]) for material in scene.materials]
    kinds = _united([any_form(kind) if by_row else kind for kind in alone])
    members: dict[Kind, list[tuple[str, tuple]]] = {}
    for material, kind in zip(scene.materials, kinds, strict=True):
        members.setdefault(kind, []).append((material.name, row(material, choices[material.name], kind)))
    order = [name for rows in members.values() for name, _ in rows]
    tables = tuple(_rows([numbers for _, numbers in rows]) for rows in members.values())
    view = render.look(*scene.view, scene.width, scene.height)
    things = tuple(_shape(each, order.index(each["material"])) for each in scene.shapes)
    return tuple(members), render.World(view, things, tuple(_light(each) for each in scene.lights), tables)


def formless(kind: Kind) -> Kind:
    """What kinds share that differ in forms alone."""
    return replace(kind, **dict.fromkeys(materials.FORMS, ()))


def _united(kinds: list[Kind]) -> list[Kind]:
    """Each kind, with the forms of all that differ from it in forms alone."""
    found = []
    for kind in kinds:
        alike = [each for each in kinds if formless(each) == formless(kind)]
        forms = {form: [name for each in alike for name in getattr(each, form)] for form in materials.FORMS}
        found.append(replace(kind, **{form: tuple(dict.fromkeys(names)) for form, names in forms.items()}))
    return found


def _rows(rows: list[tuple]) -> Rows:
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    dtypes = [jnp.int32 if name in materials.FORMS else jnp.float32 for name in Rows._fields]
    return Rows(*(jnp.asarray(column, dtype) for column, dtype in zip(columns, dtypes, strict=True)))


def _single(value) -> jnp.ndarray:
    return jnp.asarray(value, jnp.float32)


def _unit(value) -> jnp.ndarray:
    return _single(np.array(value) / np.linalg.norm(value))


def _shape(record: dict, material: int) -> shapes.Shape:
    number = jnp.int32(material)
    if record["kind"] == "sphere":
        return shapes.Sphere(_single(record["center"]), _single(record["radius"]), number)
    if record["kind"] == "plane":
        return shapes.Plane(_single(record["point"]), _unit(record["normal"]), _unit(record["tangent"]), number)
    return shapes.Slab(_single(record["low"]), _single(record["high"]), number)


def _light(record: dict) -> lights.Light:
    if record["kind"] == "sky":
        return lights.Sky(_single(record["bottom"]), _single(record["top"]))
    if record["kind"] == "sun":
        radius = _single(math.radians(record["radius"]))
        return lights.Sun(_unit(record["direction"]), radius, _single(record["radiance"]))
    return lights.Area(*(_single(record[key]) for key in ("center", "edge_u", "edge_v", "radiance")))


def seen(scene: Scene) -> dict[str, np.ndarray]:
    """Per material, the pixels in whose middle it is the first thing seen: (height, width), bool."""
    order = [material.name for material in scene.materials]
    numbers = [_shape(each, order.index(each["material"])) for each in scene.shapes]
    camera = render.look(*scene.view, scene.width, scene.height)
    distance, material = render.first_seen(scene.width, scene.height, camera, tuple(numbers))
    return {name: np.isfinite(distance) & (material == k) for k, name in enumerate(order)}
