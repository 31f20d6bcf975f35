"""Levelling takes off what it should and no more; the slopes of surfaces whose slopes are known are found."""

import fit_data
import numpy as np
import pytest
from numpy.testing import assert_allclose

from ggxref.errors import InputError
from ggxref.fit.data import Heights, Source
from ggxref.fit.fitting import fit
from ggxref.fit.slopes import ESTIMATORS, central_slopes, from_heights, level, smooth

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


@pytest.mark.parametrize("name", ESTIMATORS)
def test_estimators_are_exact_on_a_plane(name):
    slopes = ESTIMATORS[name][0](2 * X - 3 * Y, (1.0, 2.0))
    assert_allclose(slopes, np.broadcast_to([2.0, -3.0], slopes.shape), rtol=1e-12)


# What an estimator leaves of the slope of a wave along x whose phase turns by p, along y by q, from pixel to pixel.
LEFT = {
    "central": lambda p, q: np.sinc(p / np.pi),
    "cell": lambda p, q: np.sinc(p / 2 / np.pi) * np.cos(q / 2),
    "facet": lambda p, q: np.sinc(p / np.pi) * (1 + 2 * np.cos(q)) / 3,
}


@pytest.mark.parametrize("name", ESTIMATORS)
def test_estimators_damp_waves_as_they_should(name):
    p, q = 0.7, 0.4
    phase = p * np.arange(30) + q * np.arange(20)[:, None]
    found = ESTIMATORS[name][0](np.cos(phase), (1.0, 1.0))
    ends = slice(1, -1) if name != "cell" else slice(0, -1)
    middle = phase[ends, ends] + (0 if name != "cell" else (p + q) / 2)
    assert_allclose(found[..., 0], -p * LEFT[name](p, q) * np.sin(middle), atol=1e-12)
    assert_allclose(found[..., 1], -q * LEFT[name](q, p) * np.sin(middle), atol=1e-12)
    # Each has its own share, so that one taken for another would show.
    assert all(abs(LEFT[other](p, q) / LEFT[name](p, q) - 1) > 0.02 for other in ESTIMATORS if other != name)


@pytest.mark.parametrize(("length", "left"), [(1.0, 0.5), (2.0, 0.5**0.25), (0.5, 0.5**4)])
def test_smoothing_leaves_half_of_a_wave_of_the_cutoff(length, left):
    """ISO 16610-61: a wave of `length` cutoffs keeps 2^(-1/length²), along either axis and across missing heights."""
    pixel = (1.0, 2.0)
    x, y = np.arange(300) * pixel[0], np.arange(150)[:, None] * pixel[1]
    inner = slice(60, 90), slice(120, 180)
    for along in (x + 0 * y, y + 0 * x):
        wave = np.cos(2 * np.pi * along / (length * 30))
        # The kernel is cut at four standard deviations, which hold all but 6e-5 of it.
        assert_allclose(smooth(wave, pixel, 30.0)[inner], left * wave[inner], atol=2e-4)


def test_smoothing_does_not_fill_or_spread_holes():
    holes = np.full((40, 50), 3.0)
    holes[10:14, 20] = np.nan
    assert_allclose(smooth(holes, (1.0, 1.0), 8.0), holes)


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


@pytest.mark.parametrize("cutoff", [0.9e-6, 13e-6])
def test_cutoffs_that_are_no_smoothing_of_this_surface(cutoff):
    with pytest.raises(InputError, match=r"need more than a pixel, 1e-06 m, and at most a quarter .* 1.2e-05 m"):
        from_heights(field(ROUGH), cutoff=cutoff)


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


LENGTH, STEEP, WAVES = 9e-6, 0.2, 70
STEPS = 0.01
"""What is left over a finite surface of two waves' mean product, in α: measured worst 0.0024."""
WIDE = (fit_data.PIXEL, 1.5 * fit_data.PIXEL)


@pytest.fixture(scope="module")
def waves():
    """The sum of many waves of one length in all directions: its slopes are normal, of standard deviation STEEP along each axis."""
    # Even azimuths over half a turn: over this surface no two of them keep step.
    azimuth, phase = np.pi * np.arange(WAVES) / WAVES, np.random.default_rng(2).uniform(0, 2 * np.pi, WAVES)
    p, q = (
        2 * np.pi / LENGTH * size * axis for size, axis in zip(WIDE, (np.cos(azimuth), np.sin(azimuth)), strict=True)
    )
    # Each has half of its slope's square on average, along an axis half of that.
    height = STEEP * LENGTH / np.pi / np.sqrt(WAVES)
    side = np.arange(200)
    rows, columns = np.exp(1j * np.outer(side, q)), np.exp(1j * (np.outer(p, side) + phase[:, None]))
    return height * np.real(rows @ columns), p, q


@pytest.mark.parametrize(("estimator", "cutoff"), [("central", 0.0), ("cell", 0.0), ("facet", LENGTH)])
def test_waves_have_the_slopes_that_beckmann_has(waves, estimator, cutoff):
    """P22 is normal with α² twice the variance: of the surface as the filter and the estimator leave it."""
    heights, p, q = waves
    found = fit(field(heights, WIDE), model="anisotropic", tail="beckmann", slopes=estimator, smooth=cutoff).best
    filtered = 0.5 if cutoff else 1.0
    for name, along, across in (("alpha_x", p, q), ("alpha_y", q, p)):
        share = np.mean(LEFT[estimator](along, across) ** 2 * along**2) / np.mean(along**2)
        expected = np.sqrt(2 * share) * STEEP * filtered
        assert found.values[name] == pytest.approx(expected, rel=STEPS)
        # The surface as it is has another α: what the filter and the estimator take off is seen.
        assert abs(expected / (np.sqrt(2) * STEEP) - 1) > 3 * STEPS
