"""The models in the solver's terms are the library's; their spaces move what they say and nothing else."""

import itertools

import fit_data
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.stats
from numpy.testing import assert_allclose

from ggxref import fresnel, geometry, masking, slopes
from ggxref.errors import InputError
from ggxref.fit import kernel, levenberg, models, parameters, rows, solver, student
from ggxref.fit.models import Surface

NAMES = parameters.names(("brdf",))
THETA = np.array([np.log(0.3), np.log(0.15), 0.05, 0.1, -0.06, parameters.GGX, np.log(0.2 / 0.8), np.log(0.1)])
"""Anisotropic, sheared and skewed: each term of every formula counts."""
SAME = 1e-12
"""The same algebra in another order, 20 operations deep, over directions no nearer to the horizon than 10 degrees."""


def directions(degrees):
    zenith_i, azimuth_i, zenith_o, azimuth_o = np.radians(degrees).T
    wi, wo = fit_data.direction(zenith_i, azimuth_i), fit_data.direction(zenith_o, azimuth_o)
    with solver.float64():
        wm = np.asarray(jax.vmap(geometry.half_reflection)(jnp.asarray(wi), jnp.asarray(wo)))
    return wi.T, wo.T, wm.T


def test_brdf_is_the_librarys():
    degrees = fit_data.angles()
    with solver.float64():
        A = np.asarray(models.shape_matrix(THETA))
        found = models.brdfs(THETA, *directions(degrees), Surface())
    assert_allclose(found[0], fit_data.brdf(degrees, A, 0.2, 0.1), rtol=SAME)


def test_g1_is_the_librarys():
    wi, _, wm = directions(fit_data.angles())
    with solver.float64():
        A = models.shape_matrix(THETA)
        expected = jax.vmap(masking.g1_ellipsoid, (-1, -1, None))(jnp.asarray(wi), jnp.asarray(wm), A)
        found = 1 / jax.vmap(models.unmasking, (None, -1, None))(jnp.asarray(THETA), jnp.asarray(wi), "ggx")
    assert_allclose(found, expected, rtol=SAME)


def test_slope_density_is_the_librarys():
    points = np.random.default_rng(2).normal(scale=0.3, size=(2, 50))
    with solver.float64():
        expected = jax.vmap(slopes.ellipsoid, (-1, None))(jnp.asarray(points), models.shape_matrix(THETA))
        found = models.slope_densities(THETA, points, "ggx")
    assert_allclose(found, expected, rtol=SAME)


@pytest.mark.parametrize("tail", parameters.TAILS)
def test_the_standard_densities_and_areas_are_the_librarys(tail):
    """At α = 1 with no mean, for γ = 3; from directions above the horizon, as of the others G1 is 1."""
    theta = np.r_[np.zeros(5), np.log(1.5), 0.0, 0.0]
    points = np.random.default_rng(2).normal(scale=2.0, size=(2, 50))
    wi, _, _ = directions(fit_data.angles()[::7])
    density = {"ggx": slopes.ggx, "beckmann": slopes.beckmann, "student_t": lambda s, a: slopes.student_t(s, a, 3.0)}
    area = {
        "ggx": slopes.sigma_ggx,
        "beckmann": slopes.sigma_beckmann,
        "student_t": lambda w, _: student.sigma(w, jnp.asarray(3.0)),
    }
    with solver.float64():
        expected = jax.vmap(density[tail], (-1, None))(jnp.asarray(points), jnp.ones(2))
        found = models.slope_densities(theta, points, tail)
        seen = jax.vmap(area[tail], (-1, None))(jnp.asarray(wi), jnp.ones(2))
        unmasked = jax.vmap(models.unmasking, (None, -1, None))(jnp.asarray(theta), jnp.asarray(wi), tail)
    assert_allclose(found, expected, rtol=SAME)
    assert_allclose(unmasked, np.asarray(seen) / wi[2], rtol=SAME)


@pytest.mark.parametrize("tail", parameters.TAILS)
def test_the_logarithm_of_the_density(tail):
    near, far = np.random.default_rng(2).normal(scale=0.3, size=(2, 50)), np.full((2, 1), 30.0)
    with solver.float64():
        log_density = jax.vmap(models.log_slope_density, (None, -1, None))
        found = [log_density(jnp.asarray(THETA), jnp.asarray(at), tail) for at in (near, far)]
        expected = np.log(models.slope_densities(THETA, near, tail))
    assert_allclose(found[0], expected, rtol=SAME)
    assert np.isfinite(found[1]).all()


