"""Properties: reciprocity, and the weights as f |cos| over the density of the sampled direction."""

from fractions import Fraction

import pytest
from flint import arb

from ggxref.oracle import bsdf, geometry, jacobian
from ggxref.oracle.linalg import cosine, negative, normalise
from ggxref.oracle.precision import exact, working

W, M = exact((0.5, -0.25, 0.75)), exact((0.125, 0.375, 1.0))
D, G2, F = arb(1.5), arb(0.625), arb(0.125)
INDICES = (1, Fraction(3, 2))


@pytest.fixture(autouse=True)
def precision():
    with working(256):
        yield


def same(a, b):
    return abs(a - b) < arb(10) ** -60


def test_reflection_is_reciprocal_and_its_weight_follows():
    o = geometry.reflect(W, M)
    f = bsdf.brdf(W, o, D, G2, F)
    assert f > 0 and same(f, bsdf.brdf(o, W, D, G2, F))
    density = D * normalise(M)[2] * jacobian.reflection(o, M)
    assert same(f * abs(o[2]) / density, F * bsdf.weight_normals(W, M, G2))


def test_refraction_is_reciprocal_up_to_the_indices_and_its_weight_follows():
    n_i, n_o = exact(INDICES)
    o = geometry.refract(W, M, n_i / n_o)
    f = bsdf.btdf(W, o, n_i, n_o, D, G2, F)
    assert f > 0 and same(f / n_o**2, bsdf.btdf(o, W, n_o, n_i, D, G2, F) / n_i**2)
    density = D * normalise(M)[2] * jacobian.refraction(W, o, M, n_i, n_o)
    assert same(f * abs(o[2]) / density, (1 - F) * bsdf.weight_normals(W, M, G2))
    # Without n_o^2, as if radiance did not change with the index, neither holds.
    assert not same(f / n_o**2 * abs(o[2]) / density, (1 - F) * bsdf.weight_normals(W, M, G2))


def test_the_weight_of_visible_normals_is_that_of_normals_over_their_share():
    """p_visible = G1 |i.m| D / |z_i| (heitz2014 (2)) for p = D z_m."""
    g1 = arb(0.75)
    ratio = g1 * abs(cosine(W, M)) / (abs(normalise(W)[2]) * normalise(M)[2])
    assert same(bsdf.weight_visible(g1, G2, F), F * bsdf.weight_normals(W, M, G2) / ratio)


def test_the_horizon_and_full_masking_give_zero():
    flat = exact((1, 0, 0))
    assert bsdf.brdf(flat, W, D, G2, F) == 0 and bsdf.brdf(W, flat, D, G2, F) == 0
    assert bsdf.btdf(W, flat, arb(1), arb(2), D, G2, F) == 0
    assert bsdf.weight_normals(flat, M, G2) == 0 and bsdf.weight_visible(arb(0), arb(0), F) == 0


def test_straight_through_equal_indices_is_infinite():
    assert bsdf.btdf(W, negative(W), arb(1), arb(1), D, G2, F) == arb.pos_inf()
