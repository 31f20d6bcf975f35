"""From a measurement to what the solver takes: samples, weights, starts, and how the samples hang together."""

import math
from dataclasses import dataclass

import numpy as np

from ggxref.errors import InputError
from ggxref.fit import models, objectives
from ggxref.fit.data import Heights, Reflectance
from ggxref.fit.objectives import Objective
from ggxref.fit.slopes import TILES, Slopes, from_heights

FOLDS = 8
"""At most; as many as there are incident directions where those are fewer."""
BLOCKS = 8
"""Each incident direction's samples are cut in this many runs; residuals within one are not independent."""
FEWEST = 32
"""Used samples below which eight blocks of one direction are not even four samples each."""
IN_PLANE = 1e-6


@dataclass(frozen=True)
class Problem:
    """`samples`: arrays (..., n), the objective's. `block`, `fold`: (n,) integers from 0.

    - `starts`: θ, (starts, p). `scale`: the typical slope. `models`: those that this data can tell apart.
    """

    objective: Objective
    samples: tuple[np.ndarray, ...]
    weights: np.ndarray
    block: np.ndarray
    fold: np.ndarray
    parameters: tuple[str, ...]
    starts: np.ndarray
    scale: float
    models: models.Models
    notes: tuple[str, ...]

    @property
    def size(self) -> int:
        return len(self.weights)


def from_reflectance(data: Reflectance, *, min_cosine: float = 0.05) -> Problem:
    """The BRDF's problem, over the samples whose two cosines with the normal exceed `min_cosine`."""
    used = data.mask & (data.wi[:, 2] > min_cosine) & (data.wo[:, 2] > min_cosine)
    if used.sum() < FEWEST:
        raise InputError(
            f"{data.source.path}: {used.sum()} of {len(used)} samples have cosines above {min_cosine:g}; "
            f"need at least {FEWEST}"
        )
    wi, wo, values, weights = data.wi[used], data.wo[used], data.values[used], data.weights[used]
    noise = objectives.noise_floor(values, wo)
    notes = [f"{used.sum()} of {len(used)} samples used (cosines above {min_cosine:g})"]
    notes += [f"{count} left out: {why}" for why, count in data.excluded.items() if count]
    notes.append(f"noise floor of f·cosθo: {noise:.3g} 1/sr")
    wi, wo, family, plane = _plane(wi, wo)
    notes += plane
    direction = np.unique(np.round(wi, 6), axis=0, return_inverse=True)[1].reshape(-1)
    runs = _runs(direction)
    return Problem(
        objective=objectives.REFLECTANCE,
        samples=(wi.T, wo.T, _half(wi, wo).T, np.maximum(values, 0).T, np.full(len(wi), noise)),
        weights=weights,
        block=direction * BLOCKS + runs,
        fold=direction % FOLDS if direction.max() else runs,
        parameters=models.names(data.bands),
        starts=_reflectance_starts(values),
        scale=0.1,
        models=family,
        notes=tuple(notes),
    )


def from_surface(data: Heights, *, degree: int = 1) -> Problem:
    """The slope density's problem, over the central differences of the surface levelled by a polynomial."""
    surface = from_heights(data, degree=degree)
    notes = [f"{len(surface.slopes)} slopes by central differences of the surface levelled by degree {degree}"]
    notes += [f"{surface.missing} left out: a height is missing"] if surface.missing else []
    return from_slopes(surface, tuple(notes))


def from_slopes(surface: Slopes, notes: tuple[str, ...] = ()) -> Problem:
    """The slope density's problem, over these slopes."""
    starts, scale = _slope_starts(surface.slopes)
    # Folds take every eighth tile, shifted from row to row, so that each holds all columns and all rows.
    row, column = np.divmod(surface.tile, TILES)
    return Problem(
        objective=objectives.SLOPES,
        samples=(np.ascontiguousarray(surface.slopes.T),),
        weights=np.ones(len(surface.slopes)),
        block=surface.tile,
        fold=(row * 3 + column) % FOLDS,
        parameters=models.names(()),
        starts=starts,
        scale=scale,
        models=models.MODELS,
        notes=notes,
    )


def _half(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Half vectors, (n, 3); both directions are above the horizon, so that none is zero."""
    both = wi + wo
    return both / np.linalg.norm(both, axis=1, keepdims=True)


def _runs(direction: np.ndarray) -> np.ndarray:
    """For each sample, which of the BLOCKS runs of its own direction it is in, in file order."""
    runs = np.empty_like(direction)
    for value in np.unique(direction):
        members = np.flatnonzero(direction == value)
        runs[members] = np.arange(len(members)) * BLOCKS // len(members)
    return runs


def _plane(wi, wo) -> tuple[np.ndarray, np.ndarray, models.Models, list[str]]:
    """Where all directions lie in one vertical plane: turned into the xz plane, with the models that can be told apart there.

    There αy enters through the peak's height alone, as F0 does, and the mean slope across the plane not to first order.
    """
    horizontal = np.concatenate([wi[:, :2], wo[:, :2]])
    _, spread, axes = np.linalg.svd(horizontal, full_matrices=False)
    if spread[1] > IN_PLANE * spread[0]:
        return wi, wo, models.MODELS, []
    cosine, sine = axes[0] * (1 if axes[0][0] >= 0 else -1)
    turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    azimuth = math.degrees(math.atan2(sine, cosine))
    notes = ["all directions lie in one plane, which cannot see αy apart from αx, nor a shear or a mean slope across"]
    notes += [f"x is along that plane, at azimuth {azimuth:.4g}°"] if abs(azimuth) > 1e-3 else []
    return wi @ turn.T, wo @ turn.T, models.IN_PLANE, notes


def _reflectance_starts(values: np.ndarray) -> np.ndarray:
    """Roughnesses over two decades, stretched to either side, with the diffuse term at the level of the darkest tenth."""
    bands = values.shape[1]
    alpha = np.log([0.005, 0.02, 0.05, 0.1, 0.2, 0.5])
    stretch = np.array([0.3, -0.3] * 3)
    dark = np.log(np.clip(math.pi * np.quantile(values, 0.1, axis=0), 1e-4, 0.9))
    starts = np.zeros((len(alpha), len(models.SHAPE) + 2 * bands))
    starts[:, 0], starts[:, 1] = alpha + stretch, alpha - stretch
    starts[:, -bands:] = dark
    return starts


def _slope_starts(slopes: np.ndarray) -> tuple[np.ndarray, float]:
    """The median slope, which for GGX is α, and three times it: the likelihood has one peak, so that both must agree."""
    scale = float(np.median(np.hypot(*slopes.T)))
    starts = np.zeros((2, len(models.SHAPE)))
    starts[:, :2] = np.log([[scale], [3 * scale]])
    return starts, scale
