r"""The parameters of all models, one flat vector θ, and the directions in which each model may move it.

θ = (log αx, log αy, shear, mean x, mean y, log(γ − 3/2), then per band Fresnel's and log ρ). The first five are the canonical
slope-space form of the ellipsoid NDF: $\Sigma = C C^T$ with $C = \begin{pmatrix}\alpha_x & 0\\ s & \alpha_y\end{pmatrix}$,
and the mean slope; γ is the tail, 2 for GGX. Fresnel's are logit F0, or log η and log k. ρ is the diffuse albedo.

A model is a set of free directions in θ: θ = held + basis · y with y unconstrained. The isotropic model moves log αx and
log αy together; a parameter that the user fixes, or that the data cannot see, has no direction.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.special

from ggxref.errors import InputError

SHAPE = ("alpha_x", "alpha_y", "shear", "mean_x", "mean_y", "gamma")
FRESNEL = {"schlick": ("f0",), "conductor": ("eta", "k")}
TAILS = ("ggx", "beckmann", "student_t")

Groups = tuple[tuple[str, ...], ...]

SHAPES: dict[str, Groups] = {
    "isotropic": (("alpha_x", "alpha_y"),),
    "anisotropic": (("alpha_x",), ("alpha_y",)),
    "rotated": (("alpha_x",), ("alpha_y",), ("shear",)),
    "ellipsoid": (("alpha_x",), ("alpha_y",), ("shear",), ("mean_x",), ("mean_y",)),
}
"""From the smallest to the largest; each holds the ones before it. A group of names moves as one."""

IN_PLANE: dict[str, Groups] = {
    "isotropic": (("alpha_x", "alpha_y"),),
    "ellipsoid": (("alpha_x", "alpha_y"), ("mean_x",)),
}
"""What directions in one vertical plane through x can see."""


@dataclass(frozen=True)
class Model:
    """A shape with a tail."""

    name: str
    groups: Groups
    tail: str


def ladder(shapes: Mapping[str, Groups], tails: Sequence[str]) -> list[Model]:
    """Every shape with every tail, those with the fewest parameters first."""
    rungs = []
    for tail in tails:
        extra = (("gamma",),) if tail == "student_t" else ()
        suffix = "" if tail == "ggx" else f" {tail}"
        rungs += [Model(name + suffix, groups + extra, tail) for name, groups in shapes.items()]
    return sorted(rungs, key=lambda model: len(model.groups))


@dataclass(frozen=True)
class Space:
    """The free directions of one model: θ = held + basis · y. `held`: (p,); `basis`: (p, p), unused columns 0."""

    held: np.ndarray
    basis: np.ndarray

    @property
    def columns(self) -> np.ndarray:
        """The indices of the free directions in y."""
        return np.flatnonzero(self.basis.any(axis=0))

    @property
    def size(self) -> int:
        """How many directions are free."""
        return len(self.columns)

    @property
    def moved(self) -> np.ndarray:
        """(p,): does the space move this entry of θ?"""
        return np.array([row.any() for row in self.basis])

    def coordinates(self, theta: np.ndarray) -> np.ndarray:
        """The y of the point of the space nearest to θ."""
        return np.linalg.lstsq(self.basis[self.moved], (theta - self.held)[self.moved])[0]


def names(bands: tuple[str, ...], fresnel: str = "schlick") -> tuple[str, ...]:
    """The parameters' names, in θ's order; those of a band carry its name where there are several."""
    suffixes = [f" {band}" for band in bands] if len(bands) > 1 else [""] * len(bands)
    return (*SHAPE, *(name + suffix for name in (*FRESNEL[fresnel], "diffuse") for suffix in suffixes))


def _kind(name: str) -> str:
    return name.partition(" ")[0].partition("_")[0]


GGX = math.log(2 - 1.5)
"""θ's entry for γ = 2."""

ALLOWED = {
    "alpha": ("a positive number", lambda value: 0 < value < math.inf),
    "gamma": ("a number above 1.5, where the surface's area is finite", lambda value: 1.5 < value < math.inf),
    "eta": ("a positive number", lambda value: 0 < value < math.inf),
    "k": ("a positive number", lambda value: 0 < value < math.inf),
    "f0": ("a number between 0 and 1", lambda value: 0 < value < 1),
    "diffuse": ("an albedo from 0 to 1", lambda value: 0 <= value <= 1),
}


def from_user(name: str, value: float) -> float:
    """θ's entry for a parameter's value; the error says which values there are."""
    kind = _kind(name)
    need, allowed = ALLOWED.get(kind, ("a finite number", math.isfinite))
    if not allowed(value):
        raise InputError(f"{name} = {value:g}; need {need}")
    if kind == "f0":
        return math.log(value / (1 - value))
    if kind == "gamma":
        return math.log(value - 1.5)
    if kind in ALLOWED:
        return math.log(value) if value else -math.inf
    return value


def to_user(name: str, entry: float) -> float:
    """A parameter's value for θ's entry."""
    kind = _kind(name)
    # An entry that ran off to infinity is a value at its bound, not an error.
    with np.errstate(over="ignore"):
        if kind == "f0":
            return float(1 / (1 + np.exp(-entry)))
        return float(np.exp(entry)) + (1.5 if kind == "gamma" else 0.0) if kind in ALLOWED else entry


