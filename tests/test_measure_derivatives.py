"""Derivatives in float32 keep their digits wherever the inputs' rounding leaves them; a form that loses them is caught."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from ggxref import bsdf, stable
from ggxref._canonical import Canonical, canonical_terms
from ggxref.measure.accuracy import arguments, compiled
from ggxref.measure.derivatives import blocks, half_ulp, jacobian, measure, points, proof, worst_corner
from ggxref.measure.regions import rounded
from ggxref.measure.tables import DRAWS, library
from ggxref.sampling import _ellipsoid, _sphere, ellipsoid_bounded, lune, slope_beckmann

COUNT = 512
LIMIT = 1e-4
# Float64's own rounding against the oracle, at the condition of these regions: measured at most 4e-14.
EXACT = 1e-12
NAMES = [
    "fresnel.schlick",
    "masking.g1_ggx",
    "masking.g2_height_correlated",
    "ndf.student_t",
    "sampling.lune.sample",
    "sampling.spherical_cap.pdf",
    "sampling.spherical_cap.sample",
    "slopes.stretch",
]


@pytest.mark.parametrize("name", NAMES)
def test_well_conditioned_derivatives_keep_four_digits(name):
    function = library(name)
    for region in ("smooth", "perpendicular"):
        found = measure(name, function, arguments(function), region, COUNT)
        assert found.worst < LIMIT, found
        assert found.not_finite == 0 and found.ill < COUNT / 2
        assert proof(name, function, arguments(function), region, 4).max() < EXACT


def test_the_side_of_a_kink_is_decided_in_all_digits():
    """Of `g1_ellipsoid` at n, where float32's quotient is 1 on either side."""
    g1 = library("masking.g1_ellipsoid")
    found = measure("masking.g1_ellipsoid", g1, arguments(g1), "near_normal", COUNT)
    assert found.worst < LIMIT and found.ill < COUNT / 2, found


def plain_g1(w, wm, alpha):
    stretched = jnp.sqrt((alpha[0] * w[0]) ** 2 + (alpha[1] * w[1]) ** 2 + w[2] ** 2)
    return jnp.where(wm @ w > 0, 2 * w[2] / (w[2] + stretched), 0)


def plain_stretch(w, factors):
    v = jnp.stack([factors[0] * w[0], factors[1] * w[1], w[2]])
    return v / jnp.sqrt(v @ v)


@pytest.mark.parametrize(
    ("name", "plain"), [("masking.g1_ggx", plain_g1), ("slopes.stretch", plain_stretch)], ids=["G1", "stretch"]
)
def test_a_derivative_that_cancels_is_caught(name, plain):
    assert measure(name, plain, arguments(plain), "smooth", COUNT, library(name)).worst > 5 * LIMIT


def test_the_worst_corner_is_that_of_all_corners():
    """Of a quadratic form, whose derivative is linear: of 2⁵ corners, four drawn at random move it by half as much."""
    rng = np.random.default_rng(11)
    form = rng.normal(size=(5, 5))

    def quadratic(wi, u):
        x = jnp.concatenate([wi, u])
        return x @ jnp.asarray(form) @ x / 2

    args = [rng.normal(size=(3, 16)).astype(np.float32), rng.normal(size=(2, 16)).astype(np.float32)]
    cut, which = blocks(("wi", "u"), args), np.array([3, 0, 15])
    found = worst_corner(compiled(jacobian(quadratic)), args, which, cut)
    steps = np.concatenate([half_ulp(a) for a in args])[:, which]
    signs = np.array(list(itertools.product([-1, 1], repeat=5)))
    changes = np.einsum("cj,rj,jp->crp", signs, (form + form.T) / 2, steps)
    for block, rows in zip(found, (slice(0, 3), slice(3, 5)), strict=True):
        # The corner that moves one number the farthest moves the block nearly so: at most by √rows less.
        largest = np.sqrt((changes[:, rows] ** 2).sum(1)).max(0)
        assert np.all(block <= largest * (1 + 1e-6)) and np.all(
            block >= np.abs(changes[:, rows]).max((0, 1)) * (1 - 1e-6)
        )


@pytest.mark.parametrize("wide", [False, True], ids=["float32", "float64"])
def test_a_derivative_that_is_not_finite_is_counted(wide):
    """Also where it is the reference's alone, with which nothing can be compared."""

    def pole(cos_i, f0):
        value = library("fresnel.schlick")(cos_i, f0)
        broken = (cos_i.dtype == jnp.float64) == wide
        return value + jnp.sqrt(jnp.where(f0 > 0.5, 0 * f0, 1)) - 1 if broken else value

    found = measure("fresnel.schlick", pole, ("cos_i", "f0"), "typical", COUNT)
    assert COUNT / 4 < found.not_finite < 3 * COUNT / 4 and found.fault_input


