"""From a height field to samples of its slope density P22: level the surface, smooth it if asked to, then take differences."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ggxref.errors import InputError
from ggxref.fit.data import Heights

FEWEST = 1000
"""Slopes below which neither a tail nor a standard error over tiles means anything."""
STEEPEST = 10.0
"""A median slope beyond this, 84°, is no microsurface: the unit of the heights or of the pixel is wrong."""
FLATTEST = 1e-9
"""Slopes that all lie within this are the rounding of a plane; the smoothest mirrors have 1e-5."""
TILES = 8
"""Tiles a side: the surface is cut in TILES², and neighbouring slopes stand or fall together."""


@dataclass(frozen=True)
class Slopes:
    """Samples of the slope density. `slopes`: (n, 2), (-x/z, -y/z) of the normals; `tile`: (n,), 0 to TILES² - 1."""

    slopes: np.ndarray
    tile: np.ndarray
    missing: int


def level(heights: np.ndarray, degree: int) -> np.ndarray:
    """Heights less their least-squares polynomial of total degree `degree`: 1 is a plane, 0 the mean."""
    ny, nx = heights.shape
    # On [-1, 1] the powers are of one size; in metres the fourth would be lost to rounding beside the first.
    y, x = np.meshgrid(np.linspace(-1, 1, ny), np.linspace(-1, 1, nx), indexing="ij")
    basis = np.stack([x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=-1)
    known = np.isfinite(heights)
    coefficients, *_ = np.linalg.lstsq(basis[known], heights[known])
    return heights - basis @ coefficients


LONGEST_CUTOFF = 1 / 4
"""Of a side: beyond it the edges, where the filter sees half of what it averages, are most of the surface."""


def smooth(heights: np.ndarray, pixel: tuple[float, float], cutoff: float) -> np.ndarray:
    """Heights through the Gaussian filter of ISO 16610-61: of waves of length `cutoff` [m] half is left, of shorter ones less.

    What is missing stays so, and its neighbours are averages of what is known.
    """
    known = np.isfinite(heights)
    sigma = [cutoff * math.sqrt(2 * math.log(2)) / (2 * math.pi * size) for size in reversed(pixel)]
    total = ndimage.gaussian_filter(np.where(known, heights, 0.0), sigma, mode="constant")
    return np.where(
        known, total / np.where(known, ndimage.gaussian_filter(known.astype(float), sigma, mode="constant"), 1), np.nan
    )


# Each: slopes (∂h/∂x, ∂h/∂y), (rows, columns, 2), NaN where a height that it needs is missing. The normal is
# (-∂h/∂x, -∂h/∂y, 1) normalised, so that its slope (-x/z, -y/z) is (∂h/∂x, ∂h/∂y).


def central_slopes(heights: np.ndarray, pixel: tuple[float, float]) -> np.ndarray:
    """At each inner point, from its four neighbours."""
    dx, dy = pixel
    along_x = (heights[1:-1, 2:] - heights[1:-1, :-2]) / (2 * dx)
    along_y = (heights[2:, 1:-1] - heights[:-2, 1:-1]) / (2 * dy)
    return np.stack([along_x, along_y], axis=-1)


def cell_slopes(heights: np.ndarray, pixel: tuple[float, float]) -> np.ndarray:
    """Amid each four points, of the plane nearest to them: the finest, and the one that noise moves most."""
    dx, dy = pixel
    along_x, along_y = np.diff(heights, axis=1) / dx, np.diff(heights, axis=0) / dy
    return np.stack([(along_x[1:] + along_x[:-1]) / 2, (along_y[:, 1:] + along_y[:, :-1]) / 2], axis=-1)


def facet_slopes(heights: np.ndarray, pixel: tuple[float, float]) -> np.ndarray:
    """At each inner point, of the plane nearest to it and its eight neighbours: a third of the noise's variance."""
    dx, dy = pixel
    along_x, along_y = (heights[:, 2:] - heights[:, :-2]) / (2 * dx), (heights[2:] - heights[:-2]) / (2 * dy)
    return np.stack(
        [(along_x[:-2] + along_x[1:-1] + along_x[2:]) / 3, (along_y[:, :-2] + along_y[:, 1:-1] + along_y[:, 2:]) / 3],
        axis=-1,
    )


Estimator = Callable[[np.ndarray, tuple[float, float]], np.ndarray]
ESTIMATORS: dict[str, tuple[Estimator, str]] = {
    "central": (central_slopes, "by central differences"),
    "cell": (cell_slopes, "of planes through 2 x 2 heights"),
    "facet": (facet_slopes, "of planes through 3 x 3 heights"),
}


def from_heights(field: Heights, *, degree: int = 1, estimator: str = "central", cutoff: float = 0.0) -> Slopes:
    """Slopes of the levelled and smoothed surface; x runs along a row, y from row to row.

    - `cutoff`: of `smooth`, in metres; 0 leaves the surface as it is.
    """
    path = field.source.path
    known = int(np.isfinite(field.heights).sum())
    if known < FEWEST:
        raise InputError(f"{path}: {known} heights; need at least {FEWEST}")
    levelled = level(field.heights, degree)
    if cutoff:
        _check_cutoff(field, cutoff)
        levelled = smooth(levelled, field.pixel, cutoff)
    grid = ESTIMATORS[estimator][0](levelled, field.pixel)
    good = np.isfinite(grid).all(axis=-1)
    slopes = grid[good]
    if len(slopes) < FEWEST:
        raise InputError(f"{path}: {len(slopes)} slopes between known heights; need at least {FEWEST}")
    typical = float(np.median(np.hypot(*slopes.T)))
    if typical > STEEPEST:
        raise InputError(f"{path}: a median slope of {typical:.3g}; check the unit of the heights and the pixel size")
    if np.ptp(slopes, axis=0).min() < FLATTEST:
        raise InputError(f"{path}: a surface flat along an axis; its slopes have no density to fit")
    rows, columns = (np.arange(size) * TILES // size for size in grid.shape[:2])
    tile = rows[:, None] * TILES + columns
    return Slopes(slopes, tile[good], int(good.size - good.sum()))


def _check_cutoff(field: Heights, cutoff: float) -> None:
    shortest = min(size * pixel for size, pixel in zip(reversed(field.heights.shape), field.pixel, strict=True))
    if not min(field.pixel) < cutoff <= LONGEST_CUTOFF * shortest:
        raise InputError(
            f"{field.source.path}: smoothing with a cutoff of {cutoff:g} m; need more than a pixel, {min(field.pixel):g} m, "
            f"and at most a quarter of the shorter side, {LONGEST_CUTOFF * shortest:.3g} m"
        )