BOUNDS = {
    "alpha": (math.log(1e-5), math.log(50.0)),
    "gamma": (math.log(1e-4), math.log(28.5)),
    "f0": (-9.0, 9.0),
    "eta": (math.log(1e-4), math.log(1e4)),
    "k": (math.log(1e-4), math.log(1e4)),
    "diffuse": (math.log(1e-6), math.inf),
}
"""Entries of θ beyond which a parameter is 0, 1 or infinite for any data; γ above 30 is Beckmann's tail."""


def at_bounds(space: Space, theta: np.ndarray, parameters: tuple[str, ...]) -> list[str]:
    """The free parameters that ran to their bounds, where the data holds them and a standard error has no meaning."""
    free = [(name, entry) for name, entry, moved in zip(parameters, theta, space.moved, strict=True) if moved]
    ends = {name: BOUNDS.get(_kind(name), (-math.inf, math.inf)) for name, _ in free}
    return [name for name, entry in free if not ends[name][0] < entry < ends[name][1]]


def without(space: Space, names: list[str], parameters: tuple[str, ...]) -> Space:
    """The space with the directions of these parameters left out."""
    rows = [parameters.index(name) for name in names]
    basis = space.basis.copy()
    basis[:, space.basis[rows].any(axis=0)] = 0
    return Space(space.held, basis)


def space(groups: Groups, parameters: tuple[str, ...], fixed: Mapping[str, float], scale: float) -> Space:
    """The space of a model of these groups, with the entries `fixed` (θ's values) held.

    - `scale`: the slope that is typical here: one unit of y moves the shear or the mean slope by that much, so that
      all of y is of order 1.
    """
    held = np.array([fixed.get(name, GGX if name == "gamma" else 0.0) for name in parameters])
    basis = np.zeros((len(parameters),) * 2)
    free = [*groups, *((name,) for name in parameters if name not in SHAPE)]
    for column, group in enumerate(free):
        members = [parameters.index(name) for name in group]
        given = [fixed[name] for name in group if name in fixed]
        if given:
            held[members] = given[0]  # fixing one alpha of an isotropic model fixes both
        else:
            basis[members, column] = scale if group[0] in ("shear", "mean_x", "mean_y") else 1.0
    return Space(held, basis)


def admits(groups: Groups, fixed: Mapping[str, float]) -> bool:
    """Can a model of these groups hold the entries `fixed`? Not a shear where it has none, nor two alphas in one."""
    known = {name for group in groups for name in group}
    absent = {"gamma": GGX}
    outside = [name for name in fixed if name in SHAPE and name not in known and fixed[name] != absent.get(name, 0.0)]
    tied = [{fixed[name] for name in group if name in fixed} for group in groups]
    return not outside and all(len(values) <= 1 for values in tied)


DERIVED = ("alpha_1", "alpha_2", "anisotropy", "rotation", "mean_slope")


def derived(theta: np.ndarray) -> np.ndarray:
    """The roots of Σ's eigenvalues, the large one first, and their ratio; the azimuth of the rougher axis [rad], and the
    length of the mean slope.
    """
    alpha_x, alpha_y, shear, mean_x, mean_y = *np.exp(theta[:2]), *theta[2:5]
    xx, xy, yy = alpha_x**2, alpha_x * shear, alpha_y**2 + shear**2
    large = np.sqrt((xx + yy) / 2 + np.hypot((xx - yy) / 2, xy))
    small = alpha_x * alpha_y / large
    return np.array([large, small, large / small, np.arctan2(2 * xy, xx - yy) / 2, np.hypot(mean_x, mean_y)])


DIFFERENCE = 1e-6


def report(
    theta: np.ndarray, covariance: np.ndarray, parameters: tuple[str, ...]
) -> tuple[dict[str, float], dict[str, float]]:
    """Values and standard errors by name, of the parameters and of DERIVED, to first order in the errors of θ."""

    def everything(theta):
        return np.array([*map(to_user, parameters, theta), *derived(theta)])

    slope = np.zeros((len(parameters) + len(DERIVED), len(theta)))
    for column in np.flatnonzero(np.diag(covariance)):
        step = np.zeros_like(theta)
        step[column] = DIFFERENCE
        slope[:, column] = (everything(theta + step) - everything(theta - step)) / (2 * DIFFERENCE)
    errors = np.sqrt(np.einsum("ij,jk,ik->i", slope, covariance, slope))
    every = (*parameters, *DERIVED)
    values = everything(theta).tolist()
    return dict(zip(every, values, strict=True)), dict(zip(every, errors.tolist(), strict=True))


SHARE = 0.95


def intervals(
    theta: np.ndarray, covariance: np.ndarray, parameters: tuple[str, ...], blocks: int
) -> dict[str, tuple[float, float]]:
    """Confidence intervals by name, from Student's t over the blocks: symmetric in θ, so that no end is out of range."""
    quantile = scipy.special.stdtrit(max(blocks - 1, 1), (1 + SHARE) / 2)
    reach = quantile * np.sqrt(np.diag(covariance))
    found = {
        name: (to_user(name, entry - width), to_user(name, entry + width))
        for name, entry, width in zip(parameters, theta, reach, strict=True)
    }
    values, errors = report(theta, covariance, parameters)
    return found | {
        name: (values[name] - quantile * errors[name], values[name] + quantile * errors[name]) for name in DERIVED
    }
