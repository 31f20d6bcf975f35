"""Properties: derivatives of the oracle's functions agree with difference quotients of the same; what has no rule, or no
derivative, is refused and never silently dropped."""

import pytest
from flint import arb, ctx, fmpq

from ggxref.golden.dual import Dual, gradient
from ggxref.golden.exact import evaluate
from ggxref.golden.rounding import Undecided, ends
from ggxref.golden.samplers import FUNCTIONS
from ggxref.oracle.precision import working

STEP = fmpq(1, 2**80)
POINT = {
    "wm": (fmpq(1, 10), fmpq(-1, 5), fmpq(19, 20)),
    "wi": (fmpq(2, 5), fmpq(1, 2), fmpq(3, 4)),
    "w": (fmpq(2, 5), fmpq(1, 2), fmpq(3, 4)),
    "alpha": (fmpq(1, 3), fmpq(2, 3)),
    "A": (
        (fmpq(1, 3), fmpq(1, 9), fmpq(0)),
        (fmpq(0), fmpq(1, 2), fmpq(0)),
        (fmpq(1, 5),) * 3,
    ),
    "gamma": fmpq(7, 2),
}
GRADIENTS = [f for f in FUNCTIONS.values() if f.derivative]


def moved(x, i):
    """The nested input with its number i larger by STEP."""
    flat = [e for part in x for e in (part if isinstance(part, tuple) else (part,))]
    flat[i] += STEP
    it = iter(flat)
    return tuple(tuple(next(it) for _ in part) if isinstance(part, tuple) else next(it) for part in x), len(flat)


@pytest.mark.parametrize("function", GRADIENTS, ids=lambda f: f.id)
def test_gradients_are_limits_of_difference_quotients(function):
    values = {a: POINT[a] for a in function.arguments}
    x = values[function.derivative]
    with working(512):
        value, *slopes = evaluate(function, values, 512)
        for i, slope in enumerate(slopes):
            beside = evaluate(function, values | {function.derivative: moved(x, i)[0]}, 512)[0]
            (low, high), error = ends((beside - value) * 2**80 - slope), fmpq(1, 2**60)
            assert abs(low) < error * (1 + abs(ends(slope)[0])) > abs(high)
    assert len(slopes) == moved(x, 0)[1]
    assert any(abs(ends(slope)[0]) > fmpq(1, 10**9) for slope in slopes) or function.name == "masking.g1_v_cavity"


def test_a_gradient_below_the_horizon_is_zero():
    values = {"wm": (fmpq(1, 2), fmpq(0), fmpq(-1, 2)), "alpha": POINT["alpha"]}
    assert [*map(float, evaluate(FUNCTIONS["ndf.ggx.d_wm"], values, 64))] == [0, 0, 0, 0]


def test_the_gradient_of_a_normalised_direction_is_tangential():
    value = evaluate(FUNCTIONS["ndf.beckmann.d_wm"], {a: POINT[a] for a in ("wm", "alpha")}, 200)
    with working(200):
        inner = sum((s * x.numerator / x.denominator for s, x in zip(value[1:], POINT["wm"], strict=True)), arb(0))
        assert abs(inner) < arb(2) ** -150
        assert abs(value[1]) > 1


@pytest.fixture(autouse=True)
def precision():
    ctx.prec = 128
    yield
    ctx.prec = 53


@pytest.mark.parametrize(
    ("f", "slope"),
    [
        (lambda x: x + 2, 1),
        (lambda x: arb(2) - x, -1),
        (lambda x: 3 * x * x, 12),
        (lambda x: 8 / x, -2),
        (lambda x: x / (1 + x), arb(1) / 9),
        (lambda x: x**3, 12),
        (lambda x: x ** arb(2), 4),
        (lambda x: abs(-x), 1),
        (lambda x: x.sqrt(), 1 / (2 * arb(2).sqrt())),
        (lambda x: x.log(), arb(1) / 2),
        (lambda x: x.erf() + x.erfc(), 0),
        (lambda x: (x * x).min(arb(9)), 4),
        (lambda x: (x * x).max(arb(9)), 0),
    ],
)
def test_rules(f, slope):
    assert gradient(lambda x: f(x[0]), (arb(2),))[1].overlaps(arb(slope))


def test_what_has_no_rule_or_no_derivative_is_refused():
    x = Dual.of(arb(0), [arb(1)])
    for refused in (lambda: x.sin(), lambda: x.union(arb(1)), lambda: arb(2) ** x, lambda: x**x):
        with pytest.raises(TypeError, match="derivative"):
            refused()
    for kink in (lambda: abs(x), lambda: x.min(arb(0)), lambda: x.max(arb(0))):
        with pytest.raises(Undecided):
            kink()
    assert not x.sqrt().slopes[0].is_finite()
