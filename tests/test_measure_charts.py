"""Properties: speed counts every subject alike; a chart resumes, is whole or not there, and says what is wrong with its input."""

import csv
import json
import os
import time
import warnings
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from typer.testing import CliRunner

from ggxref.cli import app
from ggxref.measure import advice, charts, maps, peers, run, speed, tables, variance
from ggxref.measure.variants import QUANTITIES
from ggxref.sampling import spherical_cap


def test_turns_time_every_subject_equally_often_and_tell_fast_from_slow():
    calls = {"short": 0, "long": 0}

    def work(name, n):
        calls[name] += 1
        np.sort(np.arange(n)[::-1])

    subjects: dict[str, Callable[[], object]] = {
        "short": lambda: work("short", 10),
        "long": lambda: work("long", 1 << 20),
    }
    short, long = speed.interleaved(subjects, 1, seconds=0.05)
    assert short.runs == long.runs >= 5  # turns
    assert calls["short"] > calls["long"] > long.runs  # each as many calls as its turn holds
    assert short.median < long.median
    assert long.best <= long.lower <= long.median <= long.upper


def test_a_peer_that_cannot_run_is_left_out(monkeypatch):
    """Dr.Jit aborts its process when LLVM is too old for it: never this one."""
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "/nowhere")
    peers.runs.cache_clear()
    with warnings.catch_warnings(action="ignore"):
        left = peers.mitsuba(16)
    peers.runs.cache_clear()
    assert left == {}


def test_a_compiled_subject_knows_its_compilation_time():
    forms = {v.name: v.function for v in QUANTITIES["lambda"].variants[:2]}
    rows = speed.throughput(forms, 256, seconds=0.01)
    assert [r.subject for r in rows] == [*forms, "copy"]
    assert all(r.compilation > 0 for r in rows[:2]) and rows[2].compilation == 0


def test_a_compiled_subject_knows_its_memory():
    """A sampler in one loop holds nothing; packed into one array, its three components are held first: 12 bytes a point."""
    args = speed.inputs(("u", "wi", "alpha"), 1 << 14)
    assert speed.subject(spherical_cap.sample, args).memory == 0
    assert speed.subject(spherical_cap.sample, args, apart=False).memory == pytest.approx(12, rel=0.01)


def _pieces(points):
    def rows(k):
        return [
            {"quantity": q, "variant": v, "plane": "alpha-theta", "first": a, "second": b, "digits": k, "fault": 0.0}
            for q, v in (("ndf", "one"), ("ndf", "two"))
            for a in (0.1, 1.0)
            for b in (10.0, 80.0)
        ]

    return {"a": lambda: rows(0.0), "b": lambda: rows(1.0)}


