"""Properties of the Fresnel terms: known angles, reversibility, and the dielectric as a metal that absorbs nothing."""

from fractions import Fraction

import pytest
from flint import arb

from ggxref.oracle import fresnel
from ggxref.oracle.precision import exact, working


@pytest.fixture(autouse=True)
def precision():
    with working(256):
        yield


def same(a, b):
    return abs(a - b) < arb(10) ** -60


COSINES = [Fraction(1, 8), Fraction(3, 4), Fraction(-1, 2)]
cosines = pytest.mark.parametrize("c", COSINES, ids=str)


@pytest.mark.parametrize("n", [Fraction(3, 2), 2], ids=str)
def test_normal_incidence(n):
    n = exact(n)
    expected = ((n - 1) / (n + 1)) ** 2
    assert same(fresnel.dielectric(arb(1), 1 / n), expected)
    assert same(fresnel.conductor(arb(-1), n, arb(2)), ((n - 1) ** 2 + 4) / ((n + 1) ** 2 + 4))


def test_brewsters_angle_reflects_half_of_rs():
    """At tan = n_o/n_i = 2 the parallel part vanishes and rs = (1 - 4)/(1 + 4)."""
    assert same(fresnel.dielectric(1 / arb(5).sqrt(), arb(1) / 2), exact(Fraction(9, 50)))


@cosines
def test_both_ways_through_an_interface_lose_the_same(c):
    c, eta = abs(exact(c)), exact(Fraction(2, 3))
    transmitted = (1 - eta * eta * (1 - c * c)).sqrt()
    assert same(fresnel.dielectric(c, eta), fresnel.dielectric(transmitted, 1 / eta))


@cosines
@pytest.mark.parametrize("n", [Fraction(3, 2), Fraction(2, 3)], ids=str)
def test_a_metal_that_absorbs_nothing_is_a_dielectric(c, n):
    """Also in total reflection, which (1/8, 2/3) and (1/2, 2/3) meet."""
    c, n = exact(c), exact(n)
    assert same(fresnel.conductor(c, n, arb(0)), fresnel.dielectric(c, 1 / n))
    assert not same(fresnel.conductor(c, n, arb(1) / 8), fresnel.dielectric(c, 1 / n))


def test_total_reflection_starts_at_the_critical_angle():
    eta, critical = exact(Fraction(5, 4)), exact(Fraction(3, 5))
    with working(4000):
        critical = exact(Fraction(3, 5)) - arb(2) ** -200
        assert fresnel.dielectric(critical, eta) == 1
        assert fresnel.dielectric(critical + arb(2) ** -199, eta) < 1
    assert same(fresnel.conductor(arb(0), exact(Fraction(4, 5)), arb(0)), arb(1))


def test_no_interface_reflects_nothing():
    for c in (arb(0), arb(1), arb(-1) / 2):
        assert fresnel.dielectric(c, arb(1)) == 0 and fresnel.conductor(c, arb(1), arb(0)) == 0


def test_grazing_light_is_reflected():
    assert same(fresnel.dielectric(arb(0), arb(1) / 2), arb(1))
    assert same(fresnel.conductor(arb(0), arb(2), arb(3)), arb(1))
    assert same(fresnel.schlick(arb(0), arb(1) / 8), arb(1))


def test_schlick_starts_at_f0_with_the_fifth_power():
    f0 = arb(1) / 8
    assert fresnel.schlick(arb(1), f0) == f0
    assert same(fresnel.schlick(arb(-1) / 2, f0), f0 + (1 - f0) / 32)
