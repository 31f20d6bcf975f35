"""Properties: right answers pass and every mutant is rejected and named; a program that hangs, crashes or prints garbage
is reported; broken files end with exit code 2."""

import hashlib
import json
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ggxref.cli import app
from ggxref.golden import flags, grade, invalid, reading, text
from ggxref.golden.cases import mapped
from ggxref.golden.diagnose import prediction
from ggxref.golden.mistakes import MUTANTS
from ggxref.golden.reading import SHIPPED
from ggxref.golden.rounding import FORMATS
from ggxref.golden.samplers import FUNCTIONS
from ggxref.golden.verdict import judge

CLIENTS = Path(__file__).parents[1] / "docs" / "clients"
run = CliRunner().invoke


@cache
def of(function, dtype="f32"):
    """The shipped tests of a function in a dtype; the others are not parsed."""
    document = json.loads((SHIPPED / f"{function}.json").read_bytes())
    (group,) = (g for g in document["groups"] if g["dtype"] == dtype)
    document |= {"groups": [group], "count": len(group["tests"])}
    return list(reading.tests(json.dumps(document).encode(), function))


def right(test):
    """An answer that passes."""
    return test.result.expected if test.result and not test.outcomes else text.Failure("refused")


def graded(group, answers):
    return grade.collect(
        group, {(t.function.id, t.fmt.name, t.id): a for t, a in zip(group, answers, strict=True)}, False
    )


def test_the_shipped_set_is_what_it_claims():
    manifest = json.loads((SHIPPED / "manifest.json").read_text())
    assert manifest["count"] >= 12000
    assert sum(path.stat().st_size for path in SHIPPED.iterdir()) <= 8_000_000
    assert {name.removesuffix(".json") for name in manifest["files"]} == FUNCTIONS.keys()
    seen = set()
    for name, claim in manifest["files"].items():
        data = (SHIPPED / name).read_bytes()
        assert (claim["bytes"], claim["sha256"]) == (len(data), hashlib.sha256(data).hexdigest())
        document = json.loads(data)
        assert [group["dtype"] for group in document["groups"]] == list(FORMATS)
        seen |= document["flags"].keys()
    assert seen == flags.SENTENCES.keys() | invalid.SENTENCES.keys()


def test_right_answers_pass_and_one_wrong_bit_pattern_does_not():
    group = of("ndf.ggx")
    assert graded(group, map(right, group)).passed
    wrong = [0x7FC00000 if t.id == 1 else right(t) for t in group]
    failed = [v.test.id for v in graded(group, wrong).verdicts if not v.passed]
    assert failed == [1]