@pytest.mark.parametrize("sampler", ["ellipsoid_cap", "ellipsoid_bounded"])
def test_samples_of_smooth_skewed_ellipsoids_turn_by_little(sampler):
    """A change of the half vector's height moves `Aᵀ` of it by |e|, along the micronormal, and turns that by α: 2e-4 if not left out."""
    name = f"sampling.{sampler}.sample"
    assert measure(name, library(name), ("u", "wi", "A"), "smooth", 4096).worst < 5e-5


@pytest.mark.parametrize("name", ["sample_rejection_sphere", "sample_rejection_ellipsoid"])
def test_accepted_samples_of_smooth_ellipsoids_turn_by_little(name):
    """As above: by u and by ω_i, 2e-4 and more if not left out."""
    name = f"sampling.lune.{name}"
    found = measure(name, library(name), ("rows", "wi", "A"), "smooth", 4096)
    assert found.worst < 5e-5 and found.not_finite == 0, found


def test_samples_beside_the_azimuth_of_the_larger_roughness():
    """By alpha, what turns them is the cube of a sine: 1.6e-4 as a difference."""
    name = "sampling.cross_section.sample"
    assert measure(name, library(name), ("u", "wi", "alpha"), "ordinals", 4096).worst < 5e-5


def test_samples_perpendicular_to_the_incident_direction_are_so_for_every_alpha():
    """At the disk's far rim the larger alpha changes hardly more than their length before it is divided by: 3e-3 if not left out."""
    rng = np.random.default_rng(13)
    u = np.stack([rng.uniform(0.05, 0.45, 4096), 1 - 10.0 ** rng.uniform(-6, -3, 4096)])
    azimuth, height = rng.uniform(0.5, 1.5, 4096), rng.uniform(0.3, 0.9, 4096)
    wi = np.stack([np.cos(azimuth), np.sin(azimuth), height]) / np.hypot(1, height)
    alpha = np.stack([10.0 ** rng.uniform(-4, -3, 4096), rng.uniform(0.5, 5, 4096)])
    given = [x.astype(np.float32) for x in (u, wi, alpha)]
    by_alpha = jax.vmap(jax.jacrev(library("sampling.cross_section.sample"), 2), in_axes=-1)
    found = []
    for dtype in (np.float32, np.float64):
        with jax.enable_x64(True):
            found.append(np.asarray(jax.jit(by_alpha)(*(x.astype(dtype) for x in given))[..., 1], np.float64))
    single, exact = found
    miss = np.linalg.norm(single - exact, axis=1) / np.linalg.norm(exact, axis=1)
    assert miss.max() < LIMIT


def _jacobians(name, *args):
    """By the second argument, in float32 and in float64, at the same numbers."""
    found = []
    for dtype in (np.float32, np.float64):
        with jax.enable_x64(True):
            given = [np.asarray(a, np.float32).astype(dtype) for a in args]
            found.append(np.asarray(jax.jit(jax.jacrev(library(name), 1))(*given), np.float64))
    return found


def turned_and_unstretched(along, across, height, wi, alpha):
    """`unturned` as it is defined."""
    cos_i, sin_i = stable.azimuth(alpha[0] * wi[0], alpha[1] * wi[1])
    x, y = cos_i * along - sin_i * across, sin_i * along + cos_i * across
    return _sphere.unstretch(x, y, height, alpha)


def test_the_direction_across_does_not_depend_on_alpha():
    """As it is defined, that cancels: the normal's derivatives by α in float32 then lose their digits."""
    rng = np.random.default_rng(11)
    parts = np.stack([rng.uniform(-1e-2, 1e-2, 256), np.ones(256), 10.0 ** rng.uniform(-5, -1, 256)])
    azimuth, height = rng.uniform(0, 2 * np.pi, 256), 10.0 ** rng.uniform(-3, -1, 256)
    wi = np.stack([np.cos(azimuth), np.sin(azimuth), height]) / np.hypot(1, height)
    given = [a.astype(np.float32) for a in (*parts, wi, 10.0 ** rng.uniform(-3, 1, (2, 256)))]

    def by_alpha(function, dtype):
        with jax.enable_x64(True):
            rows = jax.jit(jax.vmap(jax.jacrev(function, 4), in_axes=-1))(*(a.astype(dtype) for a in given))
            return np.asarray(rows, np.float64)

    def miss(found):
        return (np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)).max()

    def ours(*args):
        return stable.direction(*_sphere.unturned(*args))

    expected = by_alpha(turned_and_unstretched, np.float64)
    assert miss(by_alpha(ours, np.float64)) < 1e-10
    assert miss(by_alpha(ours, np.float32)) < LIMIT
    assert miss(by_alpha(turned_and_unstretched, np.float32)) > LIMIT