@pytest.mark.parametrize("model", parameters.SHAPES)
def test_a_space_moves_its_parameters_alone(model):
    space = parameters.space(parameters.SHAPES[model], NAMES, {}, 0.1)
    moved = {name for group in parameters.SHAPES[model] for name in group} | {"f0", "diffuse"}
    assert [name for name, yes in zip(NAMES, space.moved, strict=True) if yes] == [n for n in NAMES if n in moved]
    assert space.size == len(parameters.SHAPES[model]) + 2
    theta = space.held + space.basis @ np.arange(1.0, 9.0)
    assert_allclose(space.held + space.basis @ space.coordinates(theta), theta, atol=1e-12)


def test_models_are_nested():
    bases = [parameters.space(groups, NAMES, {}, 1.0).basis for groups in parameters.SHAPES.values()]
    for small, large in itertools.pairwise(bases):
        assert np.linalg.matrix_rank(np.hstack([small, large])) == np.linalg.matrix_rank(large)


def test_fixed_parameters_are_held():
    space = parameters.space(parameters.SHAPES["ellipsoid"], NAMES, {"alpha_y": -2.0, "diffuse": -np.inf}, 0.1)
    assert not space.moved[1] and not space.moved[7] and space.moved[0]
    assert space.held[1] == -2 and space.held[7] == -np.inf
    assert parameters.space(parameters.SHAPES["isotropic"], NAMES, {"alpha_y": -2.0}, 0.1).held[:2].tolist() == [-2, -2]


def test_no_diffuse_term_is_no_nan():
    theta = THETA.copy()
    theta[7] = -np.inf
    with solver.float64():
        values = models.brdfs(theta, *directions(fit_data.angles()), Surface())
        A = np.asarray(models.shape_matrix(theta))
    assert_allclose(values[0], fit_data.brdf(fit_data.angles(), A, 0.2, 0.0), rtol=SAME)


@pytest.mark.parametrize(
    ("name", "value"),
    [("alpha_x", 0.0), ("alpha_y", -0.1), ("alpha_x", np.nan), ("alpha_x", np.inf), ("gamma", 1.5), ("eta", 0.0), ("k", -1.0),
     ("f0", 1.0), ("f0", 0.0),
     ("diffuse", -0.1), ("diffuse", 1.5), ("mean_x", np.inf), ("shear", np.nan)],
)  # fmt: skip
def test_values_without_a_meaning_are_refused(name, value):
    with pytest.raises(InputError, match=f"{name} = .*; need"):
        parameters.from_user(name, value)


@pytest.mark.parametrize("name", [*NAMES, "f0 red", "eta", "k", "diffuse red"])
def test_user_values_come_back(name):
    value = 1.7 if name == "gamma" else 0.37
    assert parameters.to_user(name, parameters.from_user(name, value)) == pytest.approx(value, rel=1e-14)


def test_principal_axes():
    values, _ = parameters.report(THETA, np.zeros((8, 8)), NAMES)
    C = np.array([[0.3, 0], [0.05, 0.15]])
    roots, vectors = np.linalg.eigh(C @ C.T)
    assert_allclose([values["alpha_2"], values["alpha_1"]], np.sqrt(roots), rtol=1e-12)
    axis = vectors[:, 1] * np.sign(vectors[0, 1])
    assert_allclose(values["rotation"], np.arctan2(axis[1], axis[0]), rtol=1e-12)