@pytest.mark.slow
def test_every_mutant_is_rejected_and_nine_of_ten_named():
    """In a process of its own: with types checked at run time it takes a minute."""
    assert len(MUTANTS) >= 40
    script = Path(__file__).parents[1] / "experiments" / "grade_mutants.py"
    done = subprocess.run([sys.executable, script], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_each_flag_kills_the_mutant_that_the_documentation_names():
    page = (CLIENTS.parent / "vectors.md").read_text()
    rows = re.findall(r"^\| (\w+) \| .* \| \d+ \| (\S+) \| (\S+) (\S+) (\d+) \|$", page, re.M)
    # No mutant takes a NaN; the last test of this file is about those.
    assert {flag for flag, *_ in rows} == (flags.SENTENCES.keys() | invalid.SENTENCES.keys()) - {"NotANumber"}
    for flag, mutant, function, dtype, id in rows:
        (test,) = (t for t in of(function, dtype) if t.id == int(id))
        assert flag in test.flags
        (predicted,) = (prediction(m, test) for m in MUTANTS if m.name == mutant)
        assert predicted is not None
        assert not judge(test, predicted).passed


def test_the_command_names_the_mutant_and_another_order_of_summation_passes(tmp_path):
    """`ggxref grade --python` on NumPy code: D of GGX right, with its sum turned round, and with alpha squared."""
    (tmp_path / "made_up_renderer.py").write_text(
        "import numpy as np\n"
        "def right(wm, alpha):\n"
        "    if wm[2] <= 0: return wm[2] * 0\n"
        "    q = wm[2] ** 2 + ((wm[1] / alpha[1]) ** 2 + (wm[0] / alpha[0]) ** 2)\n"
        "    return 1 / ((q * alpha[1]) * (q * alpha[0]) * wm.dtype.type(np.pi))\n"
        "def squared(wm, alpha): return right(wm, alpha * alpha)\n"
    )
    sys.path.insert(0, str(tmp_path))
    try:
        for name, code in {"right": 0, "squared": 1}.items():
            names, out, page = tmp_path / f"{name}.json", tmp_path / "grade.json", tmp_path / "grade.html"
            names.write_text(json.dumps({"ndf.ggx": f"made_up_renderer:{name}"}))
            asked = ["--functions", "ndf.ggx", "--dtypes", "f64,f32", "--json", str(out), "--html", str(page)]
            result = run(app, ["grade", "--map", str(names), *asked])
            assert result.exit_code == code, result.output
            graded = json.loads(out.read_text())
            assert graded["passed"] == (code == 0)
            assert [d["mutant"] for d in graded["diagnoses"]] == ["alpha_squared"] * code
            assert "<table>" in page.read_text()
            assert not re.search("https?:", page.read_text())
        assert "looks like alpha_squared" in result.stdout
        alone = re.search(r"alone: ggxref (.*)", result.stdout)
        assert alone
        again = run(app, alone[1].split())
        assert again.exit_code == 1
        assert "0 of 1 tests pass" in again.stdout
    finally:
        sys.path.remove(str(tmp_path))


PROGRAMS = {
    "hangs": ("import time; time.sleep(60)", "still running after 1 s"),
    "crashes": ("import os; os.abort()", "crashed with SIGABRT"),
    "fails": ("raise SystemExit(3)", "ended with exit code 3"),
    "prints garbage": ("print('Hello, world')", "printed garbage: line 1"),
    "prints for ever": ("while True: print('x' * 4096)", "printed"),
}


@pytest.mark.parametrize(("program", "message"), PROGRAMS.values(), ids=PROGRAMS)
def test_a_bad_program_is_reported(tmp_path, program, message):
    (tmp_path / "p.py").write_text(program)
    command = f"{sys.executable} {tmp_path / 'p.py'}"
    # Enough, on a busy machine, for the interpreter to start.
    timeout = "1" if "still running" in message else "60"
    result = run(
        app, ["grade", "--command", command, "--functions", "ndf.ggx", "--dtypes", "f32", "--timeout", timeout]
    )
    assert result.exit_code == 1
    assert message in result.stdout


CLIENT = {
    "c++": (["g++", "-O2", "-std=c++17", "-Wall", "-Wextra", "-Werror", "-o", "client", "client.cpp"], "./client"),
    "rust": (["rustc", "-O", "-o", "client", "client.rs"], "./client"),
    "javascript": (["node", "--check", "client.js"], "node client.js"),
}


@pytest.mark.parametrize(("build", "command"), CLIENT.values(), ids=CLIENT)
def test_the_clients_of_the_documentation_pass(tmp_path, monkeypatch, build, command):
    if not shutil.which(build[0]):
        pytest.skip(f"no {build[0]}")
    source = CLIENTS / build[-1]
    shutil.copy(source, tmp_path)
    monkeypatch.chdir(tmp_path)
    subprocess.run(build, check=True)
    functions = re.search(r"--functions (\S+) --dtypes f32,f64", source.read_text())
    assert functions
    result = run(app, ["grade", "--command", command, "--functions", functions[1], "--dtypes", "f32,f64"])
    assert result.exit_code == 0, result.output
    assert "not answered" not in result.stdout


@pytest.fixture
def directory(tmp_path):
    """A copy of one shipped file with a manifest of its own."""
    data = (SHIPPED / "ndf.hemisphere.json").read_bytes()
    return written(tmp_path, data)


def written(directory, data):
    claim = {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data), "count": 0}
    (directory / "ndf.hemisphere.json").write_bytes(data)
    manifest = {"schema": "ggxref-manifest-1", "files": {"ndf.hemisphere.json": claim}}
    (directory / "manifest.json").write_text(json.dumps(manifest))
    return directory


