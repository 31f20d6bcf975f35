"""Levelling takes off what it should and no more; the slopes of surfaces whose slopes are known are found."""

import fit_data
import numpy as np
import pytest
from numpy.testing import assert_allclose

from ggxref.errors import InputError
from ggxref.fit.data import Heights, Source
from ggxref.fit.fitting import fit
from ggxref.fit.slopes import central_slopes, from_heights, level

Y, X = np.meshgrid(np.arange(40) * 2.0, np.arange(50) * 1.0, indexing="ij")
ROUGH = fit_data.rough_surface(48)


def field(heights, pixel=(fit_data.PIXEL,) * 2):
    return Heights(heights, pixel, Source("surface", "test", ""))


@pytest.mark.parametrize("degree", [0, 1, 2, 4])
def test_levelling_removes_polynomials_of_its_degree(degree):
    shape = 3 + np.sum([(X / 50) ** (degree - k) * (Y / 80) ** k for k in range(degree + 1)], axis=0)
    assert_allclose(level(shape, degree), 0, atol=1e-12)


def test_levelling_leaves_higher_degrees():
    assert np.abs(level((X / 50) ** 2, 1)).max() > 0.05


def test_levelling_ignores_missing_heights():
    plane = 2 * X - Y
    plane[3:9, 4:20] = np.nan
    levelled = level(plane, 1)
    assert_allclose(levelled[np.isfinite(levelled)], 0, atol=1e-9)


def test_central_slopes_are_exact_on_a_parabola():
    slopes = central_slopes(X**2 + 3 * X * Y - Y**2, (1.0, 2.0))
    inner = slice(1, -1), slice(1, -1)
    assert_allclose(slopes[..., 0], (2 * X + 3 * Y)[inner], rtol=1e-12)
    assert_allclose(slopes[..., 1], (3 * X - 2 * Y)[inner], rtol=1e-12)


def test_a_missing_height_costs_its_four_neighbours():
    holes = ROUGH.copy()
    holes[20, 20] = np.nan
    assert from_heights(field(holes)).missing == 4
    assert from_heights(field(ROUGH)).missing == 0


@pytest.mark.parametrize(
    ("heights", "pixel", "said"),
    [
        (ROUGH[:20, :20], (1e-6, 1e-6), "400 heights; need at least 1000"),
        (np.where(np.arange(48) % 2, ROUGH, np.nan), (1e-6, 1e-6), "slopes between known heights"),
        (ROUGH, (1e-8, 1e-8), "check the unit of the heights and the pixel size"),
        (X * 1e-7, (1e-6, 1e-6), "flat along an axis"),
    ],
)
def test_surfaces_that_cannot_be_fitted(heights, pixel, said):
    with pytest.raises(InputError, match=said):
        from_heights(field(heights, pixel))


# A half ellipsoid's slopes have GGX's density, so that the whole way from heights to parameters has a known end. Central
# differences lose a strip of a pixel along the rim, where slopes have no bound: 1 % of the shadow, and as much of α.
RIM = 0.02
SIDE = 601


def test_a_half_ellipsoid_has_the_slopes_that_ggx_has():
    heights = fit_data.half_ellipsoid((5.0, 2.5), 0.4, (0.05, -0.1), SIDE)
    found = fit(field(heights), tail="ggx", degree=0).best
    assert found.model.name == "ellipsoid"
    assert_allclose([found.values["alpha_1"], found.values["alpha_2"]], [1 / 2.5, 1 / 5], rtol=RIM)
    # The rougher axis is the shorter one, a quarter turn from the first.
    assert_allclose(found.values["rotation"], 0.4 - np.pi / 2, atol=RIM)
    assert_allclose([found.values["mean_x"], found.values["mean_y"]], [0.05, -0.1], atol=RIM * 0.2)


def test_pixel_sizes_scale_their_own_axis():
    heights = fit_data.half_ellipsoid((4.0, 4.0), 0.0, (0.0, 0.0), SIDE)
    found = fit(field(heights, (fit_data.PIXEL, 2 * fit_data.PIXEL)), model="anisotropic", tail="ggx", degree=0).best
    assert_allclose([found.values["alpha_x"], found.values["alpha_y"]], [1 / 4, 1 / 8], rtol=RIM)
