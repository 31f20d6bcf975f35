"""Properties: inputs are converted exactly; signs are proven or refused; precision rises until a branch is decided;
digits are proven; the oracle stands alone."""

import ast
from fractions import Fraction
from pathlib import Path

import ml_dtypes
import numpy as np
import pytest
from flint import arb, ctx

import ggxref.oracle
from ggxref.oracle.precision import MAX_BITS, Undecided, decimal, digits, evaluate, exact, lookup, root, sign, working

SOURCES = sorted(Path(ggxref.oracle.__file__).parent.rglob("*.py"))


def fraction(x: arb) -> Fraction:
    assert x.is_exact()
    return Fraction(int(x.fmpq().p), int(x.fmpq().q))


@pytest.mark.parametrize(
    "x",
    [
        *(0, -3, 10**40, Fraction(-5, 8), 0.1, 5e-324, 1.7976931348623157e308),
        *(np.float64(0.1), np.float32(0.1), np.float32(1e-45), np.float16(0.1), np.int64(7), ml_dtypes.bfloat16(0.1)),
    ],
    ids=repr,
)
def test_a_binary_number_is_converted_exactly_whatever_the_precision(x):
    with working(24):
        assert fraction(exact(x)) == (x if isinstance(x, int | Fraction) else Fraction(float(x)))


def test_a_third_becomes_an_enclosure():
    with working(64):
        third = exact(Fraction(1, 3))
        assert not third.is_exact() and third.contains(arb(1) / 3) and third.rad() < arb(2) ** -60


def test_nested_sequences_become_nested_tuples():
    assert exact([[1, 0.5], [2, -0.25]]) == ((1, arb(0.5)), (2, arb(-0.25)))
    assert exact(np.array([0.5, 0.25], dtype=ml_dtypes.bfloat16)) == (arb(0.5), arb(0.25))
    assert exact(np.array([[0.1], [0.2]], np.float32)) == (
        (arb(float(np.float32(0.1))),),
        (arb(float(np.float32(0.2))),),
    )


def test_what_is_no_finite_number_is_refused():
    for x in (float("nan"), float("inf"), np.float32("nan")):
        with pytest.raises(ValueError, match="finite"):
            exact(x)
    with pytest.raises(TypeError, match="no exact conversion from complex"):
        exact(1j)


def test_a_sign_is_proven_or_refused():
    assert [sign(arb(x)) for x in (-2, 0, 5e-324)] == [-1, 0, 1]
    for x in (arb(0, 1e-300), arb(1, 2), arb.nan()):
        with pytest.raises(Undecided):
            sign(x)


def test_a_root_next_to_zero_is_enclosed_and_one_below_refused():
    for x in (arb(0, 1e-20), arb(1e-20, 2e-20)):
        assert root(x).contains(x.upper().sqrt()) and root(x).contains(0)
    with pytest.raises(Undecided):
        root(arb(-1, 0.5))


def test_the_precision_is_restored():
    before = ctx.prec
    with pytest.raises(ZeroDivisionError), working(777):
        assert ctx.prec == 777
        raise ZeroDivisionError
    assert ctx.prec == before


# w . m = 2^-300 with a third that has no exact ball: below some 300 bits its sign is open.
NEARLY = {"w": (Fraction(1, 3), 0, 1), "wm": (-3, 0, 1 + Fraction(1, 2**300))}


def test_precision_rises_until_the_branch_is_decided():
    with pytest.raises(Undecided), working(128):
        lookup("masking.g1_v_cavity")(**{key: exact(x) for key, x in NEARLY.items()})
    assert evaluate("masking.g1_v_cavity", NEARLY, 128) == 1


def test_an_undecidable_branch_ends_in_a_clear_error():
    inputs = {"w": (Fraction(1, 3), 0, 1), "wm": (-3, 0, 1)}
    for attempt in (lambda: evaluate("masking.g1_v_cavity", inputs, 64), lambda: digits("ndf.ggx", SINGULAR, 10)):
        with pytest.raises(ArithmeticError, match=rf"undecided at {MAX_BITS} bits"):
            attempt()


SINGULAR = {"wm": (0, 0, 1), "alpha": (0, 1)}  # D is infinite


def test_unknown_names_and_too_many_bits_are_refused():
    for name in ("ndf.nothing", "nothing.ggx", "ggx"):
        with pytest.raises(ValueError, match="no function"):
            evaluate(name, {}, 64)
    with pytest.raises(ValueError, match="at most"):
        evaluate("ndf.hemisphere", {"wm": (0, 0, 1)}, 2 * MAX_BITS)


def test_digits_are_those_of_the_exact_result():
    inverse_pi = "3.1830988618379067153776752674502872406891929148091e-1"
    assert digits("ndf.hemisphere", {"wm": (0, 0, 1)}, 50) == inverse_pi
    assert digits("ndf.hemisphere", {"wm": (0, 0, -1)}, 50) == "0"
    assert digits("masking.lambda_ggx", {"w": (1, 0, 0), "alpha": (1, 1)}, 5) == "inf"
    assert digits("slopes.from_normal", {"wm": (1, 0, -3)}, 3) == ("3.33e-1", "0")


@pytest.mark.parametrize(
    ("x", "n", "text"),
    [
        *((2.5, 1, "2e+0"), (3.5, 1, "4e+0"), (-9.996, 3, "-1.00e+1"), (0.125, 2, "1.2e-1")),
        *((1, 4, "1.000e+0"), (123456, 3, "1.23e+5"), (5e-324, 3, "4.94e-324")),
    ],
)
def test_decimals_are_rounded_to_nearest_even(x, n, text):
    assert decimal(arb(x), n) == text


def test_a_digit_that_the_ball_leaves_open_is_refused():
    assert decimal(arb(1.5, 1e-6), 3) == "1.50e+0"
    for x, n in ((arb(1.5, 1e-6), 7), (arb(0.25, 1e-30), 1), (arb(0, 1e-30), 3)):
        with pytest.raises(Undecided):
            decimal(x, n)


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_the_oracle_imports_nothing_of_the_library_and_holds_no_float(path):
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        assert not (isinstance(node, ast.Constant) and isinstance(node.value, float)), f"float at line {node.lineno}"
        names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        for name in names:
            standard = name in {"importlib", "math", "fractions", "collections.abc", "typing"}
            assert standard or name == "flint" or name.startswith("ggxref.oracle"), name


def test_the_source_check_sees_the_whole_oracle():
    assert len(SOURCES) >= 20
