"""Properties of directions and changes of variable: the laws of reflection and refraction, and Jacobians by difference."""

from fractions import Fraction

import pytest
from flint import arb

from ggxref.oracle import geometry, jacobian, slopes
from ggxref.oracle.linalg import add, apply, cross, dot, negative, norm, normalise, scale
from ggxref.oracle.precision import evaluate, exact, working

BITS = 400
STEP = arb(2) ** -100  # central differences are off by its square, 2^-200

W = exact((0.5, -0.25, 0.75))
M = exact((0.125, 0.375, 1.0))
BELOW = exact((0.5, -0.25, -0.75))
ETAS = [Fraction(2, 3), Fraction(5, 4), 1]


@pytest.fixture(autouse=True)
def precision():
    with working(BITS):
        yield


def same(a, b, digits=100):
    return all(abs(x - y) < arb(10) ** -digits for x, y in zip(a, b, strict=True))


def density(f, w):
    """|df / dw|: the solid angle that f makes of one at the unit w."""
    t, b, w = geometry.basis(w)
    derivative = []
    for axis in (t, b):
        ahead, behind = (f(add(w, scale(sign * STEP, axis))) for sign in (1, -1))
        derivative.append(scale(1 / (2 * STEP), add(ahead, negative(behind))))
    return norm(cross(*derivative))


def test_reflection_is_its_own_inverse_and_keeps_the_angle():
    o = geometry.reflect(W, M)
    assert same(geometry.reflect(o, M), normalise(W))
    assert same([dot(o, normalise(M))], [dot(normalise(W), normalise(M))])
    assert same(geometry.half_reflection(W, o), normalise(M))


@pytest.mark.parametrize("eta", ETAS, ids=str)
@pytest.mark.parametrize("w", [W, BELOW])
def test_refraction_obeys_snell_and_stays_in_the_plane(w, eta):
    eta = exact(eta)
    i, m, o = normalise(w), normalise(M), geometry.refract(w, M, eta)
    assert same(cross(o, m), scale(-eta, cross(i, m)))
    assert same([norm(o)], [1])
    assert dot(o, m) * dot(i, m) < 0


def test_refraction_as_printed_breaks_the_unit_length():
    """heitz2014 prints n for n^2 under the root."""
    eta, i, m = exact(Fraction(2, 3)), normalise(W), normalise(M)
    c = dot(i, m)
    o = add(scale(eta * c - (1 + eta * (c * c - 1)).sqrt(), m), scale(-eta, i))
    assert abs(norm(o) - 1) > arb(1) / 100


def test_total_reflection_is_decided_at_the_critical_angle():
    inputs = {"wm": (0, 0, 1), "eta": Fraction(5, 4)}
    along = evaluate("geometry.refract", inputs | {"w": (4, 0, 3)}, BITS)
    assert same(along, (-1, 0, 0))
    assert evaluate("geometry.refract", inputs | {"w": (4, 0, 3 - Fraction(1, 2**200))}, BITS) == (0, 0, 0)


def test_half_vectors_join_the_directions_of_refraction():
    n_i, n_o = exact(1), exact(Fraction(3, 2))
    o = geometry.refract(W, M, n_i / n_o)
    assert same(geometry.half_refraction(W, o, n_i, n_o), normalise(M))
    assert same(geometry.half_refraction(o, W, n_o, n_i), normalise(M))


def test_half_vectors_of_opposite_directions_are_zero_whatever_their_lengths():
    opposite = scale(arb(-3), W)
    assert geometry.half_reflection(W, opposite) == (0, 0, 0)
    assert geometry.half_refraction(W, opposite, arb(2), arb(2)) == (0, 0, 0)
    assert geometry.half_refraction(W, opposite, arb(2), arb(1)) != (0, 0, 0)


def test_mirror_images_have_an_exactly_vertical_half_vector():
    x, y, z = W
    h = geometry.half_reflection(W, (-x, -y, z))
    assert h[:2] == (0, 0) and same(h, (0, 0, 1))


@pytest.mark.parametrize("w", [W, BELOW, exact((0, 0, 1)), exact((0, 0, -1)), exact((3, 4, 0))])
def test_the_basis_is_orthonormal_and_right_handed(w):
    t, b, last = geometry.basis(w)
    assert same(last, normalise(w)) and same(cross(t, b), last)
    assert same((dot(t, t), dot(b, b), dot(t, b)), (1, 1, 0))


def test_jacobian_of_reflection():
    o = geometry.reflect(W, M)
    assert same([jacobian.reflection(o, M)], [density(lambda o: geometry.half_reflection(W, o), o)], 50)


@pytest.mark.parametrize("n_o", [Fraction(3, 2), Fraction(4, 5)])
def test_jacobian_of_refraction(n_o):
    n_i, n_o = exact(1), exact(n_o)
    o = geometry.refract(W, M, n_i / n_o)
    measured = density(lambda o: geometry.half_refraction(W, o, n_i, n_o), o)
    assert same([jacobian.refraction(W, o, M, n_i, n_o)], [measured], 50)
    # With n_i for n_o in the numerator, a common slip, it is off.
    assert abs(jacobian.refraction(W, o, M, n_i, n_o) * (n_i / n_o) ** 2 - measured) > measured / 10


def test_jacobian_of_slopes():
    area = density(lambda w: (*slopes.from_normal(w), arb(0)), M)
    assert same([jacobian.slope(M)], [area], 50)


def test_jacobian_of_a_linear_map():
    A = exact([[0.5, 0.25, 0], [0, -2, 0.125], [0.5, 0, 1]])
    assert same([jacobian.linear(M, A)], [density(lambda w: normalise(apply(A, w)), M)], 50)


def test_jacobians_are_infinite_where_the_map_folds():
    across = exact((1, 0, 0))
    up = exact((0, 0, 1))
    assert jacobian.reflection(across, up) == arb.pos_inf()
    assert jacobian.slope(across) == arb.pos_inf()
    assert jacobian.refraction(up, negative(up), up, arb(1), arb(1)) == arb.pos_inf()
