"""What the solver is given, and what it does with it: rows of samples, the compiled call's derivatives, Levenberg–Marquardt."""

import fit_data
import numpy as np
from numpy.testing import assert_allclose

from ggxref.fit import kernel, levenberg, models, parameters, rows, solver
from ggxref.fit.models import Surface

THETA = np.array([np.log(0.3), np.log(0.15), 0.05, 0.1, -0.06, parameters.GGX, np.log(0.2 / 0.8), np.log(0.1)])
"""Anisotropic, sheared and skewed: each term of every formula counts."""


class TestRows:
    """The compiled call's losses and derivatives against the plain formula's, for two bands."""

    DEGREES = fit_data.angles()[::7]
    MEASURED = np.abs(np.random.default_rng(0).normal(1, 0.5, size=(2, len(DEGREES))))
    BANDS = np.r_[THETA[:6], THETA[6], THETA[6] + 1, THETA[7], THETA[7] - 1]

    def rows(self):
        count = len(self.DEGREES)
        index = np.pad(np.arange(count), (0, rows.ROW - count), constant_values=-1)[None]
        samples = np.concatenate(
            [*fit_data.directions(self.DEGREES), np.full((2, count), [[0.01], [1.5]]), self.MEASURED]
        )
        padded = np.where(index >= 0, samples[:, index], 1.0).swapaxes(0, 1)
        padded[:, kernel.WEIGHT] *= index >= 0
        return rows.Rows(padded, index, np.zeros(1, int))

    def loss(self, theta):
        """Σ weights · mean over bands of √(1 + r²) − 1."""
        wi, wo, wm = fit_data.directions(self.DEGREES)
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
        wi, wo, wm = fit_data.directions(self.DEGREES)
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

    def test_sums_that_overflow_are_no_warning(self, monkeypatch):
        """Rows of +inf and -inf, whose sum is no number: the solver refuses it, and warnings are errors here."""
        count = rows.CALL + 1

        def huge(_, theta, samples, size):
            sign = np.where(np.arange(size) % 2, -1.0, 1.0)[:, None, None, None]
            factors = np.tile(np.array([[1e200]] * 8 + [[1e200]]), (size, 2, 1, rows.ROW))
            factors[:, :, -1:] *= sign
            return kernel.Each(samples[:size, kernel.WEIGHT], np.full((size, 2, rows.ROW), 1e306), factors)

        monkeypatch.setattr(kernel, "call", huge)
        some = self.rows()
        lanes = rows.Lanes(Surface(), some, [np.zeros(count, int)], [np.full((count, rows.ROW), 1.5)])
        found = lanes.terms(self.BANDS[None], np.zeros(1, int))
        assert not np.isfinite(found.loss).any() and np.isnan(found.gradient).any() and np.isinf(found.hessian).any()


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

    def test_the_lower_of_two_starts_is_taken(self):
        """Each lane by itself: with no step to go it stays where it began."""
        near, far = np.array([1.0, 1.1]), np.array([-3.0, 2.0])
        found = levenberg.minimise(
            self.terms, np.stack([near, far]), np.tile(np.eye(2), (2, 1, 1)), np.full(2, 100), settled=0.0, most=0,
            instead=np.stack([far, near]),
        )  # fmt: skip
        assert_allclose(found.theta, [near, near])
        assert_allclose(found.loss, self.terms(near[None], None).loss[0])

    def test_too_few_steps_are_said(self):
        basis = np.eye(2)[None]
        assert not levenberg.minimise(
            self.terms, np.array([[-1.2, 1.0]]), basis, np.full(1, 100), settled=1e-3, most=3
        ).met[0]