def test_a_chart_goes_on_where_it_was_stopped(tmp_path, monkeypatch):
    calls = []

    def interrupted(points):
        def piece(name):
            calls.append(name)
            if calls == ["a", "b"]:
                raise KeyboardInterrupt
            return _pieces(points)[name]()

        return {"a": lambda: piece("a"), "b": lambda: piece("b")}

    monkeypatch.setitem(tables.KINDS, "stability", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run.chart("stability", tmp_path, 1024, lambda n: None)
    assert not list(tmp_path.glob("stability.*"))
    written = run.chart("stability", tmp_path, 1024, lambda n: None)
    assert calls == ["a", "b", "b"]  # "a" was read, not measured again
    assert {p.suffix for p in written} == {".csv", ".png", ".svg"}
    with open(tmp_path / "stability.csv") as file:
        assert len(list(csv.DictReader(file))) == 16
    assert (tmp_path / "stability.png").read_bytes().startswith(b"\x89PNG")


def _after(path, k):
    """A piece that ends when that file is there."""
    end = time.monotonic() + 60  # of a busy machine that starts a process
    while not path.exists() and time.monotonic() < end:
        time.sleep(0.01)
    return [{"k": k, "others": path.exists()}]


def test_pieces_are_kept_as_they_end_and_read_in_their_order(tmp_path, monkeypatch):
    """In two processes: the first piece waits for the last, the last for the second."""
    folder = tmp_path / ".pieces" / "stability-16"
    waits = {"a": folder / "c.json", "b": tmp_path, "c": folder / "b.json"}
    pieces = {name: partial(_after, path, name) for name, path in waits.items()}
    monkeypatch.setitem(tables.KINDS, "stability", lambda points: pieces)
    ticks = []
    rows = run.collect("stability", tmp_path, 16, 2, ticks.append)
    assert rows == [{"k": k, "others": True} for k in "abc"]
    assert sum(ticks) == 3
    assert rows == run.collect("stability", tmp_path, 16, 2, ticks.append)  # read again


def test_the_front_keeps_what_nothing_beats():
    rows = [{"ns": t, "worst": e} for t, e in ((1, 100), (2, 10), (3, 50), (4, 1), (5, 1))]
    assert [r["ns"] for r in charts.front(rows)] == [1, 2, 4]


def test_advice_names_the_best_form_of_each_quantity():
    row = {"quantity": "ndf", "dtype": "f32", "approximate": False}
    rows = [
        row | {"variant": "good", "worst": 3.0, "ns": 2.0},
        row | {"variant": "fast", "worst": 12.0, "ns": 1.0},
        row | {"variant": "cheap", "worst": 1e5, "ns": 0.5},
        row | {"variant": "good, f16", "dtype": "f16", "worst": 2.0**14, "ns": 3.0},
    ]
    line = advice.table(rows).splitlines()[-1]
    assert "good (3 ULP" in line and "fast (1 ns)" in line and "f16 2" in line and "cheap" not in line


def test_digits_lost_shows_where_the_printed_lambda_fails():
    q = QUANTITIES["lambda"]
    few = maps.Axis("α", np.array([1e-3, 1.0])), maps.Axis("θ", np.array([5.0, 80.0]))
    ours, printed = (maps.digits_lost(v.function, q.reference, *few)[0] for v in q.variants[:2])
    assert ours.max() < 1
    assert printed[0, 0] > 4 and printed[1, 1] < 1


def test_gradient_error_is_small_for_a_right_gradient_and_large_for_a_wrong_one():
    q = QUANTITIES["ndf"]
    few = maps.Axis("α", np.array([0.1, 1.0])), maps.Axis("θ", np.array([30.0, 60.0]))
    right, fault = maps.gradient_error(q.variants[0].function, q.reference, *few)
    assert right.max() < -5 and not fault.any()

    def other(wm, alpha):
        return q.variants[0].function(wm, alpha) * (1 + 0.01 * alpha[0])

    assert maps.gradient_error(other, q.reference, *few)[0].min() > -4


def test_every_sampler_estimates_the_same_albedo(monkeypatch):
    """One integral, eight estimators: seeded, 2^11 samples, within five standard errors of the cap's."""
    monkeypatch.setattr(variance, "SAMPLES", 1 << 11)
    alphas, thetas = np.array([0.4]), np.array([50.0])
    truth, spread = variance.variances("cap", alphas, thetas, seed=1)
    for name in ("normals", "V-cavity", "cross-section", "bounded cap", "ellipsoid cap"):
        mean, own = variance.variances(name, alphas, thetas, seed=2)
        error = np.sqrt((spread + own) / (1 << 11))
        assert abs(mean - truth) < 5 * error, name
        assert error < 0.02  # else the line above would pass anything


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(["sped", "--out", "x"], ["sped", "accuracy"]), (["speed", "--out", "FILE"], ["--out", "file"])],
)
def test_bad_input_is_named_on_one_line(arguments, words, tmp_path):
    taken = tmp_path / "taken"
    taken.write_text("")
    result = CliRunner().invoke(app, ["chart", *(str(taken) if a == "FILE" else a for a in arguments)])
    assert result.exit_code == 2
    assert all(word in result.stderr for word in words)


def test_a_killed_worker_is_told_on_one_line_and_what_was_finished_is_kept(tmp_path, monkeypatch):
    finished, killed = {"a": _pieces(1024)["a"]}, dict.fromkeys("bc", partial(os._exit, 9))  # two: for two processes
    monkeypatch.setitem(tables.KINDS, "stability", lambda points: finished)
    run.collect("stability", tmp_path, 1024, 1, lambda n: None)
    monkeypatch.setitem(tables.KINDS, "stability", lambda points: finished | killed)
    result = CliRunner().invoke(app, ["chart", "stability", "--out", str(tmp_path), "--points", "1024", "--jobs", "2"])
    assert result.exit_code == 1
    assert "worker" in result.stderr and len(result.stderr.split("\n")) == 3  # behind the bar and its line
    assert [path.name for path in tmp_path.rglob("*.*") if path.is_file()] == ["a.json"]


def test_pieces_hold_json(tmp_path):
    """What is kept on disk is what a fresh run would draw."""
    rows = tables._cells({"v": np.ones((2, 2))}, *(maps.Axis("x", np.array([1.0, 2.0])),) * 2, name="n")
    assert json.loads(json.dumps(rows)) == rows
