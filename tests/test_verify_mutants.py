"""Wrong formulas in the library's place are noticed; a harmless one is not, and the library is whole again afterwards."""

import json

import pytest
from typer.testing import CliRunner

from ggxref import ndf
from ggxref.cli import app
from ggxref.verify import engine, mutants, report
from ggxref.verify.mutants import MUTANTS, Mutant

SAMPLES = 1 << 13
runner = CliRunner()


def named(m):
    return f"{m.target}: {m.name}"


def test_there_are_sixty_told_apart():
    assert len({named(m) for m in MUTANTS}) == len(MUTANTS) >= 60


# Every twelfth, spread over all modules; `ggxref verify --mutants` runs the rest.
@pytest.mark.parametrize("mutant", MUTANTS[3::12], ids=named)
def test_mutant_is_killed(mutant):
    verdict = mutants.hunt(mutant, engine.registered(), SAMPLES)
    assert verdict.killer and not verdict.error <= verdict.killer.tolerance


def test_harmless_change_lives_and_the_library_is_restored():
    """Only the checks of one equation, so that all can be run."""
    right = ndf.hemisphere
    same = Mutant("ndf.hemisphere", "times one", lambda f: lambda wm: 1.0 * f(wm))
    checks = engine.select(engine.registered(), "dupuy2023", "3")
    verdict = mutants.hunt(same, checks, SAMPLES)
    assert verdict.killer is None
    assert ndf.hemisphere is right
    assert json.loads(report.hunt_document([verdict], 1.0))["mutants"][0]["killed_by"] is None


def test_checks_of_the_function_come_first():
    target = "masking.g2_v_cavity"
    found = mutants.suspects(Mutant(target, "", lambda f: f), engine.registered())
    own = [target in c.functions for c in found]
    assert own[0] and own == sorted(own, reverse=True)


@pytest.fixture
def few(monkeypatch):
    def choose(*chosen):
        monkeypatch.setattr(mutants, "MUTANTS", list(chosen))

    return choose


def test_command_shows_the_killer(few, tmp_path):
    few(MUTANTS[0])
    path = tmp_path / "mutants.json"
    result = runner.invoke(app, ["verify", "--mutants", "--samples", "4096", "--json", str(path)])
    assert result.exit_code == 0, result.output
    assert "1 mutants: 1 killed, 0 alive" in result.output
    (row,) = json.loads(path.read_text())["mutants"]
    assert row["function"] == "ndf.hemisphere" and row["killed_by"]["paper"] == "dupuy2023"


def test_command_fails_when_one_lives(few, monkeypatch):
    few(Mutant("ndf.hemisphere", "times one", lambda f: lambda wm: 1.0 * f(wm)))
    monkeypatch.setattr(mutants, "suspects", lambda mutant, checks: [])
    result = runner.invoke(app, ["verify", "--mutants"])
    assert result.exit_code == 1 and "1 alive" in result.output


def test_mutants_take_all_checks():
    result = runner.invoke(app, ["verify", "--mutants", "--paper", "walter2014"])
    assert result.exit_code == 2 and "--mutants" in result.output
