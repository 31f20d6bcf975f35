"""A scene file is read as it is meant, and each bad one is refused with file, key, what was got, and why."""

import json
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from ggxref.errors import InputError
from ggxref.scene import build, read

GOOD = """
[view]
origin = [0, -4, 1]
[materials.metal]
surface = "conductor"
alpha = [0.1, 0.4]
turn = 30
eta = 0.2
k = 3.9
[[shapes]]
kind = "sphere"
center = [0, 0, 0]
radius = 1
material = "metal"
[[lights]]
kind = "sun"
direction = [0, 0, 2]
radius = 5
radiance = 10
"""


def scene(directory, text=GOOD):
    path = directory / "scene.toml"
    path.write_text(text)
    return path


def test_reads_what_is_written(tmp_path):
    found = read.read(scene(tmp_path))
    (metal,) = found.materials
    assert_allclose(metal.A, np.diag([0.1, 0.4, 1]))
    assert_allclose(metal.turn, math.radians(30))
    assert_allclose(metal.f0, (0.8**2 + 3.9**2) / (1.2**2 + 3.9**2))  # Fresnel at normal incidence


BAD = {
    "unknown key": ("radius = 1\n", "radius = 1\ncolour = 3\n", ["shapes[0].colour", "not a known key", "center"]),
    "misspelt list": ("[[shapes]]", "[[shape]]", ["shape", "not a known key", "shapes"]),
    "misspelt table": ("[view]", "[veiw]", ["veiw", "not a known key", "view"]),
    "unknown table": ("[view]", "[views]\na = 1\n[view]", ["views", "not a known key"]),
    "alpha zero": ("[0.1, 0.4]", "0.0", ["materials.metal.alpha", "0.0", "positive"]),
    "alpha negative": ("[0.1, 0.4]", "[0.1, -0.4]", ["materials.metal.alpha", "-0.4", "positive"]),
    "alpha text": ("[0.1, 0.4]", '"rough"', ["materials.metal.alpha", "rough"]),
    "no alpha": ("alpha = [0.1, 0.4]", "", ["materials.metal", "exactly one of alpha, A, fit"]),
    "two shapes": ("turn = 30", "A = [[1,0,0],[0,1,0],[0,0,1]]", ["alpha and A", "exactly one"]),
    "singular": ("alpha = [0.1, 0.4]", "A = [[1,0,0],[1,0,0],[0,0,1]]", ["materials.metal.A", "singular"]),
    "missing fit": ("alpha = [0.1, 0.4]", 'fit = "none.json"', ["materials.metal.fit", "none.json", "no file"]),
    "unknown material": ('material = "metal"', 'material = "wood"', ["shapes[0].material", "wood", "metal"]),
    "missing key": ("radius = 1\n", "", ["shapes[0].radius", "missing"]),
    "infinite": ("radius = 1\n", "radius = inf\n", ["shapes[0].radius", "inf"]),
    "no direction": ("[0, 0, 2]", "[0, 0, 0]", ["lights[0].direction", "length 0"]),
    "from above": ("[0, -4, 1]", "[0, 0, 4]", ["view.origin", "upright"]),
    "not TOML": ("[view]", "[view", ["cannot be read as TOML"]),
    "two budgets": ("[view]", "[budget]\nsamples = 9\nseconds = 1\n[view]", ["budget.seconds", "one of the two"]),
    "no seconds": ("[view]", "[budget]\nseconds = 0\n[view]", ["budget.seconds", "(0, "]),
    "too many": ("[view]", "[budget]\nsamples = 1000000\n[view]", ["budget.samples", "1000000 samples of 96 x 64"]),
    "no lights": ("[[lights]]", "[[lamps]]", ["lights"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_scenes_are_refused_with_the_reason(tmp_path, case):
    old, new, words = BAD[case]
    assert old in GOOD
    path = scene(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(InputError) as error:
        read.read(path)
    for word in [str(path), *words]:
        assert word in str(error.value)
    assert "\n" not in str(error.value) or case == "not TOML"


def test_fit_is_read(tmp_path):
    """What `ggxref fit --json` writes: the chosen model's A, F0 and albedo, of bands their mean."""
    A = [[0.2, 0.05, 0.0], [0.0, 0.3, 0.0], [-0.1, 0.0, 1.0]]
    values = {"f0 red": 0.5, "f0 blue": 0.7, "diffuse red": 0.1, "diffuse blue": 0.3}
    parameters = {name: {"value": value} for name, value in values.items()}
    other = {"model": "isotropic", "A": np.eye(3).tolist(), "parameters": {}}
    document = {"chosen": "ellipsoid", "models": [other, {"model": "ellipsoid", "A": A, "parameters": parameters}]}
    (tmp_path / "fit.json").write_text(json.dumps(document))
    text = GOOD.replace("alpha = [0.1, 0.4]", 'fit = "fit.json"').replace("eta = 0.2\nk = 3.9\n", "")
    (metal,) = read.read(scene(tmp_path, text)).materials
    assert_allclose(metal.A, A)
    assert_allclose([metal.f0, metal.albedo], [0.6, 0.2])


def test_file_that_is_no_fit_is_refused(tmp_path):
    (tmp_path / "fit.json").write_text('{"chosen": "ellipsoid"}')
    path = scene(tmp_path, GOOD.replace("alpha = [0.1, 0.4]", 'fit = "fit.json"'))
    with pytest.raises(InputError, match=r"materials\.metal\.fit.*not what `ggxref fit --json` writes"):
        read.read(path)


def test_plainer_models_keep_what_they_say():
    A = np.array([[0.1, 0.05, 0.0], [0.0, 0.3, 0.0], [0.1, -0.2, 1.0]])
    scatter = A[:2, :2].T @ A[:2, :2]
    plain, turn = build.plainer(A, "anisotropic")
    c, s = math.cos(turn), math.sin(turn)
    axes = np.array([[c, s], [-s, c]])  # rows: the new x and y in the old frame
    assert_allclose(axes.T @ np.diag(plain.diagonal()[:2] ** 2) @ axes, scatter, atol=1e-14)
    isotropic, _ = build.plainer(A, "isotropic")
    assert_allclose(isotropic[0, 0] ** 4, np.linalg.det(scatter))
    assert build.plainer(A, "ellipsoid")[0] is A


@pytest.mark.parametrize(
    "arguments, words", [(["--tolerance", "-1"], ["--tolerance", "-1"]), (["--json", "no/where"], ["--json"])]
)
def test_command_line_exits_with_2(tmp_path, arguments, words):
    from ggxref.cli import app

    result = CliRunner().invoke(app, ["choose", str(scene(tmp_path)), *arguments])
    assert result.exit_code == 2
    assert all(word in result.stderr for word in words)
    missing = CliRunner().invoke(app, ["choose", str(tmp_path / "none.toml")])
    assert missing.exit_code == 2
    assert "none.toml" in missing.stderr
