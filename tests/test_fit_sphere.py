"""A measurement interpolated over a sphere is the BRDF that was measured, where it was measured."""

import fit_data
import numpy as np
import pytest

from ggxref.fit import sphere
from ggxref.fit.data import Reflectance, Source

A = fit_data.shape()
NOISE = 1e-6
"""Far below all values, so that nothing is floored."""


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(sphere, "SIDE", 80)


def measurement(zeniths):
    """Half vectors spread about the normal as in an RGL file, seen from these incident zeniths at azimuth 180°; matte and glossy."""
    root, azimuth = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 0.95, 40), np.linspace(-np.pi, np.pi, 48)))
    wm = fit_data.direction(root**2 * np.pi / 2, azimuth)
    wi = np.repeat(fit_data.direction(np.radians(zeniths), np.pi), len(wm), axis=0)
    wm = np.tile(wm, (len(zeniths), 1))
    wo = 2 * np.sum(wi * wm, axis=1, keepdims=True) * wm - wi
    above = wo[:, 2] > 0.02
    wi, wo = wi[above], wo[above]
    one = np.ones(len(wi))
    return Reflectance(wi, wo, truth(wi.T, wo.T)[:, None], one, one > 0, ("brdf",), Source("synthetic", "test", ""))


def truth(wi, wo):
    angles = [
        np.degrees(angle) for w in (wi, wo) for angle in (np.arccos(np.clip(w[2], -1, 1)), np.arctan2(w[1], w[0]))
    ]
    return fit_data.brdf(np.stack(angles, axis=1), A, 0.6, 0.1)


ZENITHS = np.linspace(0, 75, 8)


def off(data):
    """Where the sphere was measured, and there the logarithm of interpolated over true."""
    _, wi, wo = sphere.geometry(data)
    found = sphere.interpolated(data, wi, wo, NOISE)[0]
    known = np.isfinite(found)
    return wi[2], known, np.log(found[known] / truth(wi[:, known], wo[:, known]))


def test_between_the_measured_directions():
    cosine, known, error = off(measurement(ZENITHS))
    assert known.mean() > 0.6
    # A tenth of the incident range apart, f cosθo is nearly linear in its logarithm but at grazing angles.
    assert np.quantile(np.abs(error), 0.9) < 0.05
    assert not known[cosine < np.cos(np.radians(75.01))].any()


def test_the_highlight_is_where_it_should_be():
    """Turned by a right angle about the normal, the same values must miss: half vectors would be taken for others."""
    data = measurement(ZENITHS)
    turned = data.wo.copy()
    turned[:, 0], turned[:, 1] = -data.wo[:, 1], data.wo[:, 0]
    wrong = Reflectance(data.wi, turned, data.values, data.weights, data.mask, data.bands, data.source)
    assert np.quantile(np.abs(off(wrong)[2]), 0.9) > 0.5


def test_the_pixels_are_of_a_sphere():
    lit, wi, wo = sphere.geometry(measurement(ZENITHS))
    assert lit.sum() == wi.shape[1] and np.allclose(np.linalg.norm([wi, wo], axis=1), 1)
    # The light stays at 45° from the eye, whatever the pixel.
    assert np.allclose((wi * wo).sum(axis=0), sphere.LIGHT[2])