def test_a_turn_of_the_sphere_hardly_turns_a_narrow_ellipsoid():
    """Most of it lengthens the micronormal, along (c00, c10, 0), and is left out: as a difference, 3e-4 of what is left is wrong."""
    rng = np.random.default_rng(12)
    c00, c10, c11 = rng.uniform(1, 10, 256), rng.uniform(-4, 4, 256), 10.0 ** rng.uniform(-4, -3, 256)
    height, ex, ey = rng.uniform(0, 0.1, 256), *rng.normal(size=(2, 256))
    numbers = [a.astype(np.float32) for a in (rng.uniform(-1, 1, 256), height, c00, c10, c11, ex, ey)]

    def micronormal(angle, height, *terms):
        zero = jnp.zeros_like(height)
        point = (jnp.cos(angle), zero), (jnp.sin(angle), zero), (height, zero)
        return _ellipsoid.from_sphere(point, Canonical(*terms))

    by_angle = []
    for dtype in (np.float32, np.float64):
        with jax.enable_x64(True):
            turned = jax.jit(jax.vmap(jax.jacfwd(micronormal)))(*(a.astype(dtype) for a in numbers))
            by_angle.append(np.asarray(turned, np.float64))
    found, expected = by_angle
    assert (np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)).max() < 2e-5


def test_points_beside_the_rim_of_the_disk_turn_by_little():
    """As the height of the point on the sphere is small there: by ω_i, 3e-3 of its change as a difference."""
    A = [[1.1343595, 9.2107266e-2, 0], [0, 4.3569357e-4, 0], [-1.4835156e-2, 6.7633010e-2, 1]]
    u, wi = [1.864018e-6, 1.4125832e-5], [0.97746122, 0.21111488, 2.2517027e-4]
    found, expected = _jacobians("sampling.lune.sample", u, wi, A)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-5 * float(np.linalg.norm(expected)))


@pytest.mark.parametrize("alpha", [1e-11, 1e-12])
def test_bounding_sphere_of_extreme_ellipsoids_has_derivatives(alpha):
    """The determinant's square, a divisor of its derivative, left the range: NaN before."""
    A = jnp.asarray([[alpha, -alpha / 3, 0], [0, alpha / 2, 0], [0.2, -0.3, 1]], jnp.float32)
    u = np.random.default_rng(8).random((64, 4, 2)).astype(np.float32)
    wi = jnp.asarray([0.6, 0.0, 0.8], jnp.float32)
    by_all = jax.jacrev(lambda *args: lune.sample_rejection_sphere(*args)[0], (0, 1, 2))
    found = jax.jit(jax.vmap(by_all, (0, None, None)))(u, wi, A)
    assert all(np.isfinite(slopes).all() for slopes in found)


def bound_by_autodiff(wi, A):
    """The bound as it is defined, of a canonical `A`, by autodiff."""
    i = A @ wi
    c_square, q = ellipsoid_bounded._largest_q(wi, canonical_terms(A))
    return (wi[2] * c_square / (c_square + q) - i[2]) / jnp.sqrt(i @ i)


def test_the_bound_of_a_smooth_ellipsoid_keeps_its_small_derivative():
    """It is nearly -1, and its derivative of the order of α²: what autodiff gives are multiples of 2⁻²³."""
    name = "sampling.ellipsoid_bounded.bound"
    for region in ("smooth", "skew"):
        assert measure(name, library(name), ("wi", "A"), region, 4096).worst < 2e-5
    assert measure(name, bound_by_autodiff, ("wi", "A"), "smooth", COUNT, library(name)).worst > 1


@pytest.mark.parametrize("name", ["ellipsoid_cap", "ellipsoid_bounded"])
def test_at_the_far_rim_of_a_rough_surface_a_sample_turns_as_it_should(name):
    """c is nearly -i: the sum's terms cancel to 10⁻⁵, and in one word their derivatives to 3·10⁻³."""
    A = [[6.414378, -1.6445675, 0], [0, 0.00027401315, 0], [-0.28940663, 0.10127684, 1]]
    given = [0.99999607, 0.99996626], [0.0045500733, 0.99998963, 4.7793557e-05], A
    plain, exact = _jacobians(f"sampling.{name}.sample", *given)
    assert np.abs(plain - exact).max() < LIMIT * np.abs(exact).max()


