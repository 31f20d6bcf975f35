"""Properties: an order always gives the same bytes, from any number of workers; every result is correctly rounded; the
condition number predicts what a change of the input does; a run that stops leaves the old vectors."""

import hashlib
import json
import math

import pytest
from flint import fmpq
from typer.testing import CliRunner

from ggxref.cli import app
from ggxref.errors import InputError
from ggxref.golden import generate, solve
from ggxref.golden.budget import sensitivity
from ggxref.golden.cases import Case, case
from ggxref.golden.reading import SHIPPED, read
from ggxref.golden.rounding import F16, F32, F64, FORMATS, Undecided, decode, rational, to_float, to_hex
from ggxref.golden.samplers import FUNCTIONS
from ggxref.golden.themes import themes
from ggxref.oracle.precision import digits

SMALL = generate.order("ndf.ggx,masking.g2_separable,sampling.spherical_cap.sample", "f32,f16", 24, 1)


def contents(directory):
    return {path.name: path.read_bytes() for path in sorted(directory.iterdir())}


def condition(case: Case) -> fmpq:
    return sensitivity(case).condition


def given(function: str, fmt=F32, **values) -> Case:
    """A case of numbers chosen by hand."""
    return Case(FUNCTIONS[function], fmt, {}, {}, values)


def test_one_process_and_two_write_the_same_bytes(tmp_path):
    generate.generate(SMALL, tmp_path / "one")
    generate.generate(SMALL, tmp_path / "two", jobs=2)
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    assert len(contents(tmp_path / "one")) == 4
    assert sorted(p.name for p in tmp_path.iterdir()) == ["one", "two"]


def test_these_bytes_are_the_ones_of_every_machine_and_python(tmp_path):
    """Pinned: if they change on purpose, raise generate.VERSION and make the shipped vectors anew."""
    manifest = generate.generate(SMALL, tmp_path / "v")
    assert manifest["tests_sha256"][:16] == "cf54be6e58d7ef03"


@pytest.mark.parametrize("name", ["ndf.ellipsoid", "sampling.bounded_cap.sample", "masking.g1_beckmann.d_alpha"])
def test_the_shipped_vectors_are_generated_again_from_nothing(name):
    """A slice: the first tests of a function in each dtype, character by character."""
    shipped = json.loads((SHIPPED / f"{name}.json").read_bytes())
    for group in shipped["groups"]:
        lines = generate.tests(1, name, group["dtype"], 5)
        assert lines == [generate.compact(test) for test in group["tests"][:5]]


def test_another_seed_draws_other_tests(tmp_path):
    order = generate.order("ndf.ggx", "f32", 6, 2)
    lines = generate.tests(order.seed, "ndf.ggx", "f32", 6)
    assert lines != generate.tests(1, "ndf.ggx", "f32", 6)
    assert lines == generate.tests(2, "ndf.ggx", "f32", 9)[:6]


def test_the_manifest_counts_and_hashes_what_is_there(tmp_path):
    seen = []
    manifest = generate.generate(SMALL, tmp_path / "v", advance=seen.append)
    assert sum(seen) == manifest["count"] == 24 == sum(f["count"] for f in manifest["files"].values())
    for name, claim in manifest["files"].items():
        data = (tmp_path / "v" / name).read_bytes()
        assert (claim["bytes"], claim["sha256"]) == (len(data), hashlib.sha256(data).hexdigest())
    assert json.loads((tmp_path / "v" / "manifest.json").read_text()) == manifest
    assert len(list(read(tmp_path / "v"))) == 24


def test_an_interrupted_run_leaves_the_old_vectors_alone(tmp_path):
    directory = tmp_path / "v"
    generate.generate(SMALL, directory)
    before = contents(directory)

    def stop(done):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        generate.generate(generate.order("ndf", "f64", 10, 3), directory, advance=stop)
    assert contents(directory) == before
    assert [p.name for p in tmp_path.iterdir()] == ["v"]


def test_quotas_follow_the_number_of_themes_and_add_up():
    for count in (1, 7, 1000):
        quotas = generate.order("all", "all", count, 1).quotas()
        assert sum(quotas.values()) == count
        assert len(quotas) == len(FUNCTIONS) * len(FORMATS)
    default = generate.order("ndf.ggx", "f32", None, 1).quotas()
    assert default == {("ndf.ggx", "f32"): len(themes(FUNCTIONS["ndf.ggx"]))}


def test_a_function_that_has_no_more_inputs_says_so(monkeypatch):
    monkeypatch.setattr(generate, "test", lambda case: {"inputs": {}})
    with pytest.raises(InputError, match=r"ndf\.ggx in f32: asked for 2 different tests, there are 1"):
        generate.tests(1, "ndf.ggx", "f32", 2)


@pytest.mark.parametrize(
    "name", ["ndf.student_t", "masking.lambda_beckmann", "sampling.lune.sample", "ellipsoid.to_slopes"]
)
@pytest.mark.parametrize("fmt", FORMATS.values(), ids=FORMATS)
def test_expected_is_the_exact_result_rounded_to_nearest(name, fmt):
    """Against the digits that the oracle itself proves, by comparing distances to the two neighbours."""
    function = FUNCTIONS[name]
    for record, c in ((solve.test(c), c) for i in range(8) if (c := case(1, function, fmt, i))):
        if record is None:
            continue
        exact = [*solve.leaves(tuple_of(digits(name, c.values, 60)))]
        for text, shown, word in zip(
            exact, solve.leaves(tuple_of(record["exact"])), solve.leaves(tuple_of(record["expected"])), strict=True
        ):
            x, bits = rational(text), int(word, 16)
            assert to_float(rational(shown)) == to_float(x)
            magnitude = bits & (fmt.sign - 1)
            error = abs(abs(x) - decode(magnitude, fmt))
            assert error <= abs(abs(x) - decode(magnitude + 1, fmt))
            assert magnitude == 0 or error <= abs(abs(x) - decode(magnitude - 1, fmt))
            assert x == 0 or (x < 0) == bool(bits & fmt.sign)


