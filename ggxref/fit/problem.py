"""From a measurement to what the solver takes: samples, weights, starts, and how the samples hang together."""

import math
from dataclasses import dataclass

import numpy as np

from ggxref.errors import InputError
from ggxref.fit import objectives, parameters
from ggxref.fit.data import Heights, Reflectance
from ggxref.fit.models import Surface
from ggxref.fit.parameters import Groups
from ggxref.fit.slopes import ESTIMATORS, TILES, Slopes, from_heights

FOLDS = 8
"""At most; as many as there are incident directions where those are fewer."""
BLOCKS = 8
"""Each incident direction's samples are cut in this many runs; residuals within one are not independent."""
FEWEST = 32
"""Used samples below which eight blocks of one direction are not even four samples each."""
IN_PLANE = 1e-6


@dataclass(frozen=True)
class Problem:
    """`samples`: arrays (..., n): wi, wo, their half vector, f per band and the noise ε; or slopes. `block`, `fold`: (n,) integers from 0.

    - `surface`: the reflectance model's fixed parts; None for slopes. `shapes`: those that this data can tell apart.
    - `parameters`: θ's names. `starts`: θ, (starts, p). `scale`: the typical slope.
    """

    samples: tuple[np.ndarray, ...]
    weights: np.ndarray
    block: np.ndarray
    fold: np.ndarray
    surface: Surface | None
    shapes: dict[str, Groups]
    parameters: tuple[str, ...]
    starts: np.ndarray
    scale: float
    notes: tuple[str, ...]

    @property
    def size(self) -> int:
        return len(self.weights)

    def by_block(self, losses: np.ndarray) -> np.ndarray:
        """(blocks,): the weighted mean of the samples' losses in each block."""
        _, block = np.unique(self.block, return_inverse=True)
        return np.bincount(block, losses * self.weights) / np.bincount(block, self.weights)