def test_a_change_along_the_incident_direction_does_not_move_the_bound():
    """Else its derivative jumps along ω_i where the largest inclination takes over from the peak; on the sphere it does not."""
    rng = np.random.default_rng(5)
    for _ in range(8):
        wi = rng.normal(size=3)
        wi = np.abs(wi) / np.linalg.norm(wi)
        A = np.array(
            [[rng.uniform(0.05, 0.5), 0.02, 0], [0, rng.uniform(0.05, 0.5), 0], [*0.1 * rng.normal(size=2), 1]]
        )  # little skewed: no peak
        with jax.enable_x64(True):
            by_wi = np.asarray(jax.jit(jax.jacrev(library("sampling.ellipsoid_bounded.bound")))(wi, A))
        assert abs(by_wi @ wi) < 1e-12 * np.linalg.norm(by_wi)


def test_a_lost_term_is_caught_by_the_oracle():
    def frozen(w, wm, alpha):
        return library("masking.g1_ggx")(w, wm, jax.lax.stop_gradient(alpha))

    with jax.enable_x64(True):
        found = proof("masking.g1_ggx", frozen, ("w", "wm", "alpha"), "rough", 2)
    assert found.max() > 0.1


def test_second_derivatives_of_a_direction():
    """`unit` takes what lengthens the vector out of its first derivative, and must not out of the second, nor of what follows."""

    def plain(v):
        return ((v / jnp.sqrt(v @ v)) @ jnp.arange(1.0, 4.0)) ** 2

    with jax.enable_x64(True):
        v = jnp.asarray([0.3, -0.2, 1.4])
        found = jax.jit(jax.hessian(lambda v: (jnp.stack(stable.unit(*v)) @ jnp.arange(1.0, 4.0)) ** 2))(v)
        np.testing.assert_allclose(found, jax.jit(jax.hessian(plain))(v), atol=1e-14)


def test_derivative_of_a_beckmann_sample_far_below_the_horizon():
    """By u it is a quotient of Gaussians that float32 does not hold; 0 before."""
    wi, alpha = np.array([0.7, 0, -0.714]) / np.hypot(0.7, 0.714), np.array([0.1, 0.1])
    slopes = jax.jit(jax.jacfwd(slope_beckmann.sample))
    found = slopes(*(jnp.asarray(x, jnp.float32) for x in ([0.3, 0.4], wi, alpha)))
    with jax.enable_x64(True):
        low, high = (jax.jit(slope_beckmann.sample)(np.array([u, 0.4]), wi, alpha) for u in (0.3 - 1e-6, 0.3 + 1e-6))
    np.testing.assert_allclose(found[:, 0], (np.asarray(high) - np.asarray(low)) / 2e-6, atol=1e-7)


brdf_slopes = jax.jit(jax.grad(bsdf.brdf_ggx, argnums=(0, 1, 2)))


@pytest.mark.parametrize("height", [1e-12, 1e-18, 1e-36])
@pytest.mark.parametrize("y", [0.0, 0.3])
def test_gradient_of_the_brdf_of_opposite_directions(height, y):
    """Towards z = 0 it grows beyond float32's range, to whose end it is cut; NaN before."""
    x = np.sqrt(1 - y * y)
    wi, wo = (jnp.asarray([s * x, s * y, height], jnp.float32) for s in (1, -1))
    slopes = brdf_slopes(wi, wo, jnp.asarray([0.5, 0.25], jnp.float32))
    assert all(np.isfinite(s).all() for s in slopes)
    if y == 0 and height > 1e-19:  # 1/(4π αx² αy z)
        value = 1 / (4 * np.pi * 0.5**2 * 0.25 * float(wi[2]))
        np.testing.assert_allclose(slopes[2], [-4 * value, -4 * value], rtol=1e-5)


# Function of a shape matrix -> the power of c that it is multiplied by for c A.
HOMOGENEOUS = {
    "ndf.ellipsoid": 0,
    "masking.g1_ellipsoid": 0,
    "ellipsoid.size": 1,
    "ellipsoid.gaussian_curvature": 2,
    "ellipsoid.lune_area": -2,
    "jacobian.linear": 0,
    "sampling.ellipsoid_bounded.sample": 0,
    "sampling.ellipsoid_cap.sample": 0,
    "sampling.lune.sample": 0,
}


@pytest.mark.parametrize("name", HOMOGENEOUS)
def test_scale_of_the_shape_matrix_is_no_matter(name):
    """To the bit: 2^±40 is 1e±12, for which products of minors leave float32's range."""
    function = library(name)
    draws = DRAWS.get(name, arguments(function))
    drawn = rounded(points("skew", np.random.default_rng(3), 64), np.float32)
    run = jax.jit(jax.vmap(function, in_axes=-1))

    def at(power):
        args = [drawn[d] * np.float32(2.0**power) if d in ("A", "M") else drawn[d] for d in draws]
        return [np.asarray(x) for x in jax.tree.leaves(run(*args))]

    for power in (-40, 40):
        for found, expected in zip(at(power), at(0), strict=True):
            np.testing.assert_array_equal(found, expected * 2.0 ** (power * HOMOGENEOUS[name]))
