"""The formulas that are fitted, in terms of θ (see `parameters`) and of the library's functions.

All shapes are one formula: in units of C⁻¹(slope − mean) the distribution is the standard one, at α = 1. So is every tail,
and what it needs is the standard slope density and the standard projected area σ.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ggxref import bsdf, ellipsoid, fresnel, masking, slopes
from ggxref.fit import student
from ggxref.fit.parameters import FRESNEL, SHAPE

Vector = Array | np.ndarray


@dataclass(frozen=True)
class Surface:
    """The parts of a reflectance model that are chosen and not fitted: the tail, G2, and F."""

    tail: str = "ggx"
    masking: str = "height_correlated"
    fresnel: str = "schlick"


def gamma(theta: Array) -> Array:
    return 1.5 + jnp.exp(theta[5])


# Each takes its second argument, θ, for the tail alone.
DENSITY: dict[str, Callable[[Array, Array], Array]] = {
    "ggx": lambda slope, _: slopes.ggx(slope, jnp.ones_like(slope)),
    "beckmann": lambda slope, _: slopes.beckmann(slope, jnp.ones_like(slope)),
    "student_t": lambda slope, theta: slopes.student_t(slope, jnp.ones_like(slope), gamma(theta)),
}
AREA: dict[str, Callable[[Array, Array], Array]] = {
    "ggx": lambda w, _: slopes.sigma_ggx(w, jnp.ones_like(w[:2])),
    "beckmann": lambda w, _: slopes.sigma_beckmann(w, jnp.ones_like(w[:2])),
    "student_t": lambda w, theta: student.sigma(w, gamma(theta)),
}


def shape_matrix(theta: Vector) -> Array:
    """The canonical shape matrix A of θ: (3, 3)."""
    zero, one = jnp.zeros_like(theta[0]), jnp.ones_like(theta[0])
    rows = [[jnp.exp(theta[0]), theta[2], zero], [zero, jnp.exp(theta[1]), zero], [-theta[3], -theta[4], one]]
    return jnp.stack([jnp.stack(row) for row in rows])


def standard_slope(theta: Array, slope: Array) -> Array:
    """C⁻¹(slope − mean), (2,)."""
    u = (slope[0] - theta[3]) * jnp.exp(-theta[0])
    return jnp.stack([u, (slope[1] - theta[4] - theta[2] * u) * jnp.exp(-theta[1])])


def slope_density(theta: Array, slope: Array, tail: str) -> Array:
    """P22 at a slope, (2,). With GGX's tail it is `slopes.ellipsoid`, without a matrix to bring to canonical form."""
    return DENSITY[tail](standard_slope(theta, slope), theta) * jnp.exp(-theta[0] - theta[1])


def log_slope_density(theta: Array, slope: Array, tail: str) -> Array:
    """log P22; Beckmann's in closed form, as its density is 0 in floating point 27 roughnesses off."""
    standard = standard_slope(theta, slope)
    if tail == "beckmann":
        logarithm = -standard[0] * standard[0] - standard[1] * standard[1] - math.log(math.pi)
    else:
        logarithm = jnp.log(DENSITY[tail](standard, theta))
    return logarithm - theta[0] - theta[1]


def g1(theta: Array, w: Array, tail: str) -> Array:
    """Smith's G1 for `w`, (3,), above the horizon and micronormals that it sees, at most 1 as in walter2014 (6).

    With GGX's tail it is `masking.g1_ellipsoid`: in canonical form the area seen from w is the standard one from A w.
    """
    stretched = jnp.stack(ellipsoid.times(shape_matrix(theta), *w))
    return jnp.minimum(1, w[2] / AREA[tail](stretched, theta))


def g2(theta: Array, wi: Array, wo: Array, wm: Array, surface: Surface) -> Array:
    """G2 for reflection. V-cavities know no α: their cavities are symmetrical about n, whatever the slopes' mean."""
    if surface.masking == "v_cavity":
        return masking.g2_v_cavity(wi, wo, wm)
    combine = {"height_correlated": masking.g2_height_correlated, "separable": masking.g2_separable}[surface.masking]
    return combine(g1(theta, wi, surface.tail), g1(theta, wo, surface.tail))


def reflectance(cosine: Array, entries: tuple[Array, ...], kind: str) -> Array:
    """F of one band from θ's entries for it."""
    if kind == "schlick":
        return fresnel.schlick(cosine, 1 / (1 + jnp.exp(-entries[0])))
    return fresnel.conductor(cosine, jnp.exp(entries[0]), jnp.exp(entries[1]))


def diffuse(entry: Array) -> Array:
    """ρ/π of one band from θ's entry for it."""
    return jnp.exp(entry) / math.pi


def specular(theta: Array, wi: Array, wo: Array, wm: Array, surface: Surface) -> Array:
    """D G2 / (4 cos cos): the specular BRDF [1/sr] of F = 1, which the shape's six entries of θ determine."""
    D = slope_density(theta, slopes.from_normal(wm), surface.tail) / wm[2] ** 4
    return bsdf.brdf(wi, wo, D, g2(theta, wi, wo, wm, surface), jnp.ones_like(D))


def brdf(theta: Array, wi: Array, wo: Array, wm: Array, surface: Surface) -> Array:
    """The BRDF per band [1/sr], unit directions (3,) each: D G2 F / (4 cos cos) + ρ/π.

    `wm` is the half vector: it depends on no parameter, so that no fit need compute it, nor its derivatives, again.
    """
    lobe = specular(theta, wi, wo, wm, surface)
    cosine = wi[0] * wm[0] + wi[1] * wm[1] + wi[2] * wm[2]

    def band(*entries):
        return lobe * reflectance(cosine, entries[:-1], surface.fresnel) + diffuse(entries[-1])

    return jax.vmap(band)(*theta[len(SHAPE) :].reshape(len(FRESNEL[surface.fresnel]) + 1, -1))


_brdfs = jax.jit(jax.vmap(brdf, (None, -1, -1, -1, None), -1), static_argnums=4)
_slope_densities = jax.jit(jax.vmap(slope_density, (None, -1, None)), static_argnums=2)


def brdfs(theta: Vector, wi: Vector, wo: Vector, wm: Vector, surface: Surface) -> np.ndarray:
    """`brdf` of many: directions (3, n), values (bands, n)."""
    return np.asarray(_brdfs(theta, wi, wo, wm, surface))


def slope_densities(theta: Vector, slopes: Vector, tail: str) -> np.ndarray:
    """`slope_density` of many: slopes (2, n), values (n,)."""
    return np.asarray(_slope_densities(theta, slopes, tail))
