"""The digits that the library promises in float32 where plain sums cancel: in two words, or by half vectors of their own."""

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flint import arb, ctx

from ggxref import _kepler, bsdf, ndf, slopes, stable
from ggxref._canonical import canonical_frame, canonical_terms
from ggxref.ellipsoid import canonical
from ggxref.measure.accuracy import compiled, measure
from ggxref.measure.derivatives import half_ulp, jacobian, points
from ggxref.measure.reference import REFERENCES
from ggxref.measure.regions import rounded, skewed
from ggxref.measure.tables import DRAWS, library
from ggxref.measure.variants.brdf import plain_sum
from ggxref.measure.variants.densities import fresnel_plain_root
from ggxref.measure.variants.directions import cap_uncorrected
from ggxref.oracle import ellipsoid as ellipsoid_oracle
from ggxref.oracle import ndf as oracle
from ggxref.oracle.precision import exact
from ggxref.sampling import _lune, _sphere, ellipsoid_bounded, ellipsoid_cap
from ggxref.sampling._ellipsoid import from_sphere, shortened, to_sphere

COUNT = 1 << 13
SLOPES = "sampling.slope_ggx.sample"
LUNE = "sampling.lune.sample"
# A little above the largest error in ulps that 2^16 to 2^20 points of every region and a search came to.
LARGEST = {
    "ndf.ellipsoid": 6.0,
    "sampling.ellipsoid_cap.pdf": 8.0,
    "masking.g1_ellipsoid": 3.6,
    "ellipsoid.projected_area": 5.3,
    "ellipsoid.lune_area": 5.5,
    "masking.g1_ggx": 3.4,
    "jacobian.linear": 5.7,
    "jacobian.refraction": 5.9,
    "geometry.refract": 14,
    "slopes.ggx": 6.0,
    "slopes.beckmann": 3.8,
    "ndf.beckmann": 5.6,
    "ndf.student_t": 5.1,
    "sampling.slope_beckmann.pdf": 7.6,
    "masking.lambda_beckmann": 3.6,
    "masking.g1_beckmann": 3.8,
}


def found(name, function, region, rounds=1):
    return measure(
        name, "", function, REFERENCES[name], region=region, count=COUNT, rounds=rounds, draws=DRAWS.get(name)
    )


@pytest.mark.parametrize("name", LARGEST)
def test_no_digit_is_lost_to_skew_or_extremes(name):
    for region in ("skew", "ordinals"):
        assert found(name, library(name), region).worst < LARGEST[name]


def plain_ellipsoid(wm, A):
    x, y, z = jnp.linalg.inv(A).T @ wm
    q = x * x + y * y + z * z
    return 1 / (math.pi * jnp.abs(jnp.linalg.det(A)) * jnp.linalg.norm(A[:, 2]) * q * q)


def plain_beckmann(wm, alpha):
    square = (wm[0] / alpha[0]) ** 2 + (wm[1] / alpha[1]) ** 2
    return jnp.exp(-square / wm[2] ** 2) / (math.pi * alpha[0] * alpha[1] * wm[2] ** 4)


def plain_student(wm, alpha, gamma):
    square = (wm[0] / alpha[0]) ** 2 + (wm[1] / alpha[1]) ** 2
    log = jnp.log1p(square / wm[2] ** 2 / (gamma - 1))
    return jnp.exp(-gamma * log) / (math.pi * alpha[0] * alpha[1] * wm[2] ** 4)


@pytest.mark.parametrize(
    ("name", "function"),
    [("ndf.ellipsoid", plain_ellipsoid), ("ndf.beckmann", plain_beckmann), ("ndf.student_t", plain_student)],
    ids=["D", "Beckmann", "Student"],
)
def test_plain_sums_lose_them(name, function):
    assert found(name, function, "skew", rounds=0).p999 > 2 * LARGEST[name]


@pytest.mark.parametrize("region", ["typical", "ordinals"])
def test_dielectric_towards_the_critical_angle(region):
    """There 1 − η² + (ηc)² cancels, and F goes with its root; by a plain sum it is wrong by hundreds or thousands of ulps."""
    assert found("fresnel.dielectric", library("fresnel.dielectric"), region).worst < 15
    assert found("fresnel.dielectric", fresnel_plain_root, region).worst > 150


# Ends of the range of a cosine, and of γ: from a tail without a mean to Beckmann's.
@pytest.mark.parametrize("gamma", [1.00001, 2.0, 30.0, 1e6, 1e25])
@pytest.mark.parametrize("z", [1e-30, 1e-12, 1e-3, 0.7])
def test_students_tails(z, gamma):
    sine = math.sqrt(1 - z * z)
    for alpha in ([0.1, 0.3], [2.0, 2e-3]):
        rows = [np.asarray(row, np.float32) for row in ([0.8 * sine, 0.6 * sine, z], alpha, gamma)]
        value = float(ndf.student_t(*(jnp.asarray(row) for row in rows)))
        wm, shape = ([arb(float(c)) for c in row] for row in rows[:2])
        with ctx.workprec(300):
            exact = oracle.student_t(wm, shape, arb(float(rows[2])))
            error = float(abs(value / exact - 1))
        largest, tiny = (float(x) for x in (np.finfo(np.float32).max, np.finfo(np.float32).tiny))
        if tiny < exact < largest:
            assert error < LARGEST["ndf.student_t"] * 2**-24
        else:
            assert value == (0 if exact < 1 else math.inf)


