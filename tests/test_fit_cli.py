"""`ggxref fit`: what it prints and writes, and its exit codes; nothing is written unless all went well."""

import json

import fit_data
import numpy as np
import pytest
from typer.testing import CliRunner

from ggxref.cli import app
from ggxref.fit import figures

A = fit_data.shape((0.0, 0.0), ((0.04, 0.0), (0.0, 0.04)))
PLANE = fit_data.plane_angles()
ROUGH = fit_data.rough_surface()


def run(*words):
    return CliRunner().invoke(app, ["fit", *map(str, words)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("measured")


@pytest.fixture(scope="module")
def table(folder):
    values = fit_data.brdf(PLANE, A, 0.6, 0.1) * np.exp(0.1 * np.random.default_rng(8).normal(size=len(PLANE)))
    return fit_data.write(folder / "metal.csv", fit_data.table(PLANE, values))


@pytest.fixture(scope="module")
def surface(folder):
    return fit_data.write(folder / "surface.x3p", fit_data.x3p(ROUGH))


@pytest.fixture(scope="module")
def lobes(table, folder):
    return run(table, "--tail", "ggx", "--json", folder / "lobes.json", "--figure", folder / "lobes.png")


@pytest.fixture(scope="module")
def density(surface, folder):
    return run(surface, "--json", folder / "density.json", "--figure", folder / "density.pdf")


def test_reflectance(lobes, table):
    assert lobes.exit_code == 0, lobes.output
    assert "Smallest model that suffices: isotropic" in lobes.output
    assert "cannot see" in lobes.output and str(table) in lobes.output
    assert "no lit sphere: all directions lie in one plane" in lobes.output.replace("\n", " ")


def test_heights(density):
    assert density.exit_code == 0, density.output
    assert "log-likelihood" in density.output and "anisotropy" in density.output
    assert "levelled by a polynomial of degree 1, not smoothed" in density.output
    assert "2116 slopes by central differences" in density.output


def test_json_repeats_the_fit(lobes, density, folder, table):
    lobe = json.loads((folder / "lobes.json").read_text())
    assert lobe["schema"] == "ggxref-fit-1" and lobe["kind"] == "reflectance" and lobe["chosen"] == "isotropic"
    assert lobe["options"]["tail"] == "ggx" and lobe["options"]["min_cosine"] == 0.05 and lobe["options"]["fixed"] == {}
    assert lobe["source"]["path"] == str(table) and len(lobe["source"]["sha256"]) == 64
    best = lobe["models"][0]
    assert best["converged"] and best["parameters"]["alpha"]["free"]
    assert best["parameters"]["alpha"]["value"] == pytest.approx(
        0.2, abs=4 * best["parameters"]["alpha"]["standard_error"]
    )
    # The shape matrix is the one of the parameters: A = diag(α, α, 1).
    assert best["A"][0][0] == pytest.approx(best["parameters"]["alpha"]["value"])
    assert json.loads((folder / "density.json").read_text())["kind"] == "heights"


def test_figures_are_of_their_format(lobes, density, folder):
    assert (folder / "lobes.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "density.pdf").read_bytes().startswith(b"%PDF")


def test_no_temporary_file_is_left(lobes, density, folder):
    names = {path.name for path in folder.iterdir()}
    assert names == {
        "metal.csv", "surface.x3p", "lobes.json", "lobes.png", "lobes-residuals.png", "density.json", "density.pdf"
    }  # fmt: skip


def test_a_figure_shows_the_chosen_model_and_one_to_compare(surface):
    from ggxref.fit import fit, read

    ladder = fit(read(surface))
    shown = figures.shown(ladder)
    assert shown[0] is ladder.best and shown[1] is not ladder.best


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nothing.csv"], "nothing.csv: no such file"),
        (["metal.csv", "--model", "phong"], "model 'phong'; need auto or one of isotropic"),
        (["metal.csv", "--model", "rotated"], "cannot tell it from a smaller one"),
        (["metal.csv", "--tail", "cauchy"], "tail 'cauchy'; need auto or one of ggx"),
        (["metal.csv", "--masking", "none"], "masking 'none'; need one of height_correlated"),
        (["metal.csv", "--fresnel", "none"], "fresnel 'none'; need one of schlick"),
        (["metal.csv", "--fix", "alpha=0"], "alpha_x = 0; need a positive number"),
        (["metal.csv", "--fix", "alpha=-1"], "alpha_x = -1; need a positive number"),
        (["metal.csv", "--fix", "alpha=wide"], "--fix alpha: got 'wide'"),
        (["metal.csv", "--fix", "alpha"], "need NAME=VALUE"),
        (["metal.csv", "--fix", "gloss=1"], "no parameter 'gloss' to fix"),
        (["surface.x3p", "--fix", "A=1,0,0,0,1,0,1,1,0"], "is singular"),
        (["surface.x3p", "--fix", "A=1,0,0"], "need 9 numbers"),
        (["surface.x3p", "--pixel", "1,2,3"], "need one size in metres, or two"),
        (["surface.x3p", "--level", "99"], "polynomial of degree 99"),
        (["surface.x3p", "--slopes", "sobel"], "slopes 'sobel'; need one of central, cell, facet"),
        (["surface.x3p", "--smooth", "nan"], "a cutoff of nan m; need a length in metres"),
        (["surface.x3p", "--smooth", "5"], "a cutoff of 5 m; need more than a pixel, 1e-06 m, and at most"),
        (["metal.csv", "--min-cosine", "1"], "smallest cosine 1"),
        (["metal.csv", "--figure", "a.gif"], "no figure format"),
        (["metal.csv", "--json", "missing/a.json"], "there is no directory missing"),
        (["metal.csv", "--json", "."], "it is a directory"),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(table, surface, folder, monkeypatch, words, said):
    monkeypatch.chdir(folder)
    before = sorted(folder.iterdir())
    result = run(*words, *(["--json", "out.json"] if "--json" not in words else []))
    assert result.exit_code == 2, result.output
    assert said in result.output
    assert len(result.output.strip().splitlines()) == 1
    assert sorted(folder.iterdir()) == before


def test_a_fit_that_found_nothing_exits_with_1(folder):
    """A diffuse surface has no lobe to fit."""
    flat = fit_data.write(folder / "flat.csv", fit_data.table(PLANE, np.full(len(PLANE), 0.1)))
    try:
        result = run(flat, "--model", "isotropic", "--tail", "ggx")
    finally:
        flat.unlink()
    assert result.exit_code == 1, result.output
    assert "not identified" in result.output or "not converged" in result.output


def test_a_whole_shape_can_be_held(surface):
    result = run(surface, "--model", "ellipsoid", "--tail", "ggx", "--fix", "A=0.2,0.01,0,0,0.1,0,0.05,0,1")
    assert result.exit_code == 0, result.output
    assert "held" in result.output


def test_help_shows_an_example():
    assert "Example: ggxref fit" in run("--help").output
