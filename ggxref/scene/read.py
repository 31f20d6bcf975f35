"""Scene files: TOML, angles in degrees. Every error says file, key, what was got, and why it will not do."""

import json
import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ggxref.errors import InputError
from ggxref.scene.table import NUMBER, Table, number, text, vector, whole

MOST = 1 << 29
"""Samples of a picture, numbered with 32 bits; `choose` takes four times as many where it must."""


@dataclass(frozen=True)
class Material:
    """A material as the file states it, which is the richest that `choose` considers.

    - `A`: (3, 3), canonical. `turn`: angle from the surface's tangent to local x [rad].
    - `eta`, `k`: index of inside over outside; NaN where the file gives `f0` alone.
    """

    name: str
    surface: str
    ndf: str = "ggx"
    A: np.ndarray = field(default_factory=lambda: np.eye(3))
    turn: float = 0.0
    eta: float = math.nan
    k: float = 0.0
    f0: float = 1.0
    albedo: float = 0.0


@dataclass(frozen=True)
class Scene:
    """`view`: origin, to, fov [rad]; `shapes`, `lights`: their kind and fields as in the file.

    `samples` a pixel; or, where not 0, `seconds` of processor time a picture.
    """

    path: Path
    title: str
    width: int
    height: int
    samples: int
    seconds: float
    view: tuple[tuple[float, ...], tuple[float, ...], float]
    shapes: tuple[dict[str, Any], ...]
    lights: tuple[dict[str, Any], ...]
    materials: tuple[Material, ...]


def _alpha(table: Table, key: str) -> np.ndarray:
    value = table.values[key]
    pair = value if isinstance(value, list) else [value, value]
    good = len(pair) == 2 and all(isinstance(x, NUMBER) and not isinstance(x, bool) for x in pair)
    if not good or not all(math.isfinite(x) and x > 0 for x in pair):
        raise table.bad(key, "need one positive number, or two: αx and αy of the papers; α = 0 is no microsurface")
    return np.diag([*pair, 1.0])


def _matrix(table: Table, key: str) -> np.ndarray:
    try:
        A = np.array(table.values[key], float)
    except (TypeError, ValueError):
        raise table.bad(key, "need three rows of three numbers") from None
    if A.shape != (3, 3) or not np.isfinite(A).all():
        raise table.bad(key, "need three rows of three finite numbers")
    if abs(np.linalg.det(A)) <= 1e-12 * np.linalg.norm(A) ** 3:
        raise table.bad(key, "singular: an ellipsoid needs three half axes")
    S = A.T @ A / (A[:, 2] @ A[:, 2])
    return from_slopes(-S[:2, 2], S[:2, :2] - np.outer(S[:2, 2], S[:2, 2]))


def from_slopes(mean: np.ndarray, scatter: np.ndarray) -> np.ndarray:
    """The canonical A, (3, 3), of a mean slope (2,) and Σ (2, 2), float64 (`ellipsoid.from_slopes` is JAX's)."""
    A = np.eye(3)
    A[:2, :2] = np.linalg.cholesky(scatter).T
    A[2, :2] = -mean
    return A


def _fit(table: Table, key: str) -> tuple[np.ndarray, dict[str, float]]:
    """A, F0 and albedo of the model that `ggxref fit --json` chose; of several bands, their mean."""
    path = table.path.parent / text()(table, key)
    try:
        document = json.loads(path.read_text())
    except FileNotFoundError:
        raise table.bad(key, f"no file {path}; it is sought beside the scene") from None
    except (OSError, ValueError) as error:
        raise table.bad(key, f"{path} cannot be read as JSON: {error}") from None
    try:
        model = {each["model"]: each for each in document["models"]}[document["chosen"]]
        values = {name: float(entry["value"]) for name, entry in model["parameters"].items()}
        A = np.array(model["A"], float).reshape(3, 3)
    except (KeyError, TypeError, ValueError) as error:
        raise table.bad(key, f"{path} is not what `ggxref fit --json` writes: {error!r}") from None
    bands = {"f0": [v for name, v in values.items() if name.partition(" ")[0] == "f0"]}
    bands["albedo"] = [v for name, v in values.items() if name.partition(" ")[0] == "diffuse"]
    return A, {name: float(np.mean(found)) for name, found in bands.items() if found}


def _shape_matrix(table: Table) -> tuple[np.ndarray, dict[str, float]]:
    given = [key for key in ("alpha", "A", "fit") if table.has(key)]
    if len(given) != 1:
        raise InputError(
            f"{table.path}: {table.name} has {' and '.join(given) or 'no shape'}; need exactly one of alpha, A, fit"
        )
    if given == ["alpha"]:
        return table.take("alpha", _alpha), {}
    if given == ["A"]:
        return table.take("A", _matrix), {}
    return table.take("fit", _fit)


