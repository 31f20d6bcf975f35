"""Properties of the lune samplers: the map of the disk, and what rejection wastes."""

import pytest
from flint import arb
from oracle_points import BITS, DIRECTIONS, MIRRORED, SKEWED, alike, same, solid_angle

from ggxref.oracle import ellipsoid
from ggxref.oracle.linalg import N, apply, cross, dot, inverse_transpose, norm, normalise, transpose
from ggxref.oracle.precision import exact, working
from ggxref.oracle.sampling import lune


@pytest.fixture(autouse=True)
def precision():
    with working(BITS):
        yield


@pytest.mark.parametrize(
    ("u", "point"),
    [((0.5, 0.5), (0, 0)), ((1, 0.5), (1, 0)), ((0.5, 1), (0, 1)), ((0, 0.5), (-1, 0)), ((0.75, 0.5), (0.5, 0))],
)
def test_the_concentric_map_through_its_axes(u, point):
    """At wi = n the lune is the whole disk, and m = A^T (x e1 + y e2 + sqrt(1 - r^2) e3): with A = 1, (x, y)."""
    m = lune.sample(exact(u), N, exact(((1, 0, 0), (0, 1, 0), (0, 0, 1))))
    assert alike(m[:2], exact(point))


@pytest.mark.parametrize("A", [SKEWED, MIRRORED])
@pytest.mark.parametrize("wi", [DIRECTIONS[key] for key in ("plain", "grazing", "below")])
def test_the_disks_rim_is_the_lunes_rim(wi, A):
    edge, silhouette = lune.sample(exact((0, 0.25)), wi, A), lune.sample(exact((0.75, 0)), wi, A)
    assert edge[2] == 0 and dot(edge, wi) > 0
    assert same(dot(silhouette, wi), 0) and silhouette[2] > 0


@pytest.mark.parametrize("A", [SKEWED, MIRRORED])
@pytest.mark.parametrize("wi", [DIRECTIONS[key] for key in ("plain", "normal", "below")])
def test_rejection_from_the_ellipsoid_wastes_what_lies_off_the_lune(wi, A):
    """|dm/du| pdf is the share of the silhouette that is accepted, inverted."""
    for u in (exact((0.1, 0.3)), exact((0.3, 0.2)), exact((0.6, 0.5)), exact((0.9, 0.1))):
        m, tries = lune.sample_rejection_ellipsoid((u,), wi, A)
        if tries == 0:
            assert m == (0, 0, 0)
            continue
        jacobian = solid_angle(lambda u: lune.sample_rejection_ellipsoid((u,), wi, A)[0], u)
        share = ellipsoid.lune_area(wi, N, A, arb(1)) / ellipsoid.projected_area(wi, A, arb(1))
        assert same(jacobian * lune.pdf(m, wi, A) * share, 1)


@pytest.mark.parametrize("A", [SKEWED, MIRRORED])
def test_rejection_from_the_bounding_sphere_wastes_more(A):
    """The same with the sphere's silhouette; its radius is the longest half axis: no point of the ellipsoid is farther."""
    wi = DIRECTIONS["plain"]
    rows = [exact((k / 16, j / 64)) for k in range(16) for j in range(1, 16)]
    m, tries = lune.sample_rejection_sphere(rows, wi, A)
    assert tries > 0
    u = rows[int(float(tries)) - 1]
    jacobian = solid_angle(lambda u: lune.sample_rejection_sphere((u,), wi, A)[0], u)
    disk = arb.pi() * lune._longest_half_axis(A) ** 2
    assert same(jacobian * lune.pdf(m, wi, A) * ellipsoid.lune_area(wi, N, A, arb(1)) / disk, 1)


def test_the_longest_half_axis():
    assert same(lune._longest_half_axis(exact(((4, 0, 0), (0, 0.25, 0), (0, 0, 1)))), 4)
    for factor in (1, 3):  # a sphere: three equal eigenvalues
        assert same(lune._longest_half_axis(exact(((0, factor, 0), (factor, 0, 0), (0, 0, factor)))), arb(1) / factor)
    A = SKEWED
    longest, steps = lune._longest_half_axis(A), 64
    p = normalise(exact((1, 1, 1)))
    for _ in range(steps):  # power iteration on (A^T A)^-1, by Cramer's rule in A^-1
        S = ellipsoid.sggx(A)
        p = normalise(tuple(dot(p, cross(S[k - 2], S[k - 1])) for k in range(3)))
    assert same(1 / norm(apply(A, p)), longest, 15)


def test_rejection_gives_up_with_nothing():
    wi, A = DIRECTIONS["below"], SKEWED
    never = [exact((0.5 + k / 64, 0.999)) for k in range(8)]
    rejected = [row for row in never if lune.sample_rejection_ellipsoid((row,), wi, A)[1] == 0]
    assert rejected and lune.sample_rejection_ellipsoid(rejected, wi, A) == ((0, 0, 0), 0)


def test_mapping_with_the_papers_matrix_leaves_the_ellipsoid():
    """walter2014 section 4.1 (d) calls A p_c the point on the ellipsoid; that is A^-1 p_c, and its normal A^T p_c."""
    p = normalise(exact((0.5, 0.25, 1)))
    inverse = transpose(inverse_transpose(SKEWED))
    assert same(norm(apply(SKEWED, apply(inverse, p))), 1)
    assert not same(norm(apply(SKEWED, apply(SKEWED, p))), 1, 1)
