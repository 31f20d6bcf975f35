"""Properties of the masking functions; the defining integrals of G1 are in test_oracle_integrate."""

import pytest
from flint import arb

from ggxref.oracle import ellipsoid, masking
from ggxref.oracle.linalg import N, apply, dot, negative, norm, normalise
from ggxref.oracle.precision import exact, working

BITS = 256

ALPHA = exact((0.5, 0.75))
A = exact(((0.5, 0.125, 0.0625), (0.0, 0.75, -0.125), (0.25, 0.0, 1.5)))
M, W, STEEP = exact((0.25, -0.375, 0.5)), exact((0.5, 0.25, 0.75)), exact((-4, 1, 0.125))
ACROSS = exact((1, 0, -0.5))  # perpendicular to M

G1 = {
    "ggx": lambda w, m: masking.g1_ggx(w, m, ALPHA),
    "beckmann": lambda w, m: masking.g1_beckmann(w, m, ALPHA),
    "v_cavity": masking.g1_v_cavity,
    "ellipsoid": lambda w, m: masking.g1_ellipsoid(w, m, A),
}
each = pytest.mark.parametrize("g1", G1.values(), ids=G1)


@pytest.fixture(autouse=True)
def precision():
    with working(BITS):
        yield


def same(a, b, digits=60):
    return abs(a - b) < arb(10) ** -digits


@each
def test_g1_is_a_share(g1):
    for w in (W, STEEP, exact((0, 0, 1))):
        assert g1(w, w) > 0 and (g1(w, w) - 1).lower() < arb(10) ** -60


@each
def test_back_faces_and_the_horizon_are_hidden(g1):
    assert g1(W, negative(W)) == 0
    assert g1(ACROSS, M) == 0 and g1(M, ACROSS) == 0
    assert g1(exact((1, 0, 0)), M) == 0


@each
def test_the_surface_is_the_same_from_below(g1):
    """walter2014 (7)."""
    assert g1(W, M) > 0 and same(g1(negative(W), M), g1(W, M))
    assert g1(negative(W), negative(M)) == 0


@pytest.mark.parametrize("shape", ["ggx", "beckmann"])
@pytest.mark.parametrize("w", [W, STEEP, negative(STEEP), exact((0, 0, 2))])
def test_g1_is_one_over_one_plus_lambda(shape, w):
    up = w if w[2] > 0 else negative(w)
    g1, lam = getattr(masking, f"g1_{shape}")(up, up, ALPHA), getattr(masking, f"lambda_{shape}")(w, ALPHA)
    assert same(g1, 1 / (1 + lam))


def test_lambda_is_infinite_at_the_horizon_and_zero_at_normal_incidence():
    for name in ("lambda_ggx", "lambda_beckmann"):
        function = getattr(masking, name)
        assert function(exact((1, 2, 0)), ALPHA) == arb.pos_inf() and function(exact((0, 0, 3)), ALPHA) == 0


def test_sigma_splits_into_above_and_below():
    """sigma(w) - sigma(-w) = z, as int (w.m) D dm = z_w for distributions that are even in x and y."""
    for sigma in (masking.sigma_ggx, masking.sigma_beckmann):
        w = normalise(STEEP)
        assert same(sigma(w, ALPHA) - sigma(negative(w), ALPHA), w[2])


def test_the_ellipsoid_holds_ggx():
    diagonal = ((ALPHA[0], arb(0), arb(0)), (arb(0), ALPHA[1], arb(0)), exact((0, 0, 1)))
    assert same(masking.g1_ellipsoid(STEEP, STEEP, diagonal), masking.g1_ggx(STEEP, STEEP, ALPHA))


def test_the_skewed_surface_shows_the_flat_area():
    """walter2014 (32): the lune's projected area, whose density test_oracle_sampling proves, is shared out by G1."""
    for w in (W, STEEP):
        flat = ellipsoid.projected_area(N, A, arb(1)) * normalise(w)[2]
        g1 = masking.g1_ellipsoid(w, w, A)
        assert g1 < 1 and same(g1 * ellipsoid.lune_area(w, N, A, arb(1)), flat)


def test_skew_needs_the_minimum():
    """walter2014 (6) without it would exceed 1 where the skewed surface shows less than the flat one."""
    skewed = exact(((0.5, 0, 0), (0, 0.5, 0), (0.75, 0, 1)))
    w = exact((-1, 0, 1))
    i, An = normalise(w), apply(skewed, N)
    Ai = apply(skewed, i)
    assert 2 * dot(An, An) * i[2] / (norm(Ai) * norm(An) + dot(Ai, An)) > 1
    assert masking.g1_ellipsoid(w, w, skewed) == 1


def test_a_v_cavity_shows_the_flat_area():
    """Both walls: <w,m> G1 + <w,m'> G1 = 2 (w.n)(m.n), heitz2014 appendix B."""
    for w in (W, STEEP):
        i, m = normalise(w), normalise(M)
        walls = (m, (-m[0], -m[1], m[2]))
        shown = sum((dot(i, wall) * masking.g1_v_cavity(i, wall) for wall in walls if dot(i, wall) > 0), arb(0))
        assert same(shown, 2 * i[2] * m[2])


def test_height_correlation_reproduces_the_published_table():
    """alpha = (0.1, 0.8), theta = 60 deg: .985329 along x, .734298 across, .585206 along y (peers.md)."""
    alpha = exact((0.1, 0.8))
    half, root3 = arb(1) / 2, arb(3).sqrt() / 2
    x, y, n = (root3, arb(0), half), (arb(0), root3, half), exact((0, 0, 1))
    for a, b, expected in ((x, x, "0.985329"), (x, y, "0.734298"), (y, y, "0.585206")):
        g2 = masking.g2_height_correlated(masking.g1_ggx(a, n, alpha), masking.g1_ggx(b, n, alpha))
        assert abs(g2 - arb(expected)) < arb("5.1e-7")
        assert not abs(masking.g2_separable(masking.g1_ggx(a, n, alpha), masking.g1_ggx(b, n, alpha)) - g2) < arb(
            "1e-6"
        )


def test_height_correlation_of_nothing_is_nothing():
    assert masking.g2_height_correlated(arb(0), arb(0)) == 0 and masking.g2_height_correlated(arb(0), arb(1)) == 0


def test_v_cavities_correlate_on_one_side_and_anticorrelate_across():
    g1_i, g1_o = masking.g1_v_cavity(W, M), masking.g1_v_cavity(STEEP, exact((-1, 0, 1)))
    assert g1_i > 0 and g1_o > 0
    up, wm = exact((-0.5, -1, 2)), exact((-0.25, -0.25, 1))
    a, b = masking.g1_v_cavity(W, wm), masking.g1_v_cavity(up, wm)
    assert masking.g2_v_cavity(W, up, wm) == a.min(b)
    down = negative(STEEP)
    wall = exact((-1, 0, 1))
    i = exact((-1, 0, 1))
    assert same(
        masking.g2_v_cavity(i, down, wall),
        (masking.g1_v_cavity(i, wall) + masking.g1_v_cavity(down, wall) - 1).max(arb(0)),
    )
