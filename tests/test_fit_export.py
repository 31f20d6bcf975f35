"""A fit in a renderer's words means the same there, or is refused with the number that cannot be said."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from ggxref.errors import InputError
from ggxref.fit import export, models, parameters, solver
from ggxref.fit.data import Reflectance, Source
from ggxref.fit.fitting import Fit, Ladder
from ggxref.fit.models import Surface
from ggxref.fit.problem import Problem

NAMES = parameters.names(("brdf",))


def ladder(theta, shape="rotated", tail="ggx", masking="separable") -> Ladder:
    """A ladder with one fit, of this θ."""
    theta, none = np.asarray(theta, float), np.zeros((len(NAMES),) * 2)
    space = parameters.space(parameters.SHAPES[shape], NAMES, {}, 0.1)
    values, errors = parameters.report(theta, none, NAMES)
    model = parameters.Model(shape, parameters.SHAPES[shape], tail)
    fit = Fit(
        model=model, tail=tail, space=space, identified=space, theta=theta, covariance=none, values=values, errors=errors,
        loss=1.0, held_out=np.array([1.0, 1.0]), held_out_blocks=np.ones(2), bic=0.0, log_rmse=0.1, agreeing=(1, 1), intervals={}, correlation=none,
        at_bound=(), residuals=np.zeros((1, 1)), trouble="",
    )  # fmt: skip
    one = np.ones((1, 3))
    source = Source("measured", "test", "0" * 64)
    measurement = Reflectance(one, one, one[:, :1], one[:, 0], one[:, 0] > 0, ("brdf",), source)
    number = np.zeros(1, int)
    problem = Problem(
        samples=(one.T,) * 5, weights=one[:, 0], block=number, fold=number, surface=Surface(tail=tail, masking=masking),
        shapes=parameters.SHAPES, parameters=NAMES, starts=theta[None], scale=0.1, notes=(),
    )  # fmt: skip
    return Ladder(measurement, problem, (fit,), shape)


def entries(alpha_x=0.3, alpha_y=0.1, shear=0.0, mean=(0.0, 0.0), gamma=2.0, f0=0.6, diffuse=0.0):
    user = dict(zip(NAMES, (alpha_x, alpha_y, shear, *mean, gamma, f0, diffuse), strict=True))
    return [parameters.from_user(name, value) for name, value in user.items()]


@pytest.mark.parametrize(
    ("form", "theta", "options", "said"),
    [
        ("mitsuba", entries(mean=(0.05, 0.0)), {"shape": "ellipsoid"}, r"is skewed, mean slope 0.05 \(2.9°\)"),
        ("gltf", entries(gamma=1.7), {"tail": "student_t"}, r"has the tail student_t, gamma = 1.7"),
        ("pbrt", entries(shear=0.05), {}, r"has its rough axis at 10.*°"),
        ("pbrt", entries(diffuse=0.2), {"shape": "anisotropic"}, "has a diffuse albedo of 0.2"),
        ("materialx", entries(), {"masking": "v_cavity"}, "has V-cavities"),
        ("mitsuba", entries(alpha_x=1.5), {}, "has a roughness of 1.5"),
    ],
)
def test_what_cannot_be_said_is_refused_with_its_number(form, theta, options, said):
    with pytest.raises(InputError, match=said):
        export.text(ladder(theta, **options), form)


def test_an_unknown_form():
    with pytest.raises(InputError, match="--export blender: need one of mitsuba"):
        export.check("blender")


def test_nearest_is_the_fitted_model_of_least_loss_that_can(monkeypatch):
    monkeypatch.setattr(export, "_plainer", lambda _: ())
    skewed = ladder(entries(mean=(0.05, 0.0)), "ellipsoid")
    near, far = (
        replace(ladder(entries(alpha_x=a), "anisotropic").best, held_out=np.full(2, loss))
        for a, loss in ((0.31, 1.5), (0.5, 3.0))
    )
    text, note = export.text(replace(skewed, fits=(far, near, skewed.best)), "mitsuba", nearest=True)
    assert 'alpha_u" value="0.31"' in text
    assert "exported anisotropic" in note and "0.5 above" in note


def test_gltf_gives_back_both_roughnesses():
    """KHR_materials_anisotropy: α_b = r², α_t = α_b + (1 − α_b) s²."""
    document = json.loads(export.text(ladder(entries(alpha_x=0.1, alpha_y=0.3)), "gltf")[0])
    material = document["materials"][0]
    smooth = material["pbrMetallicRoughness"]["roughnessFactor"] ** 2
    turned = material["extensions"]["KHR_materials_anisotropy"]
    assert smooth == pytest.approx(0.1, rel=1e-5)
    assert smooth + (1 - smooth) * turned["anisotropyStrength"] ** 2 == pytest.approx(0.3, rel=1e-5)
    assert turned["anisotropyRotation"] == pytest.approx(math.pi / 2, rel=1e-5)
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx([0.6, 0.6, 0.6, 1])


def test_json_has_the_whole_shape():
    document = json.loads(export.text(ladder(entries(mean=(0.05, 0.0)), "ellipsoid"), "json")[0])
    assert document["A"][2] == pytest.approx([-0.05, 0, 1])
    assert document["parameters"]["alpha_x"] == pytest.approx(0.3)


def test_pbrt_takes_alpha_without_its_remapping():
    text = export.text(ladder(entries(), "anisotropic"), "pbrt")[0]
    assert '"float uroughness" [0.3] "float vroughness" [0.1] "bool remaproughness" [false]' in text


@pytest.mark.parametrize(
    ("form", "said"),
    [("pbrt", '"rgb reflectance" [1 1 1]'), ("gltf", '"metallicFactor": 1.0'), ("materialx", 'value="1, 1, 1"')],
)
def test_heights_alone_are_of_a_mirror(form, said):
    """They say nothing of F; η = 0, which no conductor has, is no number in pbrt."""
    of_reflectance = ladder(entries(), "anisotropic")
    shape = {name: value for name, value in of_reflectance.best.values.items() if name not in ("f0", "diffuse")}
    heights = replace(of_reflectance, problem=replace(of_reflectance.problem, surface=None),
                      fits=(replace(of_reflectance.best, values=shape),))  # fmt: skip
    text, note = export.text(heights, form)
    assert said in text and "says nothing of F" in note
    assert "says nothing" not in export.text(of_reflectance, form)[1]


@pytest.mark.parametrize("tail", ["ggx", "beckmann"])
def test_mitsuba_has_the_same_values(tail):
    """Its own evaluation of the exported material, in float32 and with a rational fit of Beckmann's G."""
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    theta = entries(diffuse=0.1)
    text = export.text(ladder(theta, "anisotropic", tail), "mitsuba")[0]
    inner = re.search(r"<bsdf.*</bsdf>", text, re.S)
    assert inner
    bsdf = mitsuba.load_string(inner[0].replace("<bsdf", '<bsdf version="3.0.0"', 1))
    for wi, wo in (((0.3, 0.2, 0.8), (-0.2, 0.1, 0.9)), ((0.1, -0.3, 0.6), (-0.1, 0.2, 0.9))):
        wi, wo = (np.array(w) / np.linalg.norm(w) for w in (wi, wo))
        wm = (wi + wo) / np.linalg.norm(wi + wo)
        with solver.float64():
            index = [*np.asarray(theta)[:6], 0.0, math.log(2 * math.sqrt(0.6 / 0.4)), theta[-1]]
            surface = Surface(tail=tail, masking="separable", fresnel="conductor")
            expected = models.brdfs(np.array(index), wi[:, None], wo[:, None], wm[:, None], surface)[0, 0] * wo[2]
        interaction = mitsuba.SurfaceInteraction3f()
        interaction.wi = mitsuba.Vector3f(*wi)
        found = bsdf.eval(mitsuba.BSDFContext(), interaction, mitsuba.Vector3f(*wo))
        assert found[0] == pytest.approx(expected, rel=2e-3)


def test_materialx_is_xml_whose_parts_are_joined():
    from xml.etree import ElementTree

    root = ElementTree.fromstring(export.text(ladder(entries(shear=0.05, diffuse=0.1)), "materialx")[0])
    names = {node.get("name") for node in root}
    used = {found.get("nodename") for found in root.iter("input") if found.get("nodename")}
    assert used <= names
    roughness = next(found for found in root.iter("input") if found.get("name") == "roughness")
    assert roughness.get("type") == "vector2"