def test_student_beside_the_end_of_the_range():
    """γ − 1 + slope² is a number yet, its inverse in the dtype 0."""
    slope, one = jnp.asarray([1.5e19, 0.0], jnp.float32), jnp.ones(2, jnp.float32)
    assert slopes.student_t(slope, one, 2.0) == 0
    assert slopes.student_t(slope, 1e-3 * one, 1.001) == 0  # here slope²/α² itself is not


def without_rests(x, y, z):
    zero = jnp.zeros_like(z)
    return (x, zero), (y, zero), (z, zero)


def plain_ellipsoid_cap(u, wi, A):
    """The cap sampler with the half vector as the plain sum."""
    terms = canonical_terms(A)
    half = _sphere.sum_in_cap(u, _sphere.ray(*(c for c, _ in to_sphere(wi, terms))), 0)
    return from_sphere(without_rests(half.x, half.y, half.z), terms)


@pytest.mark.parametrize(
    ("name", "plain"),
    [("sampling.spherical_cap.sample", cap_uncorrected), ("sampling.ellipsoid_cap.sample", plain_ellipsoid_cap)],
    ids=["GGX", "ellipsoid"],
)
def test_half_vectors_that_nearly_cancel(name, plain):
    """Beyond what half an ulp of its inputs explains, a sample is within 2 ε of the exact map (4 × 2⁻²⁴); the plain sum is not."""
    for region in ("grazing", "anisotropic"):
        assert found(name, library(name), region, rounds=0).excess < 4
        assert found(name, plain, region, rounds=0).excess > 10


def slopes_by_angles(u, wi, alpha):
    """The slope sampler with ψ itself, as the difference of two angles."""
    x, y, z = stable.unit(alpha[0] * wi[0], alpha[1] * wi[1], wi[2])
    psi = jnp.arcsin(u[0] * (1 + z) - z) - jnp.arccos(z)
    c, s = _kepler.kepler(jnp.minimum(u[1], 1 - u[1]))
    along, across = -jnp.sin(psi) * s, jnp.where(u[1] > 0.5, -c, c)
    cos_i, sin_i = stable.azimuth(x, y)
    h = cos_i * along - sin_i * across, sin_i * along + cos_i * across, jnp.cos(psi) * s
    return _sphere.unstretch(*h, alpha)


def test_slope_sampler_is_within_two_epsilon():
    """4 × 2⁻²⁴: all but what half an ulp of its inputs explains, and 999 of 1000 samples outright."""
    for region in ("grazing", "ordinals"):
        ours, plain = (found(SLOPES, f, region, rounds=0) for f in (library(SLOPES), slopes_by_angles))
        assert max(ours.excess, ours.p999) < 4
        assert min(plain.excess, plain.p999) > 10


def test_brdf_of_directions_of_unequal_length():
    """Made equally long, they leave 10 ulp beyond what half an ulp of either explains, and exactly unit ones 17 ulp in all; as they
    are, neither."""

    def graded(add, region):
        return found("bsdf.brdf_ggx", functools.partial(bsdf.brdf_ggx, add=add), region, rounds=0)

    for region in ("anisotropic", "ordinals"):
        assert graded(stable.evened_sum, region).excess < 10
        assert graded(stable.unit_sum, region).worst < 17
        assert graded(plain_sum, region).excess > 1000


def test_scales_near_the_ends_of_the_range():
    """A's determinant is a number; its squares, and its product with itself, are not."""
    n = jnp.asarray([0.0, 0.0, 1.0], jnp.float32)
    for scale in (6.5e12, 6.5e-13):
        assert ndf.ellipsoid(n, scale * jnp.eye(3, dtype=jnp.float32)) == pytest.approx(1 / math.pi, rel=1e-6)
    u, wi = jnp.asarray([0.3, 0.4], jnp.float32), jnp.asarray([0.6, 0.0, 0.8], jnp.float32)
    long = jnp.diag(jnp.asarray([1e10, 1, 1], jnp.float32))
    for sampler in (ellipsoid_cap, ellipsoid_bounded):
        assert jnp.linalg.norm(sampler.sample(u, wi, long)) == pytest.approx(1, rel=1e-6)


def lune_in_one_word(u, wi, A):
    """The lune's sampler with its rests left out."""
    frame = canonical_frame(A)
    i, _ = shortened(to_sphere(wi, frame.terms))
    x, y, z = (c for c, _ in i)
    return from_sphere(without_rests(*_lune.plain_point(u, (x, y, z), frame.side, frame.pole)), frame.terms)


