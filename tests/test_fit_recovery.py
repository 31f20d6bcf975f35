"""Fits of synthetic measurements find the parameters that made them, know how sure they are, and choose that model."""

from dataclasses import replace
from typing import cast

import fit_data
import numpy as np
import pytest
from numpy.testing import assert_allclose

from ggxref.errors import InputError
from ggxref.fit import bootstrap, models, parameters, residual_map, selection, solver, sphere
from ggxref.fit.data import Heights, Reflectance, Source
from ggxref.fit.fitting import fit, fit_models
from ggxref.fit.models import Surface
from ggxref.fit.problem import from_reflectance, from_slopes
from ggxref.fit.slopes import TILES, Slopes

SURE = 4.0
"""Standard errors that a seeded estimate may be off: 6e-5 by chance where it is unbiased and its error right."""

MEAN, SCATTER = {
    "isotropic": (0.0, 0.0), "anisotropic": (0.0, 0.0), "rotated": (0.0, 0.0), "ellipsoid": (0.06, -0.04),
}, {
    "isotropic": [[0.04, 0], [0, 0.04]], "anisotropic": [[0.09, 0], [0, 0.01]],
    "rotated": [[0.06, 0.03], [0.03, 0.05]], "ellipsoid": [[0.06, 0.03], [0.03, 0.05]],
}  # fmt: skip


def truth(model):
    C = np.linalg.cholesky(SCATTER[model])
    return {
        "alpha_x": C[0, 0],
        "alpha_y": C[1, 1],
        "shear": C[1, 0],
        "mean_x": MEAN[model][0],
        "mean_y": MEAN[model][1],
    }


def reflectance(model, degrees):
    return fit_data.reflectance(degrees, fit_data.shape(MEAN[model], SCATTER[model]))


def slopes(model, count=8192, seed=1, gamma=2.0):
    """Independent slopes: a normal over the root of a gamma variable is Student-t; of an exponential one, GGX."""
    random = np.random.default_rng(seed)
    normal = random.normal(size=(count, 2)) @ np.linalg.cholesky(SCATTER[model]).T / np.sqrt(2)
    heavy = normal / np.sqrt(random.gamma(gamma - 1, 1 / (gamma - 1), size=(count, 1)))
    return Slopes(heavy + MEAN[model], np.arange(count) % TILES**2, 0)


GGX = parameters.ladder(parameters.SHAPES, ["ggx"])


def assert_recovers(found, expected):
    for name, value in expected.items():
        error = found.errors[name]
        assert abs(found.values[name] - value) <= SURE * error + 1e-9, (
            f"{name}: {found.values[name]} ± {error}, not {value}"
        )


@pytest.fixture(scope="module", params=SCATTER)
def model(request):
    return request.param


@pytest.fixture(scope="module")
def ladder(model):
    return fit(reflectance(model, fit_data.angles()), tail="ggx")


class TestReflectance:
    def test_recovery(self, ladder, model):
        found = next(fit for fit in ladder.fits if fit.model.name == model)
        assert not found.trouble
        assert_recovers(found, truth(model) | {"f0": 0.6, "diffuse": 0.1})

    def test_the_noise_is_what_is_left(self, ladder, model):
        found = next(fit for fit in ladder.fits if fit.model.name == model)
        # 960 samples: the root mean square of a normal is sure to 1/sqrt(2 n), 2.3 %.
        assert found.log_rmse == pytest.approx(0.1, rel=SURE * 0.023)

    def test_the_model_that_made_it_is_chosen(self, ladder, model):
        assert ladder.chosen == model

    def test_the_bootstrap_agrees_with_the_standard_errors(self, ladder):
        """Forty draws: their standard deviation is sure to 1/sqrt(80), 11 %, and a draw of blocks is a coarser measure than that."""
        fit = ladder.best
        found = bootstrap.intervals(ladder, 40)
        free = [n for n, moved in zip(ladder.problem.parameters, fit.space.moved, strict=True) if moved]
        for name in free:
            low, high = found[name]
            assert low < fit.values[name] < high
            assert 0.4 < (high - low) / np.subtract(*fit.intervals[name][::-1]) < 1.6
        assert all(low == high for name, (low, high) in found.items() if fit.errors[name] == 0)

    def test_the_residual_map_keeps_the_sign(self, ladder):
        left = residual_map.residuals(ladder, ladder.best)
        wi, wo, wm, measured, noise = ladder.problem.samples
        # A tenth of relative noise, less where the floor is most of a sample.
        expected = 0.1 / np.log(10) * measured * wo[2] / (measured * wo[2] + noise)
        assert left.std() == pytest.approx(np.sqrt(np.mean(expected**2)), rel=SURE * 0.023)
        darker = replace(ladder, problem=replace(ladder.problem, samples=(wi, wo, wm, measured / 10, noise / 1e6)))
        # What was fitted is ten times what was measured.
        assert np.median(residual_map.residuals(darker, ladder.best)) == pytest.approx(1, abs=0.02)

    def test_a_lit_sphere_is_drawn(self, ladder):
        assert sphere.unseen(ladder) == ""
        assert len(sphere.draw(ladder).axes) == 4  # three panels and a colour bar

    def test_starts_agree(self, ladder):
        assert all(fit.agreeing[0] >= 2 for fit in ladder.fits)


