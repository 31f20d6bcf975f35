"""Properties: the distributions agree with each other, with their slope densities, and with their defining integrals."""

from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from flint import arb
from scipy import stats

from ggxref.oracle import ellipsoid, ndf, slopes
from ggxref.oracle.linalg import N, add, apply, negative, norm, normalise, product, scale
from ggxref.oracle.precision import evaluate, exact, working

BITS = 256
TURNS = 40  # equal steps gain 0.7 digits a pair at this anisotropy
SUM_DIGITS = 11  # of the sums over `rule`: 3e-14 to 6e-13 was measured

ALPHA = (0.5, 0.75)
SKEWED = ((0.5, 0.125, 0.0625), (0.0, 0.75, -0.125), (0.25, 0.0, 1.5))
DIAGONAL = ((0.5, 0, 0), (0, 0.75, 0), (0, 0, 1))
NDFS = {
    "ggx": {"alpha": ALPHA},
    "beckmann": {"alpha": ALPHA},
    "student_t": {"alpha": ALPHA, "gamma": 3},
    "ellipsoid": {"A": SKEWED},
}
M = exact((0.25, -0.375, 0.5))

names = pytest.mark.parametrize("name", NDFS)


@pytest.fixture(autouse=True)
def precision():
    with working(BITS):
        yield


def same(a, b, digits=60):
    return abs(a - b) < arb(10) ** -digits


def rule():
    """Nodes (m, weight) of integrals over the hemisphere: Gauss in z, equal steps in phi."""
    nodes, weights = np.polynomial.legendre.leggauss(32)
    for z, weight in zip((nodes + 1) / 2, weights / 2, strict=True):
        height = arb(float(z))
        radius = (1 - height * height).sqrt()
        for k in range(TURNS):
            sin, cos = (arb(2 * k) / TURNS).sin_cos_pi()
            yield (radius * cos, radius * sin, height), 2 * arb.pi() * float(weight) / TURNS


@names
def test_nothing_points_below_the_horizon(name):
    for wm in ((0.25, -0.375, -0.5), (1, 0, 0), (0, 0, -1)):
        assert evaluate(f"ndf.{name}", {"wm": wm, **NDFS[name]}, BITS) == 0
    assert ndf.hemisphere(negative(M)) == 0


@names
def test_the_slope_density_is_z4_d(name):
    parameters = exact(list(NDFS[name].values()))
    m = normalise(M)
    P22 = getattr(slopes, name)(slopes.from_normal(m), *parameters)
    assert same(P22, m[2] ** 4 * getattr(ndf, name)(m, *parameters))


def test_the_ellipsoid_and_student_t_hold_ggx():
    D = ndf.ggx(M, exact(ALPHA))
    assert same(D, ndf.ellipsoid(M, exact(DIAGONAL))) and same(D, ndf.student_t(M, exact(ALPHA), arb(2)))
    assert same(ndf.hemisphere(M), ndf.ggx(M, exact((1, 1))))


def test_beckmann_is_the_limit_of_student_t():
    m = exact((0.25, -0.375, 1))
    D = ndf.beckmann(m, exact(ALPHA))
    errors = [abs(ndf.student_t(m, exact(ALPHA), arb(2) ** k) / D - 1) for k in (20, 21)]
    assert errors[0] < arb(2) ** -18 and abs(errors[0] / errors[1] - 2) < arb(1) / 100


def test_the_ellipsoid_keeps_its_density_under_rotation_scale_and_mirror():
    third = exact(Fraction(1, 3))
    Q = ((2 * third, -third, 2 * third), (2 * third, 2 * third, -third), (-third, 2 * third, 2 * third))
    A = exact(SKEWED)
    for other in (product(Q, A), tuple(negative(row) for row in A), ellipsoid.canonical(A)):
        assert same(ndf.ellipsoid(M, other), ndf.ellipsoid(M, A))


@cache
def moments(name):
    """The integrals of D cos and of D m."""
    parameters = exact(list(NDFS[name].values()))
    area, mean = arb(0), (arb(0), arb(0), arb(0))
    for m, weight in rule():
        share = weight * getattr(ndf, name)(m, *parameters)
        area, mean = area + share * m[2], add(mean, scale(share, m))
    return area, mean


@names
def test_the_projected_area_is_one(name):
    assert same(moments(name)[0], 1, SUM_DIGITS)


def test_the_projected_area_check_fails_without_the_norm_of_a_n():
    assert not same(moments("ellipsoid")[0] * norm(apply(exact(SKEWED), N)), 1, 1)


def test_the_mean_normal_is_the_mean_of_the_normals():
    mean = normalise(moments("ellipsoid")[1])
    expected = ellipsoid.mean_normal(exact(SKEWED))
    assert all(same(a, b, SUM_DIGITS) for a, b in zip(mean, expected, strict=True))
    assert not same(mean[0], 0, 2)  # skewed: the normals do not balance about n, walter2014 section 5.1


def test_slopes_are_a_shifted_student_t():
    """design.md: two degrees of freedom, location -e, shape Sigma / 2; scipy computes in doubles."""
    A = exact(SKEWED)
    (mean, scatter), slope = ellipsoid.to_slopes(A), (0.375, -0.25)
    shape = [[float(part) / 2 for part in row] for row in scatter]
    frozen = stats.multivariate_t([float(part) for part in mean], shape, df=2)  # pyright: ignore[reportArgumentType]
    density = frozen.pdf(slope)
    assert abs(float(slopes.ellipsoid(exact(slope), A)) / float(density) - 1) < 1e-13


def test_normals_and_slopes_are_inverse():
    m = normalise(M)
    assert all(same(a, b) for a, b in zip(slopes.to_normal(slopes.from_normal(M)), m, strict=True))
    with pytest.raises(ValueError, match="horizon"):
        slopes.from_normal(exact((1, 0, 0)))


@pytest.mark.parametrize("shape", ["ggx", "beckmann"])
def test_visible_slopes_are_invariant_under_stretching(shape):
    """heitz2014 (9)."""
    slope, wi, (ax, ay) = exact((0.25, -0.5)), exact((0.5, 0.25, 0.5)), exact(ALPHA)
    visible = getattr(slopes, f"visible_{shape}")
    stretched = visible((slope[0] / ax, slope[1] / ay), slopes.stretch(wi, (ax, ay)), exact((1, 1)))
    assert same(visible(slope, wi, (ax, ay)), stretched / (ax * ay))


@pytest.mark.parametrize("shape", ["ggx", "beckmann"])
def test_visible_slopes_face_the_viewer(shape):
    """heitz2014 (7) prints the projection factor with the other sign: those slopes face away."""
    visible, wi, alpha = getattr(slopes, f"visible_{shape}"), exact((1, 0, 0.5)), exact(ALPHA)
    assert visible(exact((-2, 0)), wi, alpha) > 0
    assert visible(exact((2, 0)), wi, alpha) == 0
    assert visible(exact((0.5, 0)), wi, alpha) == 0  # exactly edge on
