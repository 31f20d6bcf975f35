"""How sure a fit is, and what is said where it is not."""

import tracemalloc
from dataclasses import replace

import fit_data
import numpy as np
import pytest
from numpy.testing import assert_allclose

from ggxref.fit import bootstrap, fit, identification, parameters
from ggxref.fit.uncertainty import Curvature, curvature, spread

SURE = 4.0
"""Standard errors that a seeded estimate may be off: 6e-5 by chance where it is unbiased and its error right."""


class TestSpread:
    def space(self, size):
        return parameters.Space(np.zeros(size), np.eye(size))

    def test_least_squares_of_a_line(self):
        """For a straight line with independent noise the sandwich is the textbook's covariance."""
        random = np.random.default_rng(3)
        x = np.linspace(-1, 1, 4000)
        design = np.stack([np.ones_like(x), x], axis=1)
        y = design @ [0.2, 0.5] + 0.3 * random.normal(size=len(x))
        best = np.linalg.lstsq(design, y)[0]
        at = curvature(lambda theta: (y - design @ theta) ** 2 / 2, best, self.space(2))
        assert_allclose(at.hessian, design.T @ design, atol=1e-5 * len(x))
        expected = 0.3**2 * np.linalg.inv(design.T @ design)
        # 4000 squares of normals are sure to sqrt(2/4000), 2.2 %.
        assert_allclose(spread(at, self.space(2)).covariance, expected, atol=SURE * 0.022 * expected.max())

    def test_differences_are_derivatives(self):
        random = np.random.default_rng(4)
        place, matrix = random.normal(size=3), random.normal(size=(3, 3))
        at = curvature(lambda theta: np.exp(matrix @ theta), place, self.space(3))
        each = np.exp(matrix @ place)
        # Relative to the largest: STEP² is 1e-6, and the derivatives' own growth is of order 1.
        assert_allclose(at.scores, matrix * each[:, None], atol=1e-5 * np.abs(at.scores).max())
        assert_allclose(at.hessian, (matrix.T * each) @ matrix, atol=1e-5 * np.abs(at.hessian).max())

    def test_blocks_that_move_together_widen_it(self):
        scores = np.random.default_rng(4).normal(size=(500, 1))
        one = spread(Curvature(np.eye(1), scores), self.space(1)).covariance
        together = spread(Curvature(np.eye(1), 4 * scores), self.space(1)).covariance
        assert_allclose(together, 16 * one)

    def test_a_valley_is_no_point(self):
        flat = Curvature(np.diag([1.0, 0.0]), np.random.default_rng(5).normal(size=(50, 2)))
        assert spread(flat, self.space(2)).valley.tolist() == [0, 1]
        round = Curvature(np.diag([1.0, 0.5]), flat.scores)
        assert not spread(round, self.space(2)).valley.any()

    def test_a_gradient_left_over_shows(self):
        scores = np.random.default_rng(6).normal(size=(50, 1))
        assert spread(Curvature(np.eye(1) * 50, scores - scores.mean()), self.space(1)).newton < 1e-9
        assert spread(Curvature(np.eye(1) * 50, scores + 1), self.space(1)).newton > 1


@pytest.fixture(scope="module")
def sound():
    A = fit_data.shape(scatter=((0.09, 0.0), (0.0, 0.01)))
    return fit(fit_data.reflectance(fit_data.angles(), A), model="anisotropic", tail="ggx")


class TestWhatIsSaid:
    """One sentence for all parameters of which it is true."""

    def said(self, sound, **changes):
        return identification.warnings(replace(sound, fits=(replace(sound.best, **changes),)))

    def test_nothing_of_a_sound_fit(self, sound):
        assert self.said(sound) == []

    def test_bounds(self, sound):
        assert self.said(sound, at_bound=("f0 r", "diffuse", "f0 g")) == [
            "f0 r, f0 g ran to 0 or 1: held there, without a standard error",
            "diffuse ran to 0: held there, without a standard error",
        ]

    def test_ties(self, sound):
        correlation = np.eye(len(sound.problem.parameters))
        correlation[0, 6] = correlation[6, 7] = -0.97
        assert self.said(sound, correlation=correlation) == [
            "hard to tell apart, by their correlation: alpha_x and f0 (-0.970), f0 and diffuse (-0.970)"
        ]

    def test_a_misfit(self, sound):
        assert self.said(sound, log_rmse=2.0) == [
            "no model here fits: the values are off by a factor of 7.39, e to the log-RMSE"
        ]


def peak(ladder, replicates):
    """Bytes at the most, over those before."""
    tracemalloc.start()
    bootstrap.intervals(ladder, replicates)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return most


class TestBootstrap:
    """Its agreement with the sandwich is in test_fit_recovery."""

    def test_replicates_are_the_same_in_pieces(self, sound, monkeypatch):
        whole = bootstrap.intervals(sound, 20)
        monkeypatch.setattr(bootstrap, "AT_ONCE", 3 * sound.problem.size)
        for name, ends in bootstrap.intervals(sound, 20).items():
            assert_allclose(ends, whole[name], rtol=1e-9, atol=1e-12)

    def test_memory_does_not_grow_with_the_replicates(self, sound, monkeypatch):
        bootstrap.intervals(sound, 2)  # compiled
        monkeypatch.setattr(bootstrap, "AT_ONCE", 4 * sound.problem.size)
        few, many = peak(sound, 8), peak(sound, 64)
        # What 56 more results take, against the rows of 56 more replicates.
        assert many - few < 56 * sound.problem.size * 8

    def test_side_by_side_memory_would_grow(self, sound):
        few, many = peak(sound, 8), peak(sound, 64)
        assert many - few > 56 * sound.problem.size * 8