def tuple_of(x):
    return tuple(map(tuple_of, x)) if isinstance(x, list | tuple) else x


def test_infinities_ties_overflow_and_underflow_have_their_bits():
    one = fmpq(1)
    horizon = {"w": (one, 0 * one, 0 * one), "alpha": (one, one)}
    exact = solve.proven(FUNCTIONS["masking.lambda_ggx"], horizon, F32)
    assert (exact.expected, exact.digits) == (F32.infinity, "inf")
    half_ulp = 1 + fmpq(1, 2**11)
    tie = solve.proven(FUNCTIONS["masking.g2_separable"], {"g1_i": half_ulp, "g1_o": one}, F16)
    assert tie.expected == 0x3C00
    up = solve.proven(FUNCTIONS["masking.g2_separable"], {"g1_i": 1 + 3 * fmpq(1, 2**11), "g1_o": one}, F16)
    assert up.expected == 0x3C02
    size = {"w": (0 * one, 0 * one, one), "A": ((one, 0, 0), (0, one, 0), (0, 0, one))}
    assert solve.proven(FUNCTIONS["ellipsoid.projected_area"], size | {"size": fmpq(200)}, F16).expected == 0x7C00
    tiny = fmpq(1, 2**80)
    assert solve.proven(FUNCTIONS["masking.g2_separable"], {"g1_i": tiny, "g1_o": tiny}, F32).expected == 0


def test_a_result_that_stays_undecided_is_left_out(monkeypatch):
    """The tie of two irrational numbers' sum cannot be told; no test may be made of it."""

    def undecided(*_):
        raise Undecided("never")

    c = case(1, FUNCTIONS["ndf.ggx"], F32, 1)
    assert c and solve.test(c)
    monkeypatch.setattr(solve, "round_ball", undecided)
    assert solve.test(c) is None


def test_condition_of_powers_products_and_cancellation():
    one, third = fmpq(1), fmpq(1, 3)
    assert condition(given("masking.g2_separable", g1_i=third, g1_o=third)) == 2
    assert condition(given("jacobian.slope", wm=(0 * one, 0 * one, one))) == 0
    assert condition(given("fresnel.schlick", cos_i=one, f0=fmpq(1, 2))) == 1
    # w.m is 1/1000 of the sum of its terms' magnitudes; the errors of both vectors count.
    w, m = (one, 0 * one, one), (-one, 0 * one, 1 + fmpq(1, 500))
    assert 1900 < condition(given("jacobian.reflection", wo=w, wm=m)) < 2100


def test_condition_predicts_the_effect_of_half_an_ulp():
    """Negative control: a tenth of the predicted spread must be exceeded."""
    c = case(1, FUNCTIONS["masking.g1_ggx"], F32, themes(FUNCTIONS["masking.g1_ggx"]).index({"wi": "grazing"}))
    assert c
    step = fmpq(1, 2**24)
    moved = {a: tuple(x * (1 + step * (-1) ** i) for i, x in enumerate(v)) for a, v in c.values.items()}
    f, g = (rational(digits("masking.g1_ggx", v, 30)) for v in (c.values, moved))
    assert step * condition(c) / 10 < abs(g - f) / f < step * condition(c)


def test_a_function_that_is_zero_around_has_no_condition_and_a_jump_is_refused():
    one = fmpq(1)
    below = given("ndf.ggx", wm=(one / 2, one / 2, -one), alpha=(one, one))
    assert condition(below) == 0
    edge = given("masking.g1_ggx", w=(one, 0 * one, one), wm=(-one, 0 * one, one), alpha=(one, one))
    with pytest.raises(OverflowError, match="not 0 beside it"):
        condition(edge)


def test_the_command_writes_prints_and_refuses(tmp_path):
    run = CliRunner().invoke
    directory, summary = tmp_path / "new" / "v", tmp_path / "m.json"
    arguments = ["vectors", str(directory), "--functions", "ndf.ggx", "--dtypes", "f32", "--count", "5"]
    done = run(app, [*arguments, "--json", str(summary)])
    assert done.exit_code == 0
    assert json.loads(summary.read_text())["tests_sha256"] in done.stdout
    assert "5 tests in 1 files" in done.stdout
    (tmp_path / "file").write_text("")
    for bad, message in {
        ("vectors", str(tmp_path / "file")): "is a file",
        ("vectors", str(tmp_path / "x"), "--functions", "ndf.ggxx"): "did you mean ndf.ggx?",
        ("vectors", str(tmp_path / "x"), "--dtypes", "f8"): "no dtype 'f8'",
        ("vectors", str(tmp_path / "x"), "--count", "0"): "0 is no number of tests",
        ("vectors", str(tmp_path / "file" / "x"), "--functions", "ndf.ggx", "--count", "1"): "cannot be written",
    }.items():
        result = run(app, list(bad))
        assert result.exit_code == 2
        assert message in result.stderr
        assert result.stderr.count("\n") <= 2
    assert not (tmp_path / "x").exists()


def test_hex_words_are_what_a_program_of_another_language_reads():
    c = case(1, FUNCTIONS["ndf.ggx"], F64, 1)
    assert c
    record = solve.test(c)
    assert record
    words = record["inputs"]["wm"]
    assert all(len(w) == 18 and float.fromhex(float(decode(int(w, 16), F64)).hex()) <= 1 for w in words)
    assert words == tuple(to_hex(b, F64) for b in c.bits["wm"])
    assert math.isfinite(record["condition"])
