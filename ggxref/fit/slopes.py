"""From a height field to samples of its slope density P22: level the surface, then take central differences."""

from dataclasses import dataclass

import numpy as np

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


def central_slopes(heights: np.ndarray, pixel: tuple[float, float]) -> np.ndarray:
    """The slope (∂h/∂x, ∂h/∂y) at each inner point, (ny - 2, nx - 2, 2), NaN where a neighbour is missing.

    The normal is (-∂h/∂x, -∂h/∂y, 1) normalised, so that its slope (-x/z, -y/z) is (∂h/∂x, ∂h/∂y).
    """
    dx, dy = pixel
    along_x = (heights[1:-1, 2:] - heights[1:-1, :-2]) / (2 * dx)
    along_y = (heights[2:, 1:-1] - heights[:-2, 1:-1]) / (2 * dy)
    return np.stack([along_x, along_y], axis=-1)


def from_heights(field: Heights, *, degree: int = 1) -> Slopes:
    """Slopes of the levelled surface; x runs along a row, y from row to row."""
    path = field.source.path
    known = int(np.isfinite(field.heights).sum())
    if known < FEWEST:
        raise InputError(f"{path}: {known} heights; need at least {FEWEST}")
    grid = central_slopes(level(field.heights, degree), field.pixel)
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
