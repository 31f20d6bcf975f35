r"""The models and their parameters, one flat vector θ for all of them.

θ = (log αx, log αy, shear, mean x, mean y, logit F0 per band, log ρ per band). The first five are the canonical slope-space
form of the ellipsoid NDF: $\Sigma = C C^T$ with $C = \begin{pmatrix}\alpha_x & 0\\ s & \alpha_y\end{pmatrix}$, and the mean slope;
with shear and mean 0 it is GGX. F0 is Schlick's, ρ the albedo of a diffuse term ρ/π.

A model is a set of free directions in θ: θ = held + basis · y with y unconstrained. The isotropic model moves log αx and
log αy together; a parameter that the user fixes, or that the data cannot see, has no direction.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ggxref import bsdf, ellipsoid, fresnel, masking, slopes
from ggxref.errors import InputError

SHAPE = ("alpha_x", "alpha_y", "shear", "mean_x", "mean_y")

Vector = Array | np.ndarray
Models = dict[str, tuple[tuple[str, ...], ...]]

MODELS: Models = {
    "isotropic": (("alpha_x", "alpha_y"),),
    "anisotropic": (("alpha_x",), ("alpha_y",)),
    "rotated": (("alpha_x",), ("alpha_y",), ("shear",)),
    "ellipsoid": (("alpha_x",), ("alpha_y",), ("shear",), ("mean_x",), ("mean_y",)),
}
"""From the smallest to the largest; each holds the ones before it. A group of names moves as one."""

IN_PLANE: Models = {
    "isotropic": (("alpha_x", "alpha_y"),),
    "ellipsoid": (("alpha_x", "alpha_y"), ("mean_x",)),
}
"""What directions in one vertical plane through x can see."""


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


def names(bands: tuple[str, ...]) -> tuple[str, ...]:
    """The parameters' names, in θ's order."""
    if len(bands) <= 1:
        return (*SHAPE, *(("f0", "diffuse") if bands else ()))
    return (*SHAPE, *(f"f0 {band}" for band in bands), *(f"diffuse {band}" for band in bands))


def from_user(name: str, value: float) -> float:
    """θ's entry for a parameter's value; the error says which values there are."""
    if name.startswith("alpha"):
        if not (math.isfinite(value) and value > 0):
            raise InputError(f"{name} = {value:g}; need a positive number")
        return math.log(value)
    if name.startswith("f0"):
        if not 0 < value < 1:
            raise InputError(f"{name} = {value:g}; need a number between 0 and 1")
        return math.log(value / (1 - value))
    if name.startswith("diffuse"):
        if not 0 <= value <= 1:
            raise InputError(f"{name} = {value:g}; need an albedo from 0 to 1")
        return math.log(value) if value else -math.inf
    if not math.isfinite(value):
        raise InputError(f"{name} = {value:g}; need a finite number")
    return value


DERIVED = ("alpha_1", "alpha_2", "anisotropy", "rotation", "mean_slope")


def to_user(theta: np.ndarray, parameters: tuple[str, ...]) -> np.ndarray:
    """The parameters' values, in θ's order, and then DERIVED: the roots of Σ's eigenvalues, the large one first, and their
    ratio; the azimuth of the rougher axis [rad], and the length of the mean slope.
    """
    with np.errstate(over="ignore"):
        values = [
            np.exp(entry)
            if name.startswith(("alpha", "diffuse"))
            else 1 / (1 + np.exp(-entry))
            if name.startswith("f0")
            else entry
            for entry, name in zip(theta, parameters, strict=True)
        ]
    alpha_x, alpha_y, shear, mean_x, mean_y = values[: len(SHAPE)]
    xx, xy, yy = alpha_x**2, alpha_x * shear, alpha_y**2 + shear**2
    large = np.sqrt((xx + yy) / 2 + np.hypot((xx - yy) / 2, xy))
    small = alpha_x * alpha_y / large
    return np.array([*values, large, small, large / small, np.arctan2(2 * xy, xx - yy) / 2, np.hypot(mean_x, mean_y)])


DIFFERENCE = 1e-6


def report(
    theta: np.ndarray, covariance: np.ndarray, parameters: tuple[str, ...]
) -> tuple[dict[str, float], dict[str, float]]:
    """Values and standard errors by name, by the derivatives of `to_user`."""
    every = (*parameters, *DERIVED)
    slope = np.zeros((len(every), len(theta)))
    for column in np.flatnonzero(np.diag(covariance)):
        step = np.zeros_like(theta)
        step[column] = DIFFERENCE
        slope[:, column] = (to_user(theta + step, parameters) - to_user(theta - step, parameters)) / (2 * DIFFERENCE)
    errors = np.sqrt(np.einsum("ij,jk,ik->i", slope, covariance, slope))
    values = to_user(theta, parameters)
    return dict(zip(every, values.tolist(), strict=True)), dict(zip(every, errors.tolist(), strict=True))


def space(
    groups: tuple[tuple[str, ...], ...], parameters: tuple[str, ...], fixed: Mapping[str, float], scale: float
) -> Space:
    """The space of a model of these groups, with the entries `fixed` (θ's values) held.

    - `scale`: the slope that is typical here: one unit of y moves the shear or the mean slope by that much, so that
      all of y is of order 1.
    """
    held = np.array([fixed.get(name, 0.0) for name in parameters])
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


def admits(groups: tuple[tuple[str, ...], ...], fixed: Mapping[str, float]) -> bool:
    """Can a model of these groups hold the entries `fixed`? Not a shear where it has none, nor two alphas in one."""
    known = {name for group in groups for name in group}
    outside = [value for name, value in fixed.items() if name in SHAPE and name not in known]
    tied = [{fixed[name] for name in group if name in fixed} for group in groups]
    return not any(outside) and all(len(values) <= 1 for values in tied)


def shape_matrix(theta: Vector) -> Array:
    """The canonical shape matrix A of θ: (3, 3)."""
    zero, one = jnp.zeros_like(theta[0]), jnp.ones_like(theta[0])
    rows = [[jnp.exp(theta[0]), theta[2], zero], [zero, jnp.exp(theta[1]), zero], [-theta[3], -theta[4], one]]
    return jnp.stack([jnp.stack(row) for row in rows])


def _standard_slope(theta: Array, slope: Array) -> Array:
    """C⁻¹(slope - mean): what the slope is in units where the distribution is GGX at α = 1."""
    u = (slope[0] - theta[3]) * jnp.exp(-theta[0])
    return jnp.stack([u, (slope[1] - theta[4] - theta[2] * u) * jnp.exp(-theta[1])])


def slope_density(theta: Array, slope: Array) -> Array:
    """P22 of the ellipsoid NDF at a slope, (2,): `slopes.ellipsoid` without a matrix to bring to canonical form."""
    ones = jnp.ones_like(slope)
    return slopes.ggx(_standard_slope(theta, slope), ones) * jnp.exp(-theta[0] - theta[1])


def g1(theta: Array, w: Array) -> Array:
    """G1 of the ellipsoid NDF for `w`, (3,), above the horizon: `masking.g1_ellipsoid` for micronormals that w sees.

    In canonical form σ(w) is that of the sphere's GGX, α = 1, for the direction A w.
    """
    stretched = jnp.stack(ellipsoid.times(shape_matrix(theta), *w))
    return jnp.minimum(1, w[2] / slopes.sigma_ggx(stretched, jnp.ones_like(w[:2])))


def brdf(theta: Array, wi: Array, wo: Array, wm: Array) -> Array:
    """The BRDF per band [1/sr], unit directions (3,) each: D G2 F / (4 cos cos) + ρ/π.

    G2 is Smith's with correlated heights, F Schlick's. `wm` is the half vector: it depends on no parameter, so that no
    fit need compute it, nor its derivatives, again.
    """
    f0, diffuse = theta[len(SHAPE) :].reshape(2, -1)
    D = slope_density(theta, slopes.from_normal(wm)) / wm[2] ** 4
    g2 = masking.g2_height_correlated(g1(theta, wi), g1(theta, wo))
    cosine = wi[0] * wm[0] + wi[1] * wm[1] + wi[2] * wm[2]

    def band(f0, diffuse):
        F = fresnel.schlick(cosine, 1 / (1 + jnp.exp(-f0)))
        return bsdf.brdf(wi, wo, D, g2, F) + jnp.exp(diffuse) / math.pi

    return jax.vmap(band)(f0, diffuse)


_brdfs = jax.jit(jax.vmap(brdf, (None, -1, -1, -1), -1))
_slope_densities = jax.jit(jax.vmap(slope_density, (None, -1)))


def brdfs(theta: Vector, *directions: Vector) -> np.ndarray:
    """`brdf` of many: wi, wo, wm of shape (3, n), values (bands, n)."""
    return np.asarray(_brdfs(theta, *directions))


def slope_densities(theta: Vector, slopes: Vector) -> np.ndarray:
    """`slope_density` of many: slopes (2, n), values (n,)."""
    return np.asarray(_slope_densities(theta, slopes))