def _material(name: str, table: Table) -> Material:
    surface = table.take("surface", text("conductor", "dielectric", "diffuse"))
    if surface == "diffuse":
        material = Material(name, surface, albedo=table.take("albedo", number(0, 1), 0.5))
        table.close()
        return material
    A, fitted = _shape_matrix(table)
    ndf = table.take("ndf", text("ggx", "beckmann"), "ggx")
    if ndf == "beckmann" and np.abs(A[2, :2]).max() > 0:
        raise table.bad("ndf", "a mean slope (A, fit) is the ellipsoid's, which is a GGX")
    turn = math.radians(table.take("turn", number(), 0.0))
    values: dict[str, float] = {}
    if surface == "dielectric":
        values["eta"] = table.take("eta", number(1, 10, above=True), 1.5)
    elif table.has("eta"):
        values["eta"] = table.take("eta", number(0, 100, above=True))
        values["k"] = table.take("k", number(0, 100), 0.0)
    else:
        values["f0"] = table.take("f0", number(0, 1), fitted.get("f0", 1.0))
    if surface == "conductor":
        values["albedo"] = table.take("albedo", number(0, 1), fitted.get("albedo", 0.0))
    if "eta" in values:
        n, k = values["eta"], values.get("k", 0.0)
        values["f0"] = ((n - 1) ** 2 + k * k) / ((n + 1) ** 2 + k * k)
    table.close()
    return Material(name, surface, ndf, A, turn, **values)


_SHAPES: dict[str, dict[str, Callable[[Table, str], Any]]] = {
    "sphere": {"center": vector(3), "radius": number(0, 1e3, above=True)},
    "plane": {
        "point": vector(3),
        "normal": vector(3, nonzero=True),
        "tangent": vector(3, nonzero=True),
    },
    "slab": {"low": vector(3), "high": vector(3)},
}
_LIGHTS: dict[str, dict[str, Callable[[Table, str], Any]]] = {
    "sky": {"bottom": number(0, 1e6), "top": number(0, 1e6)},
    "sun": {
        "direction": vector(3, nonzero=True),
        "radius": number(0, 90, above=True),
        "radiance": number(0, 1e9),
    },
    "area": {
        "center": vector(3),
        "edge_u": vector(3, nonzero=True),
        "edge_v": vector(3, nonzero=True),
        "radiance": number(0, 1e9),
    },
}


def _list(root: Table, key: str) -> list[Table]:
    values = root.values.get(key, [])
    if not isinstance(values, list) or not values:
        raise InputError(f"{root.path}: no [[{key}]]; a picture needs at least one")
    return [Table(root.path, f"{key}[{k}]", value) for k, value in enumerate(values)]


def _record(table: Table, forms: Mapping[str, Mapping[str, Callable]], names: tuple[str, ...] = ()) -> dict[str, Any]:
    kind = table.take("kind", text(*forms))
    record = {"kind": kind} | {key: table.take(key, read) for key, read in forms[kind].items()}
    if names:
        record["material"] = table.take("material", text(*names))
    _check_record(table, record)
    table.close()
    return record


def _check_record(table: Table, record: dict[str, Any]) -> None:
    kind = record["kind"]
    if kind == "slab" and not all(np.less(record["low"], record["high"])):
        raise table.bad("high", f"must exceed low = {list(record['low'])} along every axis")
    pair = {"plane": ("normal", "tangent"), "area": ("edge_u", "edge_v")}.get(kind)
    if pair:
        a, b = (np.array(record[key]) for key in pair)
        if abs(a @ b) > 1e-6 * np.linalg.norm(a) * np.linalg.norm(b):
            raise table.bad(pair[1], f"must be perpendicular to {pair[0]} = {list(record[pair[0]])}")


def _view(table: Table) -> tuple[int, int, tuple]:
    width = table.take("width", whole(1, 4096), 96)
    height = table.take("height", whole(1, 4096), 64)
    origin, to = table.take("origin", vector(3)), table.take("to", vector(3), (0.0, 0.0, 0.0))
    if np.allclose(np.subtract(to, origin)[:2], 0):
        raise table.bad("origin", f"looks straight up or down at {list(to)}, where z gives the picture no upright")
    fov = math.radians(table.take("fov", number(0, 170, above=True), 40.0))
    table.close()
    return width, height, (origin, to, fov)


def read(path: Path) -> Scene:
    """The scene in a file, checked."""
    try:
        values = tomllib.loads(path.read_text())
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; need a scene in TOML") from None
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: cannot be read as TOML: {error}") from None
    root = Table(path, "", values)
    title = root.take("title", text(), path.stem)
    budget, view, materials = (root.table(key) for key in ("budget", "view", "materials"))
    root.asked |= {"shapes", "lights"}
    root.close()  # before what is in them: a [veiw] is better named than the origin that [view] lacks
    shapes, lights = _list(root, "shapes"), _list(root, "lights")
    if budget.has("samples") and budget.has("seconds"):
        raise budget.bad("seconds", "with samples beside it; need one of the two")
    seconds = budget.take("seconds", number(0, 1e5, above=True), 0.0)
    samples = budget.take("samples", whole(2, 1 << 20), 256)
    budget.close()
    width, height, seen = _view(view)
    if samples * width * height > MOST:
        what = f"{samples} samples of {width} x {height} pixels"
        raise InputError(f"{path}: budget.samples: {what}; at most {MOST} samples can be numbered")
    made = tuple(_material(name, materials.table(name)) for name in materials.values)
    if not made:
        raise InputError(f"{path}: no [materials.NAME]; shapes need one")
    names = tuple(material.name for material in made)
    things = tuple(_record(each, _SHAPES, names) for each in shapes)
    return Scene(
        path,
        title,
        width,
        height,
        samples,
        seconds,
        seen,
        things,
        tuple(_record(each, _LIGHTS) for each in lights),
        made,
    )
