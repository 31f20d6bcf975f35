"""Properties: every NDF projects to an area of 1, and G1 is the share that its definition says, to 30 proven digits."""

from fractions import Fraction

import pytest
from flint import arb

from ggxref.oracle import integrate
from ggxref.oracle.precision import evaluate, exact, working

BITS = 128
NARROW = arb(2) ** -100  # 30 digits

ALPHAS = [(1, 1), (Fraction(1, 10), Fraction(2, 5)), (Fraction(1, 1000), 2)]
DIRECTIONS = [(0, 0, 1), (Fraction(1, 2), Fraction(-1, 10), Fraction(3, 10)), (1, 3, Fraction(1, 1000))]
SKEWED = [[Fraction(3, 10), Fraction(1, 10), Fraction(1, 20)], [0, Fraction(1, 5), Fraction(1, 50)], [0, -1, 2]]

alphas = pytest.mark.parametrize("alpha", ALPHAS, ids=str)


def assert_one(ball):
    assert ball.contains(1) and ball.rad() < NARROW


@alphas
@pytest.mark.parametrize("area", [integrate.projected_area_ggx, integrate.projected_area_beckmann])
def test_the_projected_area_is_one(area, alpha):
    assert_one(area(alpha, BITS))


@alphas
@pytest.mark.parametrize("gamma", [Fraction(5, 4), 2, 7])
def test_the_projected_area_of_student_t_is_one(alpha, gamma):
    assert_one(integrate.projected_area_student_t(alpha, gamma, BITS))


@pytest.mark.parametrize("A", [SKEWED, [[-2, 0, 0], [0, 1, 0], [0, 0, 1]]], ids=["skewed", "mirrored"])
def test_the_projected_area_of_the_ellipsoid_is_one(A):
    assert_one(integrate.projected_area_ellipsoid(A, BITS))


@alphas
@pytest.mark.parametrize("w", DIRECTIONS, ids=str)
@pytest.mark.parametrize("name", ["g1_ggx", "g1_beckmann"])
def test_g1_is_its_defining_integral(name, w, alpha):
    with working(BITS):
        difference = getattr(integrate, name)(w, alpha, BITS) - evaluate(
            f"masking.{name}", {"w": w, "wm": w, "alpha": alpha}, BITS
        )
        assert difference.contains(0) and difference.rad() < NARROW


def test_g1_of_another_roughness_is_not():
    """The check above can fail: an alpha that is 1e-20 off, which no float would show."""
    alpha, off = (Fraction(1, 2), Fraction(1, 2)), Fraction(1, 2) + Fraction(1, 10**20)
    inputs = {"w": (1, 0, 1), "wm": (0, 0, 1), "alpha": (off, off)}
    for name in ("g1_ggx", "g1_beckmann"):
        assert not getattr(integrate, name)((1, 0, 1), alpha, BITS).overlaps(evaluate(f"masking.{name}", inputs, BITS))


def test_g1_is_refused_below_the_horizon():
    with pytest.raises(ValueError, match="above the horizon"):
        integrate.g1_ggx((1, 0, -1), (1, 1), BITS)


def test_roots_have_to_hand_the_flag_on():
    """Without it the integral is wrong and claims to be proven (numerics.md)."""
    with working(BITS):
        truth = exact(Fraction(14, 3))
        assert integrate.integral(lambda x, flag: x.sqrt(analytic=flag), arb(1), arb(4)).overlaps(truth)
        assert not integrate.integral(lambda x, _: x.sqrt(), arb(1), arb(4)).overlaps(truth)
        cubes = integrate.integral(integrate.power_three_halves, arb(1), arb(4))
        assert cubes.overlaps(exact(Fraction(62, 5)))
