"""The models in the solver's terms are the library's; their spaces move what they say and nothing else."""

import itertools

import fit_data
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose

from ggxref import geometry, masking, slopes
from ggxref.errors import InputError
from ggxref.fit import models, objectives, solver

NAMES = models.names(("brdf",))
THETA = np.array([np.log(0.3), np.log(0.15), 0.05, 0.1, -0.06, np.log(0.2 / 0.8), np.log(0.1)])
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
        found = models.brdfs(THETA, *directions(degrees))
    assert_allclose(found[0], fit_data.brdf(degrees, A, 0.2, 0.1), rtol=SAME)


def test_g1_is_the_librarys():
    wi, _, wm = directions(fit_data.angles())
    with solver.float64():
        A = models.shape_matrix(THETA)
        expected = jax.vmap(masking.g1_ellipsoid, (-1, -1, None))(jnp.asarray(wi), jnp.asarray(wm), A)
        found = jax.vmap(models.g1, (None, -1))(jnp.asarray(THETA), jnp.asarray(wi))
    assert_allclose(found, expected, rtol=SAME)


def test_slope_density_is_the_librarys():
    points = np.random.default_rng(2).normal(scale=0.3, size=(2, 50))
    with solver.float64():
        expected = jax.vmap(slopes.ellipsoid, (-1, None))(jnp.asarray(points), models.shape_matrix(THETA))
        found = models.slope_densities(THETA, points)
    assert_allclose(found, expected, rtol=SAME)


@pytest.mark.parametrize("model", models.MODELS)
def test_a_space_moves_its_parameters_alone(model):
    space = models.space(models.MODELS[model], NAMES, {}, 0.1)
    moved = {name for group in models.MODELS[model] for name in group} | {"f0", "diffuse"}
    assert [name for name, yes in zip(NAMES, space.moved, strict=True) if yes] == [n for n in NAMES if n in moved]
    assert space.size == len(models.MODELS[model]) + 2
    theta = space.held + space.basis @ np.arange(1.0, 8.0)
    assert_allclose(space.held + space.basis @ np.pad(space.coordinates(theta), (0, 0)), theta, atol=1e-12)


def test_models_are_nested():
    bases = [models.space(groups, NAMES, {}, 1.0).basis for groups in models.MODELS.values()]
    for small, large in itertools.pairwise(bases):
        assert np.linalg.matrix_rank(np.hstack([small, large])) == np.linalg.matrix_rank(large)


def test_fixed_parameters_are_held():
    space = models.space(models.MODELS["ellipsoid"], NAMES, {"alpha_y": -2.0, "diffuse": -np.inf}, 0.1)
    assert not space.moved[1] and not space.moved[6] and space.moved[0]
    assert space.held[1] == -2 and space.held[6] == -np.inf
    assert models.space(models.MODELS["isotropic"], NAMES, {"alpha_y": -2.0}, 0.1).held[:2].tolist() == [-2, -2]


def test_no_diffuse_term_is_no_nan():
    theta = THETA.copy()
    theta[6] = -np.inf
    with solver.float64():
        values = models.brdfs(theta, *directions(fit_data.angles()))
        A = np.asarray(models.shape_matrix(theta))
    assert_allclose(values[0], fit_data.brdf(fit_data.angles(), A, 0.2, 0.0), rtol=SAME)


@pytest.mark.parametrize(
    ("name", "value"),
    [("alpha_x", 0.0), ("alpha_y", -0.1), ("alpha_x", np.nan), ("alpha_x", np.inf), ("f0", 1.0), ("f0", 0.0),
     ("diffuse", -0.1), ("diffuse", 1.5), ("mean_x", np.inf), ("shear", np.nan)],
)  # fmt: skip
def test_values_without_a_meaning_are_refused(name, value):
    with pytest.raises(InputError, match=f"{name} = .*; need"):
        models.from_user(name, value)


@pytest.mark.parametrize("name", NAMES)
def test_user_values_come_back(name):
    k = NAMES.index(name)
    theta = THETA.copy()
    theta[k] = models.from_user(name, 0.37)
    assert models.to_user(theta, NAMES)[k] == pytest.approx(0.37, rel=1e-14)


def test_principal_axes():
    values = dict(zip((*NAMES, *models.DERIVED), models.to_user(THETA, NAMES), strict=True))
    C = np.array([[0.3, 0], [0.05, 0.15]])
    roots, vectors = np.linalg.eigh(C @ C.T)
    assert_allclose([values["alpha_2"], values["alpha_1"]], np.sqrt(roots), rtol=1e-12)
    axis = vectors[:, 1] * np.sign(vectors[0, 1])
    assert_allclose(values["rotation"], np.arctan2(axis[1], axis[0]), rtol=1e-12)


def test_half_the_squared_residual_is_the_loss():
    degrees = fit_data.angles()[::7]
    measured = np.abs(np.random.default_rng(0).normal(1, 0.5, size=(2, len(degrees))))
    theta = jnp.asarray(np.r_[THETA[:5], THETA[5], THETA[5], THETA[6], THETA[6]])
    samples = (*directions(degrees), measured, np.full(len(degrees), 0.01))
    with solver.float64():
        samples = tuple(jnp.asarray(array) for array in samples)
        residuals = jax.vmap(objectives.robust_residual, (None, -1), -1)(theta, samples)
        losses = jax.vmap(objectives.robust_loss, (None, -1))(theta, samples)
    assert_allclose(np.sum(np.asarray(residuals) ** 2, axis=0) / 2, losses, rtol=1e-5)