def test_lune_sampler_is_within_two_epsilon():
    """As the slope sampler; `ordinals` has u of 1e-6, where 2u - 1 loses the digits of u, and anisotropies of 50."""
    for region in ("skew", "ordinals"):
        ours, plain = (found(LUNE, f, region, rounds=0) for f in (library(LUNE), lune_in_one_word))
        assert max(ours.excess, ours.p999) < 4
        assert min(plain.excess, plain.p999) > 5


def cap_in_one_word(u, wi, A):
    """The ellipsoid's cap as GGX's, with the correction of its sum."""
    terms = canonical_terms(A)
    i, _ = shortened(to_sphere(wi, terms))
    h = _sphere.half_in_cap(u, _sphere.ray(*(c for c, _ in i)), 0)
    return from_sphere(without_rests(*h), terms)


def test_caps_of_the_ellipsoid_are_within_two_epsilon():
    """As the slope sampler; for α up to 10, too."""
    for region in ("skew", "rough"):
        for name in ("sampling.ellipsoid_cap.sample", "sampling.ellipsoid_bounded.sample"):
            ours = found(name, library(name), region, rounds=0)
            assert max(ours.excess, ours.p999) < 4
        assert found("sampling.ellipsoid_cap.sample", cap_in_one_word, region, rounds=0).p999 > 5


def turned_matrices(n):
    """Shape matrices of any skew, smoothness and shear, their rows turned: the canonical form has to undo it."""
    rng = np.random.default_rng(0)
    alpha, e = (
        np.exp(rng.uniform(np.log(1e-4), np.log(3), (2, n))),
        rng.normal(size=(2, n)) * np.exp(rng.uniform(-2, 2, n)),
    )
    turns, _ = np.linalg.qr(rng.normal(size=(n, 3, 3)))
    return jnp.asarray(np.einsum("nij,jkn->ikn", turns, skewed(alpha, e, rng.normal(size=n))), jnp.float32)


def plain_canonical(A):
    """By Cholesky's factor of the inverse of (AᵀA)⁻¹'s upper block."""
    S = A.T @ A
    e = S[:2, 2] / S[2, 2]
    C = jnp.linalg.cholesky(S[:2, :2] / S[2, 2] - jnp.outer(e, e))
    return jnp.zeros((3, 3)).at[:2, :2].set(C.T).at[2].set(jnp.append(e, 1))


def canonical_error(function, A):
    """In ulps of the oracle's numbers, the largest."""
    form = np.asarray(jax.jit(jax.vmap(function, -1, -1))(A))
    worst = 0.0
    for k in range(A.shape[-1]):
        for row, exactly in zip(form[..., k], ellipsoid_oracle.canonical(exact(np.asarray(A[..., k]))), strict=True):
            for x, y in zip(row, exactly, strict=True):
                worst = max(worst, abs(float(y - float(x))) / float(np.spacing(np.float32(abs(float(y))))))
    return worst


def test_the_canonical_form_is_rounded_once():
    A = turned_matrices(256)
    assert canonical_error(canonical, A) < 0.6
    assert not canonical_error(plain_canonical, A) < 100


@pytest.mark.parametrize("x64", [False, True])
def test_what_is_canonical_stays_as_it_is(x64):
    with jax.enable_x64(x64):
        form = jax.jit(jax.vmap(canonical, -1, -1))
        once = form(turned_matrices(4096).astype(float))
        assert (form(once) == once).all()


def plain_bound(wi, A):
    """The bound of the bounded ellipsoid cap with its sum in one word."""
    terms = canonical_terms(A)
    i, (c_square, q) = A @ wi, ellipsoid_bounded._largest_q(wi, terms)
    return -(terms.ex * wi[0] + terms.ey * wi[1] + wi[2] * (q / (c_square + q))) / jnp.sqrt(i @ i)


def beyond_inputs(function, region):
    """Largest error of a bound beyond what half an ulp of its inputs explains, in ulps; by float64."""
    drawn = rounded(points(region, np.random.default_rng(12), COUNT), np.float32)
    args = drawn["wi"], drawn["A"]
    wide = [a.astype(np.float64) for a in args]
    exactly = compiled(jacobian(ellipsoid_bounded.bound))(*wide)[0]
    steps = np.concatenate([half_ulp(a).reshape(-1, COUNT) for a in args])
    error = np.abs(compiled(function)(*args) - exactly[0]) - (np.abs(exactly[1:]) * steps).sum(0)
    return np.max(error / (2 * half_ulp(exactly[0].astype(np.float32))))


def test_bound_of_the_ellipsoid_where_its_sum_cancels():
    """e·ωi against i_z (1 − 1/max Q), where the mean slope faces away: hundreds of ulps of the inputs, and one of its own."""
    for region in ("smooth", "skew"):
        assert beyond_inputs(ellipsoid_bounded.bound, region) < 2
        assert beyond_inputs(plain_bound, region) > 5