def from_reflectance(data: Reflectance, surface: Surface, *, min_cosine: float, most: int) -> Problem:
    """The BRDF's problem, over the samples whose two cosines with the normal exceed `min_cosine`, thinned to `most`."""
    used = np.flatnonzero(data.mask & (data.wi[:, 2] > min_cosine) & (data.wo[:, 2] > min_cosine))
    if len(used) < FEWEST:
        raise InputError(
            f"{data.source.path}: {len(used)} of {len(data.mask)} samples have cosines above {min_cosine:g}; need at least {FEWEST}"
        )
    kept = used if len(used) <= most else used[np.arange(most) * len(used) // most]
    wi, wo, values, weights = data.wi[kept], data.wo[kept], data.values[kept], data.weights[kept]
    noise = objectives.noise_floor(values, wo)
    notes = [f"{len(used)} of {len(data.mask)} samples used (cosines above {min_cosine:g})"]
    notes += [f"{len(kept)} of them fitted, evenly through the file"] if len(kept) < len(used) else []
    notes += [f"{count} samples {what}" for what, count in data.counts.items() if count]
    notes.append(f"noise floor of f·cosθo: {noise:.3g} 1/sr")
    wi, wo, shapes, plane = _plane(wi, wo)
    notes += plane
    direction = _directions(wi)
    runs = _runs(direction)
    return Problem(
        samples=(wi.T, wo.T, _half(wi, wo).T, np.maximum(values, 0).T, np.full(len(wi), noise)),
        weights=weights,
        block=direction * BLOCKS + runs,
        fold=direction % FOLDS if direction.max() else runs,
        surface=surface,
        shapes=shapes,
        parameters=parameters.names(data.bands, surface.fresnel),
        starts=_reflectance_starts(values, surface.fresnel),
        scale=0.1,
        notes=tuple(notes),
    )


def from_surface(data: Heights, *, degree: int = 1, estimator: str = "central", cutoff: float = 0.0) -> Problem:
    """The slope density's problem, over the slopes of the levelled and smoothed surface, as in `slopes.from_heights`."""
    surface = from_heights(data, degree=degree, estimator=estimator, cutoff=cutoff)
    smoothed = f"smoothed with a cutoff of {cutoff:g} m" if cutoff else "not smoothed"
    notes = [f"the surface levelled by a polynomial of degree {degree}, {smoothed}"]
    notes.append(f"{len(surface.slopes)} slopes {ESTIMATORS[estimator][1]}")
    notes += [f"{surface.missing} left out: a height is missing"] if surface.missing else []
    return from_slopes(surface, tuple(notes))


def from_slopes(surface: Slopes, notes: tuple[str, ...] = ()) -> Problem:
    """The slope density's problem, over these slopes."""
    starts, scale = _slope_starts(surface.slopes)
    # Folds take every eighth tile, shifted from row to row, so that each holds all columns and all rows.
    row, column = np.divmod(surface.tile, TILES)
    return Problem(
        samples=(np.ascontiguousarray(surface.slopes.T),),
        weights=np.ones(len(surface.slopes)),
        block=surface.tile,
        fold=(row * 3 + column) % FOLDS,
        surface=None,
        shapes=parameters.SHAPES,
        parameters=parameters.names(()),
        starts=starts,
        scale=scale,
        notes=notes,
    )


def _half(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Half vectors, (n, 3); both directions are above the horizon, so that none is zero."""
    both = wi + wo
    return both / np.linalg.norm(both, axis=1, keepdims=True)


def _directions(wi: np.ndarray) -> np.ndarray:
    """For each sample, which incident direction it has; where nearly every sample has its own, which eighth of the zeniths."""
    _, direction = np.unique(np.round(wi, 6), axis=0, return_inverse=True)
    if direction.max() < len(wi) / BLOCKS:
        return direction.reshape(-1)
    return np.searchsorted(np.quantile(wi[:, 2], np.arange(1, FOLDS) / FOLDS), wi[:, 2])


def _runs(direction: np.ndarray) -> np.ndarray:
    """For each sample, which of the BLOCKS runs of its own direction it is in, in file order."""
    runs = np.empty_like(direction)
    for value in np.unique(direction):
        members = np.flatnonzero(direction == value)
        runs[members] = np.arange(len(members)) * BLOCKS // len(members)
    return runs


def _plane(wi, wo) -> tuple[np.ndarray, np.ndarray, dict[str, Groups], list[str]]:
    """Where all directions lie in one vertical plane: turned into the xz plane, with the shapes that can be told apart there.

    There αy enters through the peak's height alone, as F0 does, and the mean slope across the plane not to first order.
    """
    horizontal = np.concatenate([wi[:, :2], wo[:, :2]])
    _, spread, axes = np.linalg.svd(horizontal, full_matrices=False)
    if spread[1] > IN_PLANE * spread[0]:
        return wi, wo, parameters.SHAPES, []
    cosine, sine = axes[0] * (1 if axes[0][0] >= 0 else -1)
    turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    azimuth = math.degrees(math.atan2(sine, cosine))
    notes = ["all directions lie in one plane, which cannot see αy apart from αx, nor a shear or a mean slope across"]
    notes += [f"x is along that plane, at azimuth {azimuth:.4g}°"] if abs(azimuth) > 1e-3 else []
    return wi @ turn.T, wo @ turn.T, parameters.IN_PLANE, notes


def _reflectance_starts(values: np.ndarray, fresnel: str) -> np.ndarray:
    """Roughnesses over two decades, stretched to either side, with the diffuse term at the level of the darkest tenth.

    F0 starts at 1/2, a conductor at that of η = 1 and k = 2.
    """
    alpha = np.log(np.geomspace(0.005, 0.6, 6))
    stretch = np.array([0.3, -0.3] * 3)
    dark = np.log(np.clip(math.pi * np.quantile(values, 0.1, axis=0), 1e-4, 0.9))
    interface = {"schlick": [0.0], "conductor": [0.0, math.log(2)]}[fresnel]
    rest = np.concatenate([np.repeat(interface, values.shape[1]), dark])
    starts = np.zeros((len(alpha), len(parameters.SHAPE) + len(rest)))
    starts[:, 0], starts[:, 1], starts[:, 5] = alpha + stretch, alpha - stretch, parameters.GGX
    starts[:, len(parameters.SHAPE) :] = rest
    return starts


def _slope_starts(slopes: np.ndarray) -> tuple[np.ndarray, float]:
    """The median slope, which for GGX is α, and three times it: the likelihood has one peak, so that both must agree."""
    scale = float(np.median(np.hypot(*slopes.T)))
    starts = np.zeros((2, len(parameters.SHAPE)))
    starts[:, :2] = np.log([[scale], [3 * scale]])
    starts[:, 5] = parameters.GGX
    return starts, scale