@pytest.fixture(scope="module")
def fits(model):
    return fit_models(from_slopes(slopes(model)), GGX, {})


def log_loss(found, points):
    """Mean -log density of slopes under a fit."""
    with solver.float64():
        return -np.mean(np.log(models.slope_densities(found.theta, points.T, found.tail)))


class TestSlopes:
    def test_recovery(self, fits, model):
        found = fits[list(SCATTER).index(model)]
        assert not found.trouble
        assert found.agreeing == (2, 2)
        assert_recovers(found, truth(model))

    def test_the_model_that_made_it_is_chosen(self, fits, model):
        assert selection.choose([f.model.name for f in fits], np.stack([f.held_out for f in fits])) == model

    def test_the_fold_left_out_is_as_if_fitted_without(self, fits, model):
        """The one Newton step of `held_out` against a fit of the other folds."""
        surface = slopes(model)
        problem = from_slopes(surface)
        others = problem.fold != 3
        kept = surface.slopes[others]
        again = Slopes(kept, np.arange(len(kept)) % TILES**2, 0)
        refitted = fit_models(from_slopes(again), [GGX[list(SCATTER).index(model)]], {})[0]
        left_out, found = surface.slopes[~others], fits[list(SCATTER).index(model)]
        expected, whole = log_loss(refitted, left_out), log_loss(found, left_out)
        # Second order in the fold's pull, which is a few percent of θ: a twentieth of what leaving the fold out changes.
        assert abs(found.held_out[3] - expected) < 0.05 * abs(expected - whole)


class TestPlane:
    """Directions in the plane of incidence see αx and the mean slope along x, and nothing across."""

    def test_recovery(self):
        data = reflectance("isotropic", fit_data.plane_angles())
        ladder = fit(data, tail="ggx")
        assert [fit.model.name for fit in ladder.fits] == ["isotropic", "ellipsoid"]
        assert ladder.chosen == "isotropic"
        assert "one plane" in sphere.unseen(ladder)
        assert_recovers(ladder.best, truth("isotropic") | {"f0": 0.6, "diffuse": 0.1})

    def test_a_turned_plane_is_the_same_fit(self):
        data = reflectance("isotropic", fit_data.plane_angles())
        cosine, sine = np.cos(0.7), np.sin(0.7)
        turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
        turned = Reflectance(
            data.wi @ turn, data.wo @ turn, data.values, data.weights, data.mask, data.bands, data.source
        )
        options = cast(dict, {"min_cosine": 0.05, "most": 4096})
        problem, expected = from_reflectance(turned, Surface(), **options), from_reflectance(data, Surface(), **options)
        assert_allclose(problem.samples[0], expected.samples[0], atol=1e-12)
        assert any("azimuth 40.11°" in note for note in problem.notes)

    def test_what_it_cannot_see_is_refused(self):
        with pytest.raises(InputError, match="cannot tell it from a smaller one; need isotropic or ellipsoid"):
            fit(reflectance("isotropic", fit_data.plane_angles()), model="anisotropic")


class TestFixed:
    def test_a_held_parameter_stays(self):
        found = fit(
            reflectance("isotropic", fit_data.angles()), model="isotropic", fixed={"alpha": 0.2, "f0": 0.6}
        ).best
        assert found.values["alpha_x"] == pytest.approx(0.2, rel=1e-12) and found.errors["alpha_x"] == 0
        assert_recovers(found, {"diffuse": 0.1})

    @pytest.mark.parametrize(
        ("model", "fixed", "said"),
        [
            ("isotropic", {"alpha_x": 0.1, "alpha_y": 0.2}, "cannot hold these values of alpha_x, alpha_y"),
            ("anisotropic", {"shear": 0.1}, "cannot hold these values of shear"),
            ("auto", {"roughness": 0.1}, "no parameter 'roughness' to fix"),
            ("auto", {"alpha": 0.0}, "alpha_x = 0; need a positive number"),
            ("ggx", {}, "model 'ggx'; need auto or one of isotropic"),
            ("isotropic", {"gamma": 1.2}, "gamma = 1.2; need a number above 1.5"),
        ],
    )
    def test_what_cannot_be_held(self, model, fixed, said):
        with pytest.raises(InputError, match=said):
            fit(reflectance("isotropic", fit_data.angles()), model=model, fixed=fixed)


