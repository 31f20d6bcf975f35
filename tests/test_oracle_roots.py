"""Properties: the enclosure holds the root, is as narrow as the precision, and widens to what f leaves open."""

import pytest
from flint import arb

from ggxref.oracle.precision import working
from ggxref.oracle.roots import increasing_root


def cube_root(x: arb, bits: int) -> arb:
    with working(bits):
        return increasing_root(lambda t: t * t * t - x, lambda t: 3 * t * t, arb(0), arb(2))


@pytest.mark.parametrize("bits", [64, 333])
@pytest.mark.parametrize("x", [2, 7.5, 1e-12, 1e-90], ids=str)
def test_a_cube_root_is_enclosed_to_the_precision(x, bits):
    enclosure = cube_root(arb(x), bits)
    with working(1000):
        truth = arb(x).root(3)
        assert enclosure.contains(truth)
        assert enclosure.rad() <= truth * arb(2) ** (8 - bits)


def test_an_open_right_hand_side_widens_the_enclosure():
    enclosure = cube_root(arb(2, 1e-10), 128)
    for x in (arb(2) - arb(9e-11), arb(2) + arb(9e-11)):
        assert enclosure.contains(x.root(3))
    assert enclosure.rad() < 1e-9


def test_without_any_proof_the_bracket_is_what_is_left():
    enclosure = cube_root(arb(2, 100), 64)
    assert enclosure.contains(arb(0)) and enclosure.contains(arb(2))


@pytest.mark.parametrize("x", [2, 0.5])
def test_the_enclosure_is_proven_though_the_way_to_it_failed(x):
    """With a slope that is far too steep the search stops where it starts, below or above the root."""
    with working(128):
        enclosure = increasing_root(lambda t: t * t * t - arb(x), lambda t: arb(2) ** 500, arb(0), arb(2))
        assert enclosure.contains(arb(x).root(3)) and enclosure.rad() > arb(1) / 100
