"""Properties of the shape matrix: its forms are inverse to each other; curvature and areas by independent routes."""

from fractions import Fraction

import pytest
from flint import arb

from ggxref.oracle import ellipsoid
from ggxref.oracle.linalg import (
    N,
    apply,
    cross,
    determinant,
    dot,
    inverse_transpose,
    negative,
    norm,
    normalise,
    product,
    scale,
    transpose,
)
from ggxref.oracle.precision import digits, exact, working

BITS = 256

SKEWED = ((0.5, 0.125, 0.0625), (0.0, 0.75, -0.125), (0.25, 0.0, 1.5))
THIRD = Fraction(1, 3)
ROTATION = ((2 * THIRD, -THIRD, 2 * THIRD), (2 * THIRD, 2 * THIRD, -THIRD), (-THIRD, 2 * THIRD, 2 * THIRD))
U, V = (0.25, -0.375, 0.5), (-0.5, 0.125, 0.75)


@pytest.fixture(autouse=True)
def precision():
    with working(BITS):
        yield


def same(a, b, digits=60):
    if isinstance(a, tuple):
        return all(same(x, y, digits) for x, y in zip(a, b, strict=True))
    return abs(a - b) < arb(10) ** -digits


A, u, v = exact(SKEWED), exact(U), exact(V)


def test_the_shape_matrix_of_no_rotation_is_diagonal():
    assert ellipsoid.shape_matrix(exact((0.5, 0.25)), exact((0, 0, 0))) == (
        (arb(0.5), 0, 0),
        (0, arb(0.25), 0),
        (0, 0, 1),
    )


def test_the_shape_matrix_turns_in_the_order_x_y_z():
    """One angle alone is that axis's rotation; z alone turns the axes of anisotropy by it: R z-column of walter2014 (3)."""
    alpha, angle = exact((0.5, 0.25)), arb(0.5)
    sin, cos = angle.sin_cos()
    about_z = ellipsoid.shape_matrix(alpha, (arb(0), arb(0), angle))
    assert same(apply(about_z, (cos, -sin, arb(0))), (arb(0.5), arb(0), arb(0)))
    all_three = ellipsoid.shape_matrix(alpha, (angle, angle, angle))
    one = [
        ellipsoid.shape_matrix(exact((1, 1)), [angle if k == axis else arb(0) for k in range(3)]) for axis in range(3)
    ]
    S = ellipsoid.shape_matrix(alpha, exact((0, 0, 0)))
    assert same(all_three, product(product(product(S, one[0]), one[1]), one[2]))
    assert not same(all_three, product(product(product(S, one[2]), one[1]), one[0]), 2)


@pytest.mark.parametrize("factor", [1, -3])
def test_the_canonical_form_is_one_for_all_equal_distributions(factor):
    form, Q = ellipsoid.canonical(A), exact(ROTATION)
    assert same(form, ellipsoid.canonical(tuple(scale(arb(factor), row) for row in product(Q, A))))
    assert form[0][2] == 0 and form[1][0] == 0 and form[1][2] == 0 and form[2][2] == 1
    assert form[0][0] > 0 and form[1][1] > 0
    S, form_S = ellipsoid.sggx(A), ellipsoid.sggx(form)
    assert same(form_S, tuple(scale(1 / S[2][2], row) for row in S))


def test_slopes_and_canonical_form_are_inverse():
    mean, scatter = ellipsoid.to_slopes(A)
    again = ellipsoid.to_slopes(ellipsoid.from_slopes(mean, scatter))
    assert same(again[0], mean) and same(again[1], scatter)


def test_impossible_scatter_and_singular_matrices_are_refused():
    for scatter in (((1, 2), (2, 1)), ((-1, 0), (0, 1)), ((1, 1), (1, 1))):
        with pytest.raises(ValueError, match="positive definite"):
            ellipsoid.from_slopes(exact((0, 0)), exact(scatter))
    with pytest.raises(ValueError, match="singular"):
        ellipsoid.gaussian_curvature(u, exact(((1, 2, 3), (2, 4, 6), (0, 0, 1))), arb(1))


def test_size_gives_unit_area_along_n():
    assert same(ellipsoid.projected_area(N, A, ellipsoid.size(A)), arb(1))


def test_gaussian_curvature_is_that_of_the_implicit_surface():
    """walter2014 (16), at the point of the surface where the normal is u."""
    m, size = normalise(u), arb(0.375)
    H = tuple(scale(arb(2), row) for row in ellipsoid.sggx(A))
    H_inverse = inverse_transpose(H)  # H is symmetric
    p = scale(
        size / norm(apply(inverse_transpose(A), m)),
        apply(transpose(inverse_transpose(A)), apply(inverse_transpose(A), m)),
    )
    assert same(dot(apply(A, p), apply(A, p)), size**2)
    plain = determinant(H) * dot(m, apply(H_inverse, m)) / dot(apply(H, p), apply(H, p))
    assert same(ellipsoid.gaussian_curvature(u, A, size), plain)


def test_areas_of_a_sphere_and_of_a_spheroid():
    sphere = exact(((1, 0, 0), (0, 1, 0), (0, 0, 1)))
    assert same(ellipsoid.projected_area(u, sphere, arb(2)), 4 * arb.pi())
    # Half axes 2, 4, 1 along x, y, z: the silhouette along x is the ellipse of 4 and 1.
    half_axes = exact(((0.5, 0, 0), (0, 0.25, 0), (0, 0, 1)))
    assert same(ellipsoid.projected_area(exact((1, 0, 0)), half_axes, arb(1)), 4 * arb.pi())


def test_lunes_fill_the_silhouette():
    """The parts of it on either side of the plane through its centre, and the lune of one direction alone."""
    size = arb(0.5)
    whole = ellipsoid.projected_area(u, A, size)
    assert same(ellipsoid.lune_area(u, v, A, size) + ellipsoid.lune_area(u, negative(v), A, size), whole)
    assert same(ellipsoid.lune_area(u, u, A, size), whole)
    assert ellipsoid.lune_area(u, scale(arb(-3), u), A, size) == 0


def test_a_quarter_sphere_shows_a_quarter_less():
    sphere, across = exact(((1, 0, 0), (0, 1, 0), (0, 0, 1))), exact((1, 0, 0))
    assert same(ellipsoid.lune_area(across, N, sphere, arb(1)), arb.pi() / 2)


def test_the_cross_product_rule_needs_the_inverse_that_the_paper_drops():
    """walter2014 (25) prints |M| M^T; the rule behind (26) is |M| M^-T."""
    left, right = cross(apply(A, u), apply(A, v)), cross(u, v)
    assert same(left, scale(determinant(A), apply(inverse_transpose(A), right)))
    assert not same(left, scale(determinant(A), apply(transpose(A), right)), 2)


def test_isotropic_matrices_have_exact_zeros_in_their_slopes():
    assert digits("ellipsoid.to_slopes", {"A": ((0, 0, 3), (0.1, 0, 0), (0, 0.1, 0))}, 3) == (
        ("0", "0"),
        (("1.11e-3", "0"), ("0", "1.11e-3")),
    )
