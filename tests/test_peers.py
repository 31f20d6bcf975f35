"""Other people's code for the same quantities, as one more opinion: Mitsuba 3 (in float32) where it is installed, and SciPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import stats

from ggxref import ellipsoid, masking, ndf, slopes
from ggxref.sampling import cross_section, normals, slope_beckmann

# Mitsuba computes in float32 and by tan²: 1e-4 is what the steepest of these cases leaves of its seven digits.
MITSUBA = 1e-4
ALPHAS = [(0.1, 0.1), (0.05, 0.4), (0.8, 0.3)]


@pytest.fixture(scope="module")
def mi():
    mitsuba = pytest.importorskip("mitsuba", reason="needs the peers extra: pip install '.[peers]'")
    mitsuba.set_variant("scalar_rgb")
    return mitsuba


def directions(count, seed=0, steepest=0.1):
    """Unit vectors with z from `steepest` up, in float32 as Mitsuba takes them."""
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(steepest, 1, count), rng.uniform(0, 2 * np.pi, count)
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1).astype(np.float32)


def evaluate(f, *args):
    """`f` at each row of the arguments that have rows, in float64."""
    with jax.enable_x64(True):
        arrays = [jnp.asarray(a, jnp.float64) for a in args]
        batched = arrays[0].ndim
        axes = [0 if a.ndim == batched and len(a) == len(arrays[0]) else None for a in arrays]
        return np.asarray(jax.jit(jax.vmap(f, axes))(*arrays))


def distribution(mi, name, alpha, visible=True):
    kind = {"ggx": mi.MicrofacetType.GGX, "beckmann": mi.MicrofacetType.Beckmann}[name]
    return mi.MicrofacetDistribution(kind, *alpha, visible)


@pytest.mark.parametrize("alpha", ALPHAS, ids=str)
@pytest.mark.parametrize("name", ["ggx", "beckmann"])
def test_mitsuba_has_the_same_d_and_g1(mi, name, alpha):
    m, w = directions(60), directions(60, seed=1)
    peer = distribution(mi, name, alpha)
    D = evaluate({"ggx": ndf.ggx, "beckmann": ndf.beckmann}[name], m, alpha)
    # Mitsuba sets a D·cos below 1e-20 to 0.
    seen = D * m[:, 2] > 1e-18
    assert seen.sum() > 10
    assert_allclose([peer.eval(row.tolist()) for row in m[seen]], D[seen], rtol=MITSUBA)
    if name == "beckmann":
        return  # Mitsuba's G1 for Beckmann is a rational approximation of another function's fit
    g1 = evaluate(masking.g1_ggx, w, m, alpha)
    assert_allclose([peer.smith_g1(a.tolist(), b.tolist()) for a, b in zip(w, m, strict=True)], g1, rtol=MITSUBA)


@pytest.mark.parametrize("alpha", ALPHAS, ids=str)
def test_mitsuba_has_the_same_densities(mi, alpha):
    m, w = directions(60), directions(60, seed=1)
    pairs = list(zip(w.tolist(), m.tolist(), strict=True))
    visible = evaluate(cross_section.pdf, m, w, alpha)
    # Its density of visible normals has |w·m| for max(0, w·m), and a G1 that is 0 on back faces.
    assert_allclose([distribution(mi, "ggx", alpha).pdf(*p) for p in pairs], visible, rtol=MITSUBA, atol=1e-12)
    plain = evaluate(normals.pdf_ggx, m, alpha)
    assert_allclose([distribution(mi, "ggx", alpha, False).pdf(*p) for p in pairs], plain, rtol=MITSUBA)


@pytest.mark.parametrize("alpha", ALPHAS, ids=str)
def test_mitsuba_draws_the_same_law(mi, alpha):
    """Its map from u differs from every one here; the laws must agree: first and second moments of stratified samples."""
    w = np.array([0.6, 0.0, 0.8], np.float32)
    side = 128
    grid = (np.stack(np.meshgrid(*[np.arange(side)] * 2), -1).reshape(-1, 2) + 0.5) / side
    peer = distribution(mi, "ggx", alpha)
    theirs = np.array([np.array(peer.sample(w.tolist(), u.tolist())[0]).ravel() for u in grid])
    ours = evaluate(lambda u, wi, a: cross_section.sample(u, wi, a), grid, w, alpha)
    # What is left is the heavy tail in the outermost strata, 1/128 of the samples: 1.5e-3 measured at α = 0.1.
    assert_allclose(theirs.mean(0), ours.mean(0), atol=3e-3)
    assert_allclose((theirs**2).mean(0), (ours**2).mean(0), atol=3e-3)


def test_mitsuba_sggx_is_the_ellipsoid(mi):
    """sggx_pdf / ‖A n‖ = D and sggx_projected_area = ‖A u‖ with S = AᵀA."""
    m, w = directions(40), directions(40, seed=1)
    alpha, angles = np.array([0.3, 0.5]), np.array([0.2, -0.1, 0.7])
    with jax.enable_x64(True):
        A = ellipsoid.shape_matrix(jnp.asarray(alpha), jnp.asarray(angles))
        S = np.asarray(ellipsoid.sggx(A))
        A = np.asarray(A)
    s = mi.SGGXPhaseFunctionParams([S[0, 0], S[1, 1], S[2, 2]], [S[0, 1], S[0, 2], S[1, 2]])
    D = evaluate(ndf.ellipsoid, m, A)
    theirs = np.array([float(mi.sggx_pdf(row.tolist(), s)) for row in m])
    assert_allclose(theirs / np.linalg.norm(A[:, 2]), D, rtol=MITSUBA)
    area = [float(mi.sggx_projected_area(row.tolist(), s)) for row in w]
    assert_allclose(area, np.linalg.norm(w @ A.T, axis=1), rtol=MITSUBA)


def test_scipy_has_the_ellipsoid_slope_density():
    """The bivariate Student-t density with 2 degrees of freedom, location the mean slope and shape half the scatter."""
    mean, scatter = np.array([0.1, -0.05]), np.array([[0.04, 0.01], [0.01, 0.09]])
    points = np.random.default_rng(2).normal(size=(200, 2)) * 0.5
    with jax.enable_x64(True):
        A = np.asarray(ellipsoid.from_slopes(jnp.asarray(mean), jnp.asarray(scatter)))
    ours = evaluate(slopes.ellipsoid, points, A)
    # SciPy's stub asks for a number where the function takes a matrix.
    half, whole = (stats.multivariate_t(mean, s, df=2) for s in (scatter / 2, scatter))  # pyright: ignore[reportArgumentType]
    assert_allclose(ours, half.pdf(points), rtol=1e-12)
    assert not np.allclose(ours, whole.pdf(points), rtol=1e-3)


def test_published_table_of_correlated_g2():
    """α = (0.1, 0.8), both directions at 60° from n: along x and x, x and y, y and y."""
    along_x, along_y = (np.array(w) for w in ([np.sqrt(0.75), 0, 0.5], [0, np.sqrt(0.75), 0.5]))
    n = np.array([0, 0, 1.0])
    g1_x, g1_y = evaluate(masking.g1_ggx, np.stack([along_x, along_y]), np.stack([n, n]), np.array([0.1, 0.8]))
    pairs = np.array([[g1_x, g1_x], [g1_x, g1_y], [g1_y, g1_y]])
    g2 = evaluate(masking.g2_height_correlated, *pairs.T)
    assert_allclose(g2, [0.985329, 0.734298, 0.585206], atol=1e-6)
    assert not np.allclose(evaluate(masking.g2_separable, *pairs.T), g2, atol=1e-6)


def test_slope_beckmann_agrees_with_the_normal_distribution():
    """At normal incidence the slopes are two independent normal variables with variance α²/2."""
    u = np.random.default_rng(3).random((500, 2))
    m = evaluate(lambda u, wi, a: slope_beckmann.sample(u, wi, a), u, np.array([0, 0, 1.0]), np.array([0.2, 0.6]))
    expected = stats.norm.ppf(u) * np.array([0.2, 0.6]) / np.sqrt(2)
    assert_allclose(-m[:, :2] / m[:, 2:], expected, rtol=1e-12, atol=1e-14)