class TestRows:
    """The compiled call's losses and derivatives against the plain formula's, for two bands."""

    DEGREES = fit_data.angles()[::7]
    MEASURED = np.abs(np.random.default_rng(0).normal(1, 0.5, size=(2, len(DEGREES))))
    BANDS = np.r_[THETA[:6], THETA[6], THETA[6] + 1, THETA[7], THETA[7] - 1]

    def rows(self):
        count = len(self.DEGREES)
        index = np.pad(np.arange(count), (0, rows.ROW - count), constant_values=-1)[None]
        samples = np.concatenate([*directions(self.DEGREES), np.full((2, count), [[0.01], [1.5]]), self.MEASURED])
        padded = np.where(index >= 0, samples[:, index], 1.0).swapaxes(0, 1)
        padded[:, kernel.WEIGHT] *= index >= 0
        return rows.Rows(padded, index, np.zeros(1, int))

    def loss(self, theta):
        """Σ weights · mean over bands of √(1 + r²) − 1."""
        wi, wo, wm = directions(self.DEGREES)
        with solver.float64():
            model = models.brdfs(theta, wi, wo, wm, Surface())
        r = np.log((model * wo[2] + 0.01) / (self.MEASURED * wo[2] + 0.01))
        return 1.5 * np.sum(np.mean(np.sqrt(1 + r * r) - 1, axis=0))

    def at(self, theta, some):
        return rows.each(Surface(), theta[None], some, lambda each: each)[0]

    def test_losses_and_gradients(self):
        some = self.rows()
        found = self.at(self.BANDS, some)
        loss, gradient, _ = found.terms()
        assert_allclose((found.losses.mean(axis=1) * some.weights).sum(), self.loss(self.BANDS), rtol=1e-12)
        assert_allclose(loss[0], self.loss(self.BANDS), rtol=1e-12)
        step = 1e-6 * np.eye(len(self.BANDS))
        slope = [(self.loss(self.BANDS + s) - self.loss(self.BANDS - s)) / 2e-6 for s in step]
        # Differences over 1e-6 keep ten digits of a loss of order 100.
        assert_allclose(gradient[0], slope, rtol=1e-6, atol=1e-6)
        assert_allclose(found.scores().sum(axis=-1), gradient, rtol=1e-10, atol=1e-12 * np.abs(gradient).max())

    def test_the_matrices_at_a_perfect_fit_are_the_hessian(self):
        """There r = 0, so that both weights are 1 and what they leave out is 0."""
        some = self.rows()
        wi, wo, wm = directions(self.DEGREES)
        with solver.float64():
            exact = models.brdfs(self.BANDS, wi, wo, wm, Surface())
        some.samples[0, kernel.VALUES, : exact.shape[1]] = exact
        found = self.at(self.BANDS, some)
        hessian = found.terms().hessian
        assert_allclose(found.bread(), hessian, rtol=1e-12)
        step = 1e-5 * np.eye(len(self.BANDS))
        ahead, behind = (
            np.stack([self.at(self.BANDS + sign * s, some).terms().gradient[0] for s in step]) for sign in (1, -1)
        )
        assert_allclose(hessian[0], (ahead - behind) / 2e-5, rtol=1e-6, atol=1e-6 * np.abs(hessian).max())

    def test_calls_in_pieces_are_the_same(self):
        some = self.rows()
        many = np.zeros(2 * rows.CALL + 3, int)
        theta = self.BANDS + 0.01 * np.arange(len(many))[:, None]
        pieces = rows.each(Surface(), theta, some, lambda each: each, many)
        alone = self.at(theta[-1], some)
        assert [len(piece.losses) for piece in pieces] == [rows.CALL, rows.CALL, 3]
        assert_allclose(pieces[-1].factors[-1], alone.factors[0], rtol=1e-12)


class TestLevenberg:
    """Rosenbrock's valley, as residuals (10 (y − x²), 1 − x), from several places at once."""

    def terms(self, theta, lanes):
        x, y = theta.T
        r = np.stack([10 * (y - x * x), 1 - x], axis=-1)
        J = np.stack([np.stack([-20 * x, np.full_like(x, 10)], -1), np.stack([-np.ones_like(x), 0 * x], -1)], -2)
        return levenberg.Terms((r * r).sum(-1) / 2, np.einsum("lri,lr->li", J, r), np.einsum("lri,lrj->lij", J, J))

    def test_all_lanes_arrive(self):
        starts = np.array([[-1.2, 1.0], [2.0, 2.0], [0.0, -1.0]])
        found = levenberg.minimise(
            self.terms, starts, np.tile(np.eye(2), (3, 1, 1)), np.full(3, 100), settled=1e-3, most=100
        )
        assert found.met.all()
        assert_allclose(found.theta, 1, atol=1e-6)

    def test_a_held_direction_stays(self):
        basis = np.diag([1.0, 0.0])[None]
        found = levenberg.minimise(self.terms, np.array([[0.5, 0.25]]), basis, np.full(1, 100), settled=1e-6, most=100)
        assert found.met[0] and found.theta[0, 1] == 0.25

    def test_too_few_steps_are_said(self):
        basis = np.eye(2)[None]
        assert not levenberg.minimise(
            self.terms, np.array([[-1.2, 1.0]]), basis, np.full(1, 100), settled=1e-3, most=3
        ).met[0]