def changed(old, new):
    return lambda data: data.replace(old, new, 1)


BROKEN = {
    "truncated": (lambda data: data[: len(data) // 2], "not JSON"),
    "nested too deep": (lambda data: b"[" * 100000, "not JSON"),
    "another schema": (changed(b"ggxref-vectors-1", b"ggxref-vectors-9"), "wanted schema 'ggxref-vectors-1'"),
    "unknown dtype": (changed(b'"dtype":"f32"', b'"dtype":"f33"'), "unknown dtype 'f33'"),
    "unknown function": (changed(b'"ndf.hemisphere"', b'"ndf.hemispheer"'), "unknown function 'ndf.hemispheer'"),
    "wrong count": (lambda data: re.sub(rb'"count": \d+', b'"count": 1000000000', data), "'count' says 1000000000"),
    "a word too short": (changed(b'"expected":"0x', b'"expected":"0'), "is not 0x and"),
    "unknown flag": (changed(b'"flags":["', b'"flags":["X'), "is not in the file's list"),
    "a missing input": (changed(b'"wm":[', b'"wn":['), "wn"),
    "negative ulp": (lambda data: re.sub(rb'"ulp":\d+', b'"ulp":-1', data), "'ulp' wants a number >= 0"),
    "not a number": (lambda data: re.sub(rb'"condition":[\d.e+-]+', b'"condition":NaN', data), "condition"),
}


def refused(directory, message):
    result = run(app, ["grade", str(directory), "--command", "true", "--functions", "ndf"])
    assert result.exit_code == 2, result.output
    assert message in result.stderr
    assert result.stderr.count("\n") <= 2


@pytest.mark.parametrize(("change", "message"), BROKEN.values(), ids=BROKEN)
def test_a_broken_file_is_refused(directory, change, message):
    written(directory, change((directory / "ndf.hemisphere.json").read_bytes()))
    refused(directory, message)


@pytest.mark.parametrize(
    ("change", "message"),
    {
        "hash": ({"sha256": "0" * 64}, "the manifest says sha256 000"),
        "size": ({"bytes": 10**9}, "the manifest says bytes 1000000000"),
        "no number": ({"bytes": "many"}, "'bytes' wants int"),
    }.values(),
)
def test_a_manifest_that_lies_is_refused(directory, change, message):
    path = directory / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["files"]["ndf.hemisphere.json"] |= change
    path.write_text(json.dumps(manifest))
    refused(directory, message)


@pytest.mark.parametrize("name", ["../../etc/passwd", "/etc/passwd", "x.txt"])
def test_a_manifest_names_files_of_its_own_directory_only(directory, name):
    path = directory / "manifest.json"
    path.write_text(json.dumps({"schema": "ggxref-manifest-1", "files": {name: {}}}))
    refused(directory, "is not the name of a vector file")


@pytest.mark.parametrize(
    ("arguments", "message"),
    {
        "nobody": ([], "wanted one of --python"),
        "no module": (["--python", "no_such_module"], "cannot be imported"),
        "no program": (["--command", "/no/such/program"], "cannot be started"),
        "no answers": (["--answers", "/no/such/file"], "cannot be read"),
        "no test": (["--command", "true", "--test", "999999"], "none of the vectors"),
        "quick without jax": (["--python", "ggxref", "--quick"], "there is no --jax"),
        "nowhere to write": (["--command", "true", "--json", "/nowhere/at/all.json"], "there is no directory"),
    }.values(),
)
def test_bad_usage_ends_with_2(arguments, message):
    result = run(app, ["grade", "--functions", "ndf.ggx", *arguments])
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())


@pytest.mark.parametrize("options", [[], ["--quick"]])
def test_the_library_passes_as_compiled(options):
    """A slice, of values and gradients in all dtypes; the whole set takes a minute (docs/vectors.md)."""
    functions = "fresnel,masking.lambda_ggx,ndf.ggx.d_alpha,ndf.ggx.d_wm"
    result = run(app, ["grade", "--functions", functions, "--python", "ggxref", "--jax", *options])
    assert result.exit_code == 0, result.output
    assert re.search(r"passed: (\d+) of \1 tests pass", result.output)


def test_names_of_one_callable_are_answered_together(tmp_path, monkeypatch):
    """A callable without a hash under two names, and one of its derivatives alone at fault: the other one passes."""
    (tmp_path / "made_up_twins.py").write_text(
        "import jax\nfrom ggxref import ndf\n"
        "class Unhashable:\n"
        "    def __eq__(self, other): return True\n"
        "    def __call__(self, wm, alpha): return ndf.ggx(wm, alpha)\n"
        "ggx = Unhashable()\n"
        "@jax.custom_vjp\n"
        "def opaque(alpha): return alpha\n"
        "def backward(_, change): raise TypeError('opaque')\n"
        "opaque.defvjp(lambda alpha: (alpha, None), backward)\n"
        "def half(wm, alpha): return ndf.ggx(wm, opaque(alpha))\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    whole = tmp_path / "whole.json"
    whole.write_text(json.dumps({"ndf.ggx": "made_up_twins:ggx", "sampling.normals.pdf_ggx": "made_up_twins:ggx"}))
    asked = ["grade", "--functions", "ndf.ggx,ndf.ggx.d_wm,ndf.ggx.d_alpha,sampling.normals.pdf_ggx", "--dtypes", "f32"]
    output = run(app, [*asked, "--map", str(whole), "--jax"]).output
    for name in ("ndf.ggx", "ndf.ggx.d_wm", "ndf.ggx.d_alpha"):
        assert re.search(rf"{re.escape(name)} f32 +(\d+) +\1 ", output), output
    assert not re.search(r"pdf_ggx f32 +(\d+) +\1 ", output)  # D is not D cos
    whole.write_text(json.dumps({"ndf.ggx": "made_up_twins:half"}))
    output = run(app, [*asked, "--map", str(whole), "--jax"]).output
    assert re.search(r"ndf.ggx.d_wm f32 +(\d+) +\1 ", output), output
    assert re.search(r"ndf.ggx.d_alpha f32 .*TypeError: opaque", output), output


def test_functions_that_end_their_process_are_reported(tmp_path, monkeypatch):
    (tmp_path / "made_up_crash.py").write_text(
        "import os, types\nfresnel = bsdf = types.SimpleNamespace()\n"
        "for name in 'dielectric conductor schlick brdf btdf'.split(): setattr(bsdf, name, lambda **_: os._exit(3))\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("os.cpu_count", lambda: 2)  # of one, it would be this process
    result = run(app, ["grade", "--functions", "fresnel,bsdf", "--python", "made_up_crash", "--jax"])
    assert result.exit_code == 1
    assert "ended the process" in result.output


def test_answers_of_a_file_are_graded_as_those_of_a_program(tmp_path):
    group = of("ndf.ggx")
    lines = [f"{t.id:x} {text.words(right(t), t.fmt)}" for t in group if t.result and not t.outcomes]
    (tmp_path / "a.txt").write_text("\n".join(["ndf.ggx f32", *lines]) + "\n")
    asked = ["grade", "--answers", str(tmp_path / "a.txt"), "--functions", "ndf.ggx", "--dtypes", "f32"]
    assert run(app, asked).exit_code == 0
    (tmp_path / "a.txt").write_text("\n".join(["ndf.ggx f32", *lines[:-1]]) + "\n")
    result = run(app, asked)
    assert result.exit_code == 1
    assert "no answer" in result.stdout


def test_an_invalid_input_may_be_refused_or_show_but_not_be_plausible():
    broken = next(t for t in of("ndf.ggx") if "NotANumber" in t.flags)
    assert judge(broken, text.Failure("raised")).passed
    assert judge(broken, mapped(lambda _: 0x7FC00000, 0)).passed
    assert judge(broken, 0).passed
    assert not judge(broken, 0x3F800000).passed