class TestTrouble:
    def test_a_diffuse_surface_does_not_tell_alpha(self):
        """All of f is the diffuse term: the lobe's own parameters are a valley, and that is said."""
        data = reflectance("isotropic", fit_data.angles())
        flat = Reflectance(
            data.wi, data.wo, np.full_like(data.values, 0.1), data.weights, data.mask, data.bands, data.source
        )
        assert fit(flat, model="anisotropic", tail="ggx").best.trouble

    def test_too_few_samples(self):
        data = reflectance("isotropic", fit_data.angles()[:20])
        with pytest.raises(InputError, match="need at least 32"):
            fit(data)

    @pytest.mark.parametrize(
        ("option", "value"), [("min_cosine", 1.0), ("min_cosine", -0.1), ("degree", -1), ("degree", 9)]
    )
    def test_options_out_of_range(self, option, value):
        heights = Heights(fit_data.rough_surface(), (1e-6, 1e-6), Source("surface", "test", ""))
        with pytest.raises(InputError, match="need"):
            fit(heights, **{option: value})

    @pytest.mark.parametrize("option", ["tail", "masking", "fresnel"])
    def test_unknown_names(self, option):
        with pytest.raises(InputError, match=f"{option} 'none'; need"):
            fit(reflectance("isotropic", fit_data.angles()), **cast(dict, {option: "none"}))


class TestTails:
    @pytest.mark.parametrize(("gamma", "name"), [(2.0, "rotated"), (3.5, "rotated student_t")])
    def test_the_tail_is_found(self, gamma, name):
        ladder = parameters.ladder({"rotated": parameters.SHAPES["rotated"]}, ["ggx", "student_t"])
        fits = fit_models(from_slopes(slopes("rotated", gamma=gamma)), ladder, {})
        assert_recovers(fits[1], truth("rotated") | {"gamma": gamma})
        assert selection.choose([f.model.name for f in fits], np.stack([f.held_out for f in fits])) == name

    def test_beckmann_is_found(self):
        ladder = parameters.ladder({"rotated": parameters.SHAPES["rotated"]}, ["ggx", "beckmann"])
        fits = fit_models(from_slopes(slopes("rotated", gamma=1e9)), ladder, {})
        assert_recovers(fits[1], truth("rotated"))
        assert (
            selection.choose([f.model.name for f in fits], np.stack([f.held_out for f in fits])) == "rotated beckmann"
        )

    def test_the_free_tail_holds_ggx(self):
        """One formula serves both: at γ = 2 it is the other, digit for digit or nearly."""
        problem = from_slopes(slopes("anisotropic"))
        alone = fit_models(problem, GGX[1:2], {})[0]
        ladder = parameters.ladder({"anisotropic": parameters.SHAPES["anisotropic"]}, ["ggx", "student_t"])
        assert fit_models(problem, ladder, {})[0].loss == pytest.approx(alone.loss, rel=1e-12)


class TestChoose:
    def test_folds_that_agree_by_chance_are_not_sure(self):
        """Two folds show the same excess; the blocks within them tell how sure that is."""
        folds = np.array([[1.1, 1.1], [1.0, 1.0]])
        blocks = np.array([[1.6, 0.6, 1.5, 0.7], [1.0, 1.0, 1.0, 1.0]])
        assert selection.choose(["small", "large"], folds) == "large"
        assert selection.choose(["small", "large"], folds, blocks=blocks) == "small"

    def test_the_smallest_within_one_standard_error(self):
        best = np.array([1.0, 2.0, 3.0, 4.0])
        near, far = best + np.array([0.2, -0.1, 0.1, -0.1]), best + 0.1
        assert selection.choose(["small", "large"], np.stack([near, best])) == "small"
        # Folds that all say the same are sure, however much they differ from one another.
        assert selection.choose(["small", "large"], np.stack([far, best])) == "large"
