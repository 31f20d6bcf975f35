"""A fitted model in a renderer's own words, or why it cannot be said there.

- `mitsuba` (3): `roughconductor`, α itself; G is the separable one there. `pbrt` (v4): `conductor`, α without its remapping.
- `gltf` (2.0): roughness √α of the smoother axis, `KHR_materials_anisotropy` for the other. `materialx`: its physical nodes, α itself.
- `json`: the parameters as they are; all can be said.
"""

import json
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ggxref.errors import InputError
from ggxref.fit import parameters, report
from ggxref.fit.fitting import Fit, Ladder, fit_models

SMALLEST_ALBEDO = 1e-3
"""Of the diffuse term, below which it is not said to a renderer that has none."""
MIRROR = "a height field says nothing of F: exported with a reflectance of 1"


class Material(NamedTuple):
    """`alpha`: of the rougher axis and across it; `rotation` of the rougher axis, radians. `f0` or `eta` and `k`, `diffuse`: (3,)."""

    alpha: tuple[float, float]
    rotation: float
    f0: np.ndarray | None
    eta: np.ndarray
    k: np.ndarray
    diffuse: np.ndarray
    tail: str


def check(form: str | None) -> None:
    """That there is such a form; to be asked before the fit."""
    if form is not None and form not in FORMS:
        raise InputError(f"--export {form}: need one of {', '.join(FORMS)}")


def text(ladder: Ladder, form: str, nearest: bool = False) -> tuple[str, str]:
    """The file's content, and a sentence that says what was taken instead of the chosen model or of an unknown F, or "".

    - `nearest`: where the chosen model cannot be said, take the fitted one of least held-out loss that can.
    """
    write, can = FORMS[form]
    reason = can(ladder, ladder.best)
    unsaid = MIRROR if ladder.problem.surface is None and form != "json" else ""
    if not reason:
        return write(ladder, ladder.best), unsaid
    if not nearest:
        raise InputError(f"--export {form}: the model {ladder.chosen} {reason}; --nearest takes the closest that can")
    able = [fit for fit in (*ladder.fits, *_plainer(ladder)) if not can(ladder, fit)]
    if not able:
        raise InputError(f"--export {form}: the model {ladder.chosen} {reason}; nor does any other that fits this data")
    fit = min(able, key=lambda each: each.held_out.mean())
    above = fit.held_out.mean() - ladder.best.held_out.mean()
    name = f"{fit.model.name}{'' if any(fit is each for each in ladder.fits) else ' without a diffuse term'}"
    return write(ladder, fit), (
        f"{ladder.chosen} {reason}: exported {name}, whose held-out loss of {fit.held_out.mean():.4g} is {above:.2g} above"
        f"{unsaid and f'; {unsaid}'}"
    )


def _plainer(ladder: Ladder) -> tuple[Fit, ...]:
    """GGX fitted to the same data without a diffuse term."""
    problem = ladder.problem
    held = {name: -math.inf for name in problem.parameters if name.startswith("diffuse")}
    shapes = {name: groups for name, groups in problem.shapes.items() if name != "ellipsoid"}
    return fit_models(problem, parameters.ladder(shapes, ["ggx"]), held)


def material(ladder: Ladder, fit: Fit) -> Material:
    def bands(name: str) -> np.ndarray:
        found = [value for key, value in fit.values.items() if key.partition(" ")[0] == name]
        return np.resize(found or [0.0], 3) if len(found) <= 1 else np.array(found)

    surface = ladder.problem.surface
    f0 = {"schlick": bands("f0"), "conductor": None}[surface.fresnel] if surface else np.ones(3)
    rotation = fit.values["rotation"] if fit.values["anisotropy"] > 1 + 1e-9 else 0.0
    return Material(
        alpha=(fit.values["alpha_1"], fit.values["alpha_2"]),
        rotation=rotation,
        f0=f0,
        eta=bands("eta"),
        k=bands("k"),
        diffuse=bands("diffuse"),
        tail=fit.model.tail,
    )


