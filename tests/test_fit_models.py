"""The models in the solver's terms are the library's; their spaces move what they say and nothing else."""

import itertools

import fit_data
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.stats
from numpy.testing import assert_allclose

from ggxref import fresnel, masking, slopes
from ggxref.errors import InputError
from ggxref.fit import models, parameters, solver, student
from ggxref.fit.models import Surface

NAMES = parameters.names(("brdf",))
THETA = np.array([np.log(0.3), np.log(0.15), 0.05, 0.1, -0.06, parameters.GGX, np.log(0.2 / 0.8), np.log(0.1)])
"""Anisotropic, sheared and skewed: each term of every formula counts."""
SAME = 1e-12
"""The same algebra in another order, 20 operations deep, over directions no nearer to the horizon than 10 degrees."""


def test_brdf_is_the_librarys():
    degrees = fit_data.angles()
    with solver.float64():
        A = np.asarray(models.shape_matrix(THETA))
        found = models.brdfs(THETA, *fit_data.directions(degrees), Surface())
    assert_allclose(found[0], fit_data.brdf(degrees, A, 0.2, 0.1), rtol=SAME)


def test_g1_is_the_librarys():
    wi, _, wm = fit_data.directions(fit_data.angles())
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
    wi, _, _ = fit_data.directions(fit_data.angles()[::7])
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
        values = models.brdfs(theta, *fit_data.directions(fit_data.angles()), Surface())
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
    wi, wo, wm = fit_data.directions(fit_data.angles()[::11])
    with solver.float64():
        i, o, m = jnp.asarray(wi), jnp.asarray(wo), jnp.asarray(wm)
        surface = Surface(masking=masking_name)
        found = jax.vmap(models.g2, (None, -1, -1, -1, None), -1)(jnp.asarray(THETA), i, o, m, surface)
        A = models.shape_matrix(THETA)
        g1 = [jax.vmap(masking.g1_ellipsoid, (-1, -1, None))(jnp.asarray(w), jnp.asarray(wm), A) for w in (wi, wo)]
        cavity = jax.vmap(masking.g2_v_cavity, -1)(i, o, m)
    assert_allclose(found, g1[0] * g1[1] if masking_name == "separable" else cavity, rtol=SAME)


def test_a_conductor():
    wi, wo, wm = fit_data.directions(fit_data.angles()[::11])
    with solver.float64():
        theta = jnp.asarray(np.array([*THETA[:6], np.log(0.2), np.log(3.0), -np.inf]))
        found = models.brdfs(theta, wi, wo, wm, Surface(fresnel="conductor"))
        without = models.brdfs(np.array([*THETA[:6], 60.0, -np.inf]), wi, wo, wm, Surface())  # F0 = 1: F = 1
        cosine = jnp.asarray((wi * wm).sum(axis=0))
        F = jax.vmap(fresnel.conductor, (0, None, None))(cosine, 0.2, 3.0)
    assert_allclose(found, without * np.asarray(F), rtol=SAME)
