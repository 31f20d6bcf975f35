"""A check fails on a wrong formula, on NaN and on an error; a control that passes is reported; records have their format."""

import json
import math

import numpy as np
import pytest

from ggxref.errors import InputError
from ggxref.verify import engine, errata, report
from ggxref.verify.batch import batched
from ggxref.verify.engine import Check, Stream

RECORD = ["paper", "equation", "statement", "method", "error", "tolerance", "passed", "seconds", "control"]


def made(formula=lambda x: 2 * x, wrong=lambda f: lambda x: f(x) + 1, body=None, method="exact"):
    body = body or (lambda f: abs(f(3.0) - 6))
    return Check("ours", "(1)", "twice", method, (formula,), 1e-9, "one more", wrong, body)


def test_right_formula_passes_and_wrong_one_is_caught():
    record = made().run()
    assert record.passed and record.control.caught and record.good
    assert record.control.error == 1


def test_wrong_formula_fails():
    assert not made(formula=lambda x: 2 * x + 1e-3).run().passed


def test_nan_fails():
    record = made(body=lambda f: math.nan).run()
    assert not record.passed


def test_error_inside_a_check_fails_it_alone():
    def broken(f):
        raise ValueError("no such thing")

    record = made(body=broken).run()
    assert not record.passed and "no such thing" in record.failure


def test_control_that_stops_with_an_error_is_not_caught():
    record = made(wrong=lambda f: lambda x: 1 / 0).run()
    assert record.passed and not record.control.caught and not record.good


def test_control_that_passes_is_not_caught():
    record = made(wrong=lambda f: f).run()
    assert record.passed and not record.control.caught
    assert any("not caught" in line for line in report.problems(record))


def test_stream_depends_on_the_name_alone():
    first, second, other = Stream("a", 4).uniform(5), Stream("a", 8).uniform(5), Stream("b", 4).uniform(5)
    assert np.array_equal(first, second) and not np.array_equal(first, other)


def test_json_has_the_agreed_fields():
    record = made(body=lambda f: math.nan).run()
    value = json.loads(report.document([record], [], 1.5))
    assert list(value) == ["version", "seconds", "checks", "errata"]
    assert list(value["checks"][0]) == RECORD
    assert list(value["checks"][0]["control"]) == ["mutant", "error", "caught"]
    assert value["checks"][0]["error"] is None


def test_registered_checks_are_told_apart_and_use_the_methods():
    checks = engine.registered()
    names = [(c.paper, c.equation, c.statement) for c in checks]
    assert len(set(names)) == len(names)
    assert {c.method for c in checks} <= set(engine.METHODS)
    assert {c.paper for c in checks} == set(engine.PAPERS)


# Statements that are about size, not equality: a factor of ten or a hundred, a power of two, two printed digits.
ROUGH = {
    ("heitz2014", "limitation"),
    ("heitz2014", "table 2"),
    ("heitz2014", "§2.2 Walter's trick"),
    ("walter2014", "§4.2"),
    ("dupuy2023", "abstract"),
    ("dupuy2023", "table 1"),
}


def test_only_statements_about_size_have_a_wide_tolerance():
    wide = {(c.paper, c.equation) for c in engine.registered() if c.tolerance > 1e-3 and c.method != "monte_carlo"}
    assert wide == ROUGH


def test_selection_by_paper_and_equation():
    checks = engine.registered()
    some = engine.select(checks, "walter2014", "28")
    assert some and all(c.paper == "walter2014" and c.equation == "(28)" for c in some)
    assert engine.select(checks, None, "algorithm 4")


@pytest.mark.parametrize(
    "paper, equation, said",
    [("walter2015", None, "walter2014"), ("walter2014", "99", "(28)"), (None, "none", "(28)")],
)
def test_unknown_selection_says_what_there_is(paper, equation, said):
    with pytest.raises(InputError, match="there are") as raised:
        engine.select(engine.registered(), paper, equation)
    assert said in str(raised.value)


def test_a_check_stands_at_all_its_places():
    """The exact form of (6) of heitz2014 states (7) too; a derivative serves equations of two documents."""
    checks = engine.registered()
    (shared,) = [c for c in checks if ("tokuyoshi2024", "(18)") in c.also]
    assert shared.paper == "dupuy2023"
    assert shared in engine.select(checks, "tokuyoshi2024", "18")
    assert shared in engine.select(checks, "dupuy2023") and shared in engine.select(checks, "tokuyoshi2024")


def test_errata_carry_the_numbers_of_their_check():
    checks = [c for c in engine.registered() if c.statement.startswith("erratum") and c.paper == "walter2014"]
    check = next(c for c in checks if c.equation == "(25)")
    (found,) = errata.found([check.run()])
    assert found["printed"] == "(M a) × (M b) = |M| Mᵀ (a × b)"
    assert "as printed" in found["evidence"]


def test_batched_maps_over_broadcast_axes_in_blocks():
    alpha = np.array([[0.3, 0.5], [0.1, 0.1]])
    m = np.random.default_rng(1).normal(size=(5000, 1, 3))
    m[..., 2] = np.abs(m[..., 2])
    m /= np.linalg.norm(m, axis=-1, keepdims=True)
    D = batched("ndf.ggx")(m, alpha)
    q = (m[..., 0] / alpha[:, 0]) ** 2 + (m[..., 1] / alpha[:, 1]) ** 2 + m[..., 2] ** 2
    assert D.shape == (5000, 2) and D.dtype == np.float64
    np.testing.assert_allclose(D, 1 / (np.pi * alpha.prod(axis=-1) * q**2), rtol=1e-13)


def test_area_ratio_of_a_stretch():
    """The stretch by (2, 2) enlarges the solid angle about n fourfold."""
    ratio = batched("slopes.stretch").area_ratio(0)(np.array([0.0, 0.0, 1.0]), np.array([2.0, 2.0]))
    assert ratio == pytest.approx(4, rel=1e-14)
