"""The deviation of two noisy pictures: unbiased, with an error that covers, blind to noise that both share."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from ggxref.scene.compare import deviation

PIXELS, BATCHES = 400, 8


def noisy(true, noise, trials, seed=0):
    rng = np.random.default_rng(seed)
    return [deviation(true + noise * rng.standard_normal((BATCHES, PIXELS)), 1.0) for _ in range(trials)]


def test_noise_is_not_taken_for_deviation():
    """Truth 0 under noise 0.1 a batch: the plain root mean square would say 0.035 every time.

    Over 400 pixels the squared difference scatters by √(2/400 · 8/7) = 7.6 % of 0.035², so that the bound is √(0.076 (z + 2))
    of 0.035 at z errors above 0: 0.8 of it at z = 6, with room for an error that is known to 27 %.
    """
    plain = 0.1 / np.sqrt(BATCHES)
    found = noisy(0.0, 0.1, 50)
    assert np.mean([each.value for each in found]) < plain / 4
    assert np.mean([each.most < 0.8 * plain for each in found]) > 0.95


def test_deviation_is_found_under_noise():
    """Truth 0.05 under the same noise: within 2 errors in 90 % of trials or more (95 % are expected of a normal law)."""
    found = noisy(0.05, 0.1, 200)
    assert_allclose(np.sqrt(np.mean([each.value**2 for each in found])), 0.05, rtol=0.02)
    assert np.mean([each.least < 0.05 < each.most for each in found]) > 0.9
    # It can tell 0.05 from 0.06, or a covering error would be a wide one.
    assert np.mean([each.most < 0.06 for each in found]) > 0.9


def test_equal_pictures_are_equal():
    found = deviation(np.zeros((BATCHES, PIXELS)), 1.0)
    assert (found.value, found.error) == (0.0, 0.0)


def test_what_overflows_is_beyond_any_tolerance():
    differences = np.zeros((BATCHES, PIXELS))
    differences[1, 2] = np.nan
    assert deviation(differences, 1.0).most == np.inf


def test_one_batch_has_no_error():
    with pytest.raises(ValueError, match="two"):
        deviation(np.zeros((1, PIXELS)), 1.0)
