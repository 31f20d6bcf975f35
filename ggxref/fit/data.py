"""The two in-memory forms of a measurement: reflectance and a height field. NumPy, float64, SI units, radians."""

from dataclasses import dataclass, field

import numpy as np

from ggxref.errors import InputError


@dataclass(frozen=True)
class Source:
    """Where a measurement came from: enough to find the same bytes again."""

    path: str
    format: str
    sha256: str


@dataclass(frozen=True)
class Reflectance:
    """BRDF samples. Row k: the value per band of the reflection of light from `wi[k]` towards `wo[k]`.

    - `wi`, `wo`: (n, 3), unit, on or above the horizon.
    - `values`: (n, bands), the BRDF f [1/sr].
    - `weights`: (n,), positive; `mask`: (n,), True where the sample may be used.
    - `bands`: their names. `counts`: what was done to how many samples, and why.
    """

    wi: np.ndarray
    wo: np.ndarray
    values: np.ndarray
    weights: np.ndarray
    mask: np.ndarray
    bands: tuple[str, ...]
    source: Source
    counts: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Heights:
    """A height field. `heights`: (ny, nx) in metres, NaN where missing; `pixel`: (dx, dy) in metres."""

    heights: np.ndarray
    pixel: tuple[float, float]
    source: Source


def direction(zenith, azimuth) -> np.ndarray:
    """Unit vectors (n, 3) of zenith and azimuth angles in radians; a negative zenith is on the azimuth's other side."""
    sine = np.sin(zenith)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(zenith)], axis=-1)


SMALLEST_PIXEL, LARGEST_PIXEL = 1e-11, 1e-2
"""An atom's radius and a centimetre, in metres: beyond these it is the unit that is wrong."""


def check_pixel(where: str, pixel: tuple[float, float]) -> None:
    for name, size in zip(("dx", "dy"), pixel, strict=True):
        if not SMALLEST_PIXEL <= size <= LARGEST_PIXEL:
            raise InputError(
                f"{where}: pixel size {name} = {size:g} m; need {SMALLEST_PIXEL:g} to {LARGEST_PIXEL:g} m "
                "(slopes are heights over pixel sizes, so both must be in metres)"
            )