def _common(ladder: Ladder, fit: Fit, tails: tuple[str, ...] = ("ggx",)) -> str:
    """Why no renderer can say it, with the number, or ""."""
    surface = ladder.problem.surface
    bands = len([name for name in fit.values if name.startswith("diffuse")])
    if surface is not None and bands not in (1, 3):
        return f"has {bands} bands; renderers take one or three"
    if fit.model.tail not in tails:
        return (
            f"has the tail {fit.model.tail}, gamma = {fit.values['gamma']:.3g}; there the tail is {' or '.join(tails)}"
        )
    if fit.values["mean_slope"] > 0:
        tilt = math.degrees(math.atan(fit.values["mean_slope"]))
        return f"is skewed, mean slope {fit.values['mean_slope']:.3g} ({tilt:.2g}°); there a lobe's mean is the normal"
    if surface is not None and surface.masking == "v_cavity":
        return "has V-cavities for masking; there it is Smith's"
    if max(fit.values["alpha_1"], fit.values["alpha_2"]) > 1:
        return f"has a roughness of {fit.values['alpha_1']:.3g}; there it is at most 1"
    return ""


def _aligned(fit: Fit) -> str:
    """Why it cannot be said by α along x and y."""
    turn = fit.values["rotation"] if fit.space.moved[2] else 0.0
    return f"has its rough axis at {math.degrees(turn):.3g}°; there it is along u or v" if turn else ""


def _metal(ladder: Ladder, fit: Fit) -> str:
    albedo = material(ladder, fit).diffuse.max()
    return f"has a diffuse albedo of {albedo:.3g}; a metal there has none" if albedo > SMALLEST_ALBEDO else ""


def _along_axes(fit: Fit) -> tuple[float, float]:
    return fit.values["alpha_x"], fit.values["alpha_y"]


def _row(values: np.ndarray, separator: str = " ") -> str:
    return separator.join(f"{value:.6g}" for value in values)


def _metal_index(m: Material) -> tuple[np.ndarray, np.ndarray]:
    """η and k of a metal: for Schlick's F0 those with η = 1 and that reflectance at normal incidence."""
    if m.f0 is None:
        return m.eta, m.k
    return np.ones(3), 2 * np.sqrt(m.f0 / (1 - np.minimum(m.f0, 1 - 1e-6)))


def _origin(ladder: Ladder, fit: Fit) -> str:
    return f"{fit.model.name} fitted by ggxref to SHA-256 {ladder.measurement.source.sha256[:16]}"


def _mitsuba(ladder: Ladder, fit: Fit) -> str:
    m, (alpha_u, alpha_v) = material(ladder, fit), _along_axes(fit)
    eta, k = _metal_index(m)
    # A blend's shares sum to 1: both parts are scaled up by theirs.
    share = float(np.ceil(m.diffuse.max() * 100) / 100) if m.diffuse.max() > SMALLEST_ALBEDO else 0.0
    lobe = f"""<bsdf type="roughconductor">
    <string name="distribution" value="{m.tail}"/>
    <float name="alpha_u" value="{alpha_u:.6g}"/> <float name="alpha_v" value="{alpha_v:.6g}"/>
    <rgb name="eta" value="{_row(eta, ", ")}"/> <rgb name="k" value="{_row(k, ", ")}"/>
    <spectrum name="specular_reflectance" value="{1 / (1 - share):.6g}"/>
  </bsdf>"""
    if share:
        diffuse = f'<bsdf type="diffuse"><rgb name="reflectance" value="{_row(m.diffuse / share, ", ")}"/></bsdf>'
        lobe = f'<bsdf type="blendbsdf">\n  <float name="weight" value="{share:g}"/>\n  {lobe}\n  {diffuse}\n</bsdf>'
    return f'<!-- {_origin(ladder, fit)} -->\n<scene version="3.0.0">\n{lobe}\n</scene>\n'


def _pbrt(ladder: Ladder, fit: Fit) -> str:
    m, (u, v) = material(ladder, fit), _along_axes(fit)
    index = (
        f'"rgb reflectance" [{_row(m.f0)}]' if m.f0 is not None else f'"rgb eta" [{_row(m.eta)}] "rgb k" [{_row(m.k)}]'
    )
    return (
        f'# {_origin(ladder, fit)}\nMaterial "conductor" {index}\n'
        f'  "float uroughness" [{u:.6g}] "float vroughness" [{v:.6g}] "bool remaproughness" [false]\n'
    )


