"""Many files into one table: as if fitted alone, resumed, and past a bad one."""

import csv

import fit_data
import numpy as np
import pytest
from typer.testing import CliRunner

from ggxref.cli import app
from ggxref.fit import fit, many, read
from ggxref.fit.preparation import Options

PLANE = fit_data.plane_angles()
OPTIONS = Options(tail="ggx")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("many")
    for k, alpha in enumerate((0.15, 0.3)):
        A = fit_data.shape((0.0, 0.0), ((alpha**2, 0.0), (0.0, alpha**2)))
        noise = np.exp(0.1 * np.random.default_rng(k).normal(size=len(PLANE)))
        fit_data.write(folder / f"{k}.csv", fit_data.table(PLANE, fit_data.brdf(PLANE, A, 0.6, 0.1) * noise))
    fit_data.write(folder / "bad.csv", "no measurement")
    return folder


@pytest.fixture(scope="module")
def rows(folder):
    paths = [folder / "0.csv", folder / "bad.csv", folder / "1.csv"]
    return many.fit_files(paths, folder / "fits.csv", OPTIONS, None, lambda _: None)


def test_a_row_is_the_fit_alone(rows, folder):
    alone = fit(read(folder / "1.csv"), tail="ggx").best
    assert rows[2]["model"] == alone.model.name and rows[2]["status"] == "good"
    assert float(rows[2]["alpha_x"]) == pytest.approx(alone.values["alpha_x"], rel=1e-5)
    assert float(rows[2]["alpha_x error"]) == pytest.approx(alone.errors["alpha_x"], rel=1e-3)


def test_a_bad_file_is_a_row_and_stops_nothing(rows):
    assert rows[1]["status"].startswith("error: ") and "no measurement" in rows[1]["status"]
    assert rows[0]["status"] == "good"


def test_the_table_is_what_was_returned(rows, folder):
    with (folder / "fits.csv").open(newline="") as stream:
        again = list(csv.DictReader(stream))
    assert [row["file"] for row in again] == [row["file"] for row in rows]
    assert again[0]["alpha_x"] == rows[0]["alpha_x"]


def test_it_goes_on_where_it_stopped(rows, folder, monkeypatch):
    """Rows of the same bytes and options are kept; a file that changed is fitted again."""
    fitted = []
    monkeypatch.setattr(many, "_rows", lambda paths, *_: fitted.extend(paths) or iter([]))
    paths = [folder / "0.csv", folder / "1.csv"]
    assert many.fit_files(paths, folder / "fits.csv", OPTIONS, None, lambda _: None)[0] == {
        key: rows[0].get(key, "")
        for key in many.fit_files(paths, folder / "fits.csv", OPTIONS, None, lambda _: None)[0]
    }
    assert not fitted
    with pytest.raises(KeyError):  # nothing is fitted here, so that the row is missing
        many.fit_files([folder / "new.csv"], folder / "fits.csv", Options(tail="student_t"), None, lambda _: None)
    assert fitted == [folder / "new.csv"]


def test_what_was_done_before_an_interruption_is_kept(rows, folder, monkeypatch):
    """Files of another kind than those that were being fitted have their rows already."""
    real = many.fitting.fit_prepared

    def interrupted(several):
        if len(several) == 2:
            raise KeyboardInterrupt
        return real(several)

    surface = fit_data.write(folder / "surface.x3p", fit_data.x3p(fit_data.rough_surface()))
    paths, table = [surface, folder / "0.csv", folder / "1.csv", folder / "bad.csv"], folder / "stopped.csv"
    monkeypatch.setattr(many.fitting, "fit_prepared", interrupted)
    with pytest.raises(KeyboardInterrupt):
        many.fit_files(paths, table, OPTIONS, None, lambda _: None)
    with table.open(newline="") as stream:
        assert [row["file"] for row in csv.DictReader(stream)] == [str(surface), str(folder / "bad.csv")]


def test_rows_of_other_files_stay(rows, folder):
    table = folder / "fits.csv"
    many.fit_files([folder / "1.csv"], table, OPTIONS, None, lambda _: None)
    with table.open(newline="") as stream:
        assert {row["file"] for row in csv.DictReader(stream)} == {row["file"] for row in rows}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--table", "t.csv", "--bootstrap", "10"], "--bootstrap is for one FILE"),
        (["--nearest"], "--nearest is for --export"),
    ],
)
def test_options_that_would_do_nothing_are_refused(folder, options, said):
    result = CliRunner().invoke(app, ["fit", str(folder / "0.csv"), *options])
    assert result.exit_code == 2 and said in result.output


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b\n1,2\n", "is no table of fits"),
        (",".join(many.FIRST) + "\n" + "x," * len(many.FIRST) + "x\n", "row 2: more cells than columns"),
    ],
)
def test_another_table_is_not_overwritten(folder, text, said):
    other = fit_data.write(folder / "other.csv", text)
    result = CliRunner().invoke(app, ["fit", str(folder / "0.csv"), "--table", str(other)])
    assert result.exit_code == 2 and said in result.output
    assert other.read_text() == text


def test_several_files_need_a_table(folder):
    result = CliRunner().invoke(app, ["fit", str(folder / "0.csv"), str(folder / "1.csv")])
    assert result.exit_code == 2 and "2 files; need one, or --table" in result.output
