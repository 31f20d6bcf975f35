"""`ggxref verify`: exit codes, the JSON file, one-line errors, and a wrong formula found."""

import json
from functools import wraps

import pytest
from typer.testing import CliRunner

from ggxref import ndf
from ggxref.cli import app
from ggxref.verify import batch

runner = CliRunner()


def verify(*args):
    return runner.invoke(app, ["verify", *args])


def test_passing_checks_exit_0_and_write_json(tmp_path):
    path = tmp_path / "report.json"
    result = verify("--paper", "walter2014", "--equation", "1", "--json", str(path))
    assert result.exit_code == 0, result.output
    value = json.loads(path.read_text())
    assert [c["passed"] for c in value["checks"]] == [True] * len(value["checks"])
    assert [p.name for p in tmp_path.iterdir()] == ["report.json"]


def test_wrong_formula_exits_1(monkeypatch):
    right = ndf.ellipsoid

    @wraps(right)
    def wrong(wm, A):
        return right(wm, A) * 1.001

    monkeypatch.setattr(ndf, "ellipsoid", wrong)
    result = verify("--paper", "walter2014", "--equation", "(1)")
    batch.forget()
    assert result.exit_code == 1
    assert "above the tolerance" in result.output


@pytest.mark.parametrize(
    "args, said",
    [
        (["--paper", "heitz2015"], "heitz2014"),
        (["--paper", "walter2014", "--equation", "77"], "(28)"),
        (["--samples", "7"], "4096"),
        (["--samples", "many"], "integer"),
        (["--json", "/nowhere/at/all.json"], "there is no directory"),
        (["--pages", "/nowhere"], "there is no directory"),
        (["--pages", ".", "--paper", "walter2014"], "--pages: takes all checks"),
    ],
)
def test_bad_usage_exits_2_and_says_why(args, said):
    result = verify(*args)
    assert result.exit_code == 2
    assert said in result.output


def test_help_shows_an_example():
    result = verify("--help")
    assert result.exit_code == 0 and "Example" in result.output
