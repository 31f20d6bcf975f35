"""The probabilities are those of scipy, the correction holds the family's error, and a small bias is found."""

import numpy as np
import pytest
from scipy import stats

from ggxref.verify import statistics


def uniform(*shape, seed=3):
    return np.random.default_rng(seed).random(shape)


def test_kolmogorov_smirnov_is_scipys():
    v = uniform(20000) ** 1.01
    expected = stats.kstest(v, "uniform", method="asymp").pvalue
    assert statistics.kolmogorov_smirnov(v) == pytest.approx(expected, rel=1e-10)


def test_chi_square_is_scipys():
    v = uniform(20000, 2)
    counts = np.histogram2d(*v.T, bins=statistics.CELLS, range=[[0, 1]] * 2)[0].ravel()
    assert statistics.chi_square(v) == pytest.approx(stats.chisquare(counts).pvalue, rel=1e-10)


def test_two_samples_are_scipys():
    a, b = uniform(9000), uniform(7000, seed=4) ** 1.05
    expected = stats.ks_2samp(a, b, method="asymp").pvalue
    got = 10 ** -statistics.same_law([np.stack([a, a], -1)], [np.stack([b, b], -1)]) / 2
    assert got == pytest.approx(expected, rel=0.05)  # scipy corrects the asymptotic law for finite samples


def test_false_alarms_are_as_rare_as_stated():
    """Of 400 families of uniform points, about 400 · 10^-1 exceed 1: three standard errors are 18."""
    levels = [statistics.uniform_square(uniform(3, 2000, 2, seed=s)) for s in range(400)]
    assert np.sum(np.array(levels) > 1) < 40 + 18
    assert max(levels) < 4


def test_one_percent_of_bias_is_found():
    v = uniform(1, 1 << 16, 2)
    assert statistics.uniform_square(v) < 3
    v[..., 1] **= 1.03
    assert statistics.uniform_square(v) > statistics.FALSE_ALARM


def test_correlation_with_uniform_marginals_is_found():
    v = uniform(1, 1 << 16, 2)
    v[..., 1] = (v[..., 1] * 0.5 + v[..., 0]) % 1
    assert statistics.uniform_square(v) > statistics.FALSE_ALARM


def test_points_off_the_square_and_nan_are_impossible():
    v = uniform(1, 100, 2)
    v[0, 3, 1] = 1.01
    assert statistics.uniform_square(v) == np.inf
    v[0, 3, 1] = np.nan
    assert statistics.uniform_square(v) == np.inf


def test_mean_off_by_five_standard_errors_is_found():
    x = np.random.default_rng(5).normal(size=(1, 10000))
    assert statistics.unlikely_mean(x, np.array([0.0])) < 3
    assert statistics.unlikely_mean(x, np.array([0.09])) > statistics.FALSE_ALARM
    assert statistics.unlikely_mean(np.ones((1, 100)), np.array([1.0])) == 0
    assert statistics.unlikely_mean(np.ones((1, 100)), np.array([1.001])) > statistics.FALSE_ALARM
