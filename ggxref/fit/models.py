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

from ggxref import fresnel, masking, slopes
from ggxref.fit import student
from ggxref.fit.parameters import FRESNEL, SHAPE

Vector = Array | np.ndarray
Entries = Array | tuple[Array, ...]
"""Of θ: in an array, or one by one."""


@dataclass(frozen=True)
class Surface:
    """The parts of a reflectance model that are chosen and not fitted: the tail, G2, and F."""

    tail: str = "ggx"
    masking: str = "height_correlated"
    fresnel: str = "schlick"


def gamma(theta: Entries) -> Array:
    return 1.5 + jnp.exp(theta[5])


# The standard ones, at α = 1: of the slope's square length, and of the direction's (x, y, z), of any length. Numbers one by one, not
# vectors: a derivative by an entry of a vector is a vector of zeros but for one, and XLA computes with all of them.
# They take θ for the tail alone.
DENSITY: dict[str, Callable[[Array, Entries], Array]] = {
    "ggx": lambda square, _: 1 / (math.pi * (1 + square) ** 2),
    "beckmann": lambda square, _: jnp.exp(-square) / math.pi,
    "student_t": lambda square, theta: jnp.exp(-gamma(theta) * jnp.log1p(square / (gamma(theta) - 1))) / math.pi,
}
AREA: dict[str, Callable[[tuple[Array, Array, Array], Entries], Array]] = {
    # `slopes.sigma_ggx` but for its care of directions below the horizon, of which G1 is 1.
    "ggx": lambda w, _: (jnp.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]) + w[2]) / 2,
    "beckmann": lambda w, _: slopes.sigma_beckmann(jnp.stack(w), jnp.ones_like(jnp.stack(w[:2]))),
    "student_t": lambda w, theta: student.sigma(w, gamma(theta)),
}


def shape_matrix(theta: Vector) -> Array:
    """The canonical shape matrix A of θ: (3, 3)."""
    zero, one = jnp.zeros_like(theta[0]), jnp.ones_like(theta[0])
    rows = [[jnp.exp(theta[0]), theta[2], zero], [zero, jnp.exp(theta[1]), zero], [-theta[3], -theta[4], one]]
    return jnp.stack([jnp.stack(row) for row in rows])


def standard_square(theta: Entries, slope: Vector | tuple[Array, Array]) -> Array:
    """‖C⁻¹(slope − mean)‖²."""
    u = (slope[0] - theta[3]) * jnp.exp(-theta[0])
    v = (slope[1] - theta[4] - theta[2] * u) * jnp.exp(-theta[1])
    return u * u + v * v


def slope_density(theta: Entries, slope: Vector | tuple[Array, Array], tail: str) -> Array:
    """P22 at a slope, (2,). With GGX's tail it is `slopes.ellipsoid`, without a matrix to bring to canonical form."""
    return DENSITY[tail](standard_square(theta, slope), theta) * jnp.exp(-theta[0] - theta[1])


def log_slope_density(theta: Array, slope: Array, tail: str) -> Array:
    """log P22; Beckmann's in closed form, as its density is 0 in floating point 27 roughnesses off."""
    square = standard_square(theta, slope)
    logarithm = -square - math.log(math.pi) if tail == "beckmann" else jnp.log(DENSITY[tail](square, theta))
    return logarithm - theta[0] - theta[1]


def unmasking(theta: Entries, w: Array, tail: str) -> Array:
    """1 + Λ = 1/G1 for `w`, (3,), above the horizon: the area seen from it over its cosine, at least 1 as in walter2014 (6).

    With GGX's tail it is that of `masking.g1_ellipsoid`: in canonical form the area seen from w is the standard one from A w.
    """
    # `shape_matrix` times w, without its zeros.
    x, y = jnp.exp(theta[0]) * w[0] + theta[2] * w[1], jnp.exp(theta[1]) * w[1]
    z = w[2] - theta[3] * w[0] - theta[4] * w[1]
    return jnp.maximum(1, AREA[tail]((x, y, z), theta) * (1 / w[2]))


def g2(theta: Entries, wi: Array, wo: Array, wm: Array, surface: Surface) -> Array:
    """G2 for reflection. V-cavities know no α: their cavities are symmetrical about n, whatever the slopes' mean."""
    if surface.masking == "v_cavity":
        return masking.g2_v_cavity(wi, wo, wm)
    i, o = unmasking(theta, wi, surface.tail), unmasking(theta, wo, surface.tail)
    return 1 / {"height_correlated": i + o - 1, "separable": i * o}[surface.masking]


def reflectance(cosine: Array, entries: tuple[Array, ...], kind: str) -> Array:
    """F of one band from θ's entries for it."""
    if kind == "schlick":
        return fresnel.schlick(cosine, 1 / (1 + jnp.exp(-entries[0])))
    return fresnel.conductor(cosine, jnp.exp(entries[0]), jnp.exp(entries[1]))


def diffuse(entry: Array) -> Array:
    """ρ/π of one band from θ's entry for it."""
    return jnp.exp(entry) / math.pi


def specular(theta: Entries, wi: Array, wo: Array, wm: Array, surface: Surface) -> Array:
    """D G2 / (4 cos cos): the specular BRDF [1/sr] of F = 1, which the shape's six entries of θ determine."""
    # As `bsdf.brdf` has it; what the directions alone determine is a factor of its own, which no derivative computes again.
    fixed = 1 / (4 * wi[2] * wo[2] * wm[2] ** 4)
    slope = (-wm[0] / wm[2], -wm[1] / wm[2])
    return slope_density(theta, slope, surface.tail) * g2(theta, wi, wo, wm, surface) * fixed


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
    """`brdf` of many: directions (3, n), values (bands, n). Filled up to a power of two, so that few sizes are compiled."""
    count = wi.shape[-1]
    fill = (1 << max(count - 1, 1023).bit_length()) - count
    directions = (np.pad(w, ((0, 0), (0, fill)), constant_values=1) for w in (wi, wo, wm))
    return np.asarray(_brdfs(theta, *directions, surface))[:, :count]


def slope_densities(theta: Vector, slopes: Vector, tail: str) -> np.ndarray:
    """`slope_density` of many: slopes (2, n), values (n,)."""
    return np.asarray(_slope_densities(theta, slopes, tail))