def _gltf(ladder: Ladder, fit: Fit) -> str:
    m = material(ladder, fit)
    rough, smooth = m.alpha
    f0 = _normal_reflectance(m)
    found: dict = {
        "name": _origin(ladder, fit),
        "pbrMetallicRoughness": {
            "baseColorFactor": [*np.round(f0, 6).tolist(), 1.0], "metallicFactor": 1.0,
            "roughnessFactor": round(math.sqrt(smooth), 6),
        },
    }  # fmt: skip
    document: dict = {"asset": {"version": "2.0", "generator": "ggxref"}, "materials": [found]}
    if rough > smooth * (1 + 1e-9):
        # Along the tangent the extension has α + (1 − α) strength².
        strength = math.sqrt((rough - smooth) / (1 - smooth))
        turn = m.rotation % math.pi
        found["extensions"] = {
            "KHR_materials_anisotropy": {"anisotropyStrength": round(strength, 6), "anisotropyRotation": round(turn, 6)}
        }
        document["extensionsUsed"] = ["KHR_materials_anisotropy"]
    return json.dumps(document, indent=1) + "\n"


def _normal_reflectance(m: Material) -> np.ndarray:
    return m.f0 if m.f0 is not None else ((m.eta - 1) ** 2 + m.k**2) / ((m.eta + 1) ** 2 + m.k**2)


def _materialx(ladder: Ladder, fit: Fit) -> str:
    m = material(ladder, fit)
    rough, smooth = m.alpha
    if m.f0 is not None:
        interface = (
            f'<generalized_schlick_bsdf name="lobe" type="BSDF"><input name="color0" type="color3" value="{_row(m.f0, ", ")}"/>'
            '<input name="color90" type="color3" value="1, 1, 1"/>'
        )
        end = "</generalized_schlick_bsdf>"
    else:
        interface = (
            f'<conductor_bsdf name="lobe" type="BSDF"><input name="ior" type="color3" value="{_row(m.eta, ", ")}"/>'
            f'<input name="extinction" type="color3" value="{_row(m.k, ", ")}"/>'
        )
        end = "</conductor_bsdf>"
    return f"""<?xml version="1.0"?>
<!-- {_origin(ladder, fit)} -->
<materialx version="1.38">
  <tangent name="along" type="vector3"/> <normal name="up" type="vector3"/>
  <rotate3d name="turned" type="vector3"><input name="in" type="vector3" nodename="along"/>
    <input name="amount" type="float" value="{math.degrees(m.rotation):.6g}"/><input name="axis" type="vector3" nodename="up"/></rotate3d>
  {interface}
    <input name="roughness" type="vector2" value="{rough:.6g}, {smooth:.6g}"/><input name="tangent" type="vector3" nodename="turned"/>{end}
  <oren_nayar_diffuse_bsdf name="base" type="BSDF"><input name="color" type="color3" value="{_row(m.diffuse, ", ")}"/></oren_nayar_diffuse_bsdf>
  <add name="both" type="BSDF"><input name="in1" type="BSDF" nodename="lobe"/><input name="in2" type="BSDF" nodename="base"/></add>
  <surface name="shader" type="surfaceshader"><input name="bsdf" type="BSDF" nodename="both"/></surface>
  <surfacematerial name="fitted" type="material"><input name="surfaceshader" type="surfaceshader" nodename="shader"/></surfacematerial>
</materialx>
"""


def _json(ladder: Ladder, fit: Fit) -> str:
    named = {name: value for name, value, _, _ in report.rows(fit)}
    surface = ladder.problem.surface
    parts = {"masking": surface.masking, "fresnel": surface.fresnel} if surface else {}
    shape = report.shape_matrix(fit)
    return (
        json.dumps(
            {"model": fit.model.name, "tail": fit.model.tail, **parts, "A": shape, "parameters": named}, indent=1
        )
        + "\n"
    )


FORMS: dict[str, tuple[Callable[[Ladder, Fit], str], Callable[[Ladder, Fit], str]]] = {
    "mitsuba": (_mitsuba, lambda ladder, fit: _common(ladder, fit, ("ggx", "beckmann")) or _aligned(fit)),
    "pbrt": (_pbrt, lambda ladder, fit: _common(ladder, fit) or _aligned(fit) or _metal(ladder, fit)),
    "gltf": (_gltf, lambda ladder, fit: _common(ladder, fit) or _metal(ladder, fit)),
    "materialx": (_materialx, _common),
    "json": (_json, lambda ladder, fit: ""),
}