class TestStudent:
    """Smith's G1 with the Student-t tail, for which there is no closed form."""

    W = np.random.default_rng(9).normal(size=(3, 40)) * np.array([[1.0], [1.0], [0.5]])

    def area(self, gamma):
        with solver.float64():
            return np.asarray(jax.vmap(student.sigma, (-1, None))(jnp.asarray(self.W), jnp.asarray(gamma)))

    def test_at_2_it_is_ggx(self):
        with solver.float64():
            expected = jax.vmap(slopes.sigma_ggx, (-1, None))(jnp.asarray(self.W), jnp.ones(2))
        # Below the horizon the area is what cancels in z + ‖(x, y, z)‖.
        assert_allclose(self.area(2.0), expected, rtol=1e-11, atol=1e-11)

    @pytest.mark.parametrize(
        ("gamma", "accuracy"), [(1.51, 1e-9), (1.7, 1e-9), (3.0, 1e-9), (10.0, 1e-9), (30.0, 1e-9)]
    )
    def test_it_is_the_partial_mean_of_students_t(self, gamma, accuracy):
        x, y, z = self.W
        spread = np.hypot(x, y) / np.sqrt(2)
        nu, c = 2 * gamma - 2, z / spread
        t = scipy.stats.t(nu)
        expected = spread * (c * t.cdf(c) + (nu + c * c) / (nu - 1) * t.pdf(c))
        assert_allclose(self.area(gamma), expected, rtol=accuracy, atol=accuracy * 0.1)

    def test_towards_infinity_it_is_beckmann(self):
        with solver.float64():
            expected = jax.vmap(slopes.sigma_beckmann, (-1, None))(jnp.asarray(self.W), jnp.ones(2))
        up = self.W[2] > 0
        assert_allclose(self.area(1e6)[up], np.asarray(expected)[up], rtol=0.015)

    @pytest.mark.parametrize("w", [(0.0, 0.0, 1.0), (1e-13, 0.0, 1.0), (0.6, 0.0, 0.8), (1.0, 0.0, 0.0)])
    def test_gradients_are_finite(self, w):
        with solver.float64():
            area, slope = jax.value_and_grad(student.sigma, (0, 1))(jnp.asarray(w), jnp.asarray(1.8))
            assert np.isfinite(area) and np.isfinite(slope[0]).all() and np.isfinite(slope[1])

    def test_the_derivative_by_gamma(self):
        step = 1e-5
        with solver.float64():
            w = jnp.asarray((0.6, 0.2, 0.4))
            ahead, behind = (float(student.sigma(w, jnp.asarray(1.8 + sign * step))) for sign in (1, -1))
            found = jax.grad(student.sigma, 1)(w, jnp.asarray(1.8))
        assert_allclose(found, (ahead - behind) / (2 * step), rtol=1e-8)


@pytest.mark.parametrize("masking_name", ["separable", "v_cavity"])
def test_other_masking(masking_name):
    wi, wo, wm = directions(fit_data.angles()[::11])
    with solver.float64():
        i, o, m = jnp.asarray(wi), jnp.asarray(wo), jnp.asarray(wm)
        surface = Surface(masking=masking_name)
        found = jax.vmap(models.g2, (None, -1, -1, -1, None), -1)(jnp.asarray(THETA), i, o, m, surface)
        A = models.shape_matrix(THETA)
        g1 = [jax.vmap(masking.g1_ellipsoid, (-1, -1, None))(jnp.asarray(w), jnp.asarray(wm), A) for w in (wi, wo)]
        cavity = jax.vmap(masking.g2_v_cavity, -1)(i, o, m)
    assert_allclose(found, g1[0] * g1[1] if masking_name == "separable" else cavity, rtol=SAME)


def test_a_conductor():
    wi, wo, wm = directions(fit_data.angles()[::11])
    with solver.float64():
        theta = jnp.asarray(np.array([*THETA[:6], np.log(0.2), np.log(3.0), -np.inf]))
        found = models.brdfs(theta, wi, wo, wm, Surface(fresnel="conductor"))
        without = models.brdfs(np.array([*THETA[:6], 60.0, -np.inf]), wi, wo, wm, Surface())  # F0 = 1: F = 1
        cosine = jnp.asarray((wi * wm).sum(axis=0))
        F = jax.vmap(fresnel.conductor, (0, None, None))(cosine, 0.2, 3.0)
    assert_allclose(found, without * np.asarray(F), rtol=SAME)
