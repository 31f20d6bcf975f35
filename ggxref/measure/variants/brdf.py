"""Forms of the half vector and of a metal's whole BRDF [1/sr], a bounce's evaluation. `wi`, `wo`: unit, (3,), above the horizon."""

import jax.numpy as jnp

from ggxref import bsdf, fresnel, geometry, masking, ndf, stable
from ggxref.measure.reference import REFERENCES
from ggxref.measure.reference import formulas as reference
from ggxref.measure.variants.densities import exact_dot
from ggxref.measure.variants.form import Variant

# Nearly silver at 550 nm, in numbers that every dtype holds: index and extinction.
ETA, K = 0.125, 3.5
BANDS = ((0.13, 4.0), (ETA, K), (0.15, 2.5))

exact_half = REFERENCES["geometry.half_reflection"]


def exact_brdf(wi, wo, alpha):
    F = reference.fresnel_conductor(exact_dot(reference.unit(wi), exact_half(wi, wo)), ETA, K)
    return reference.bsdf_brdf_ggx(wi, wo, alpha) * F


def plain_sum(wi, wo):
    return tuple(p + q for p, q in zip(wi, wo, strict=True))


def half_plain(wi, wo):
    """The sum of the directions as they are, normalised."""
    return jnp.stack(stable.unit(*plain_sum(wi, wo)))


def conductor_of_sum(wi, wo):
    """F, whose cosine is ‖ω_i + ω_o‖/2: near 1 at grazing angles, where the sum loses digits."""
    return _conductor_of_sum(wi, wo, ETA, K)


def _conductor_of_sum(wi, wo, eta, k):
    square = sum(c * c for c in plain_sum(wi, wo))
    return fresnel.conductor(jnp.sqrt(square) / 2, eta, k, square=square / 4)


def one_expression(wi, wo, alpha):
    """The library's BRDF times F."""
    return bsdf.brdf_ggx(wi, wo, alpha) * conductor_of_sum(wi, wo)


def three_bands(wi, wo, alpha):
    """A renderer's: F of each band, in one pass over the points."""
    found = bsdf.brdf_ggx(wi, wo, alpha)
    return jnp.stack(stable.one_loop(*(found * _conductor_of_sum(wi, wo, eta, k) for eta, k in BANDS)))


def exact_lengths(wi, wo, alpha):
    """The same of ω_i + ω_o without any rounding in their lengths."""
    return bsdf.brdf_ggx(wi, wo, alpha, add=stable.unit_sum) * conductor_of_sum(wi, wo)


def composed(wi, wo, alpha, *, half=geometry.half_reflection):
    """D, G1, G2 and F of the library, put together."""
    wm = half(wi, wo)
    G2 = masking.g2_height_correlated(masking.g1_ggx(wi, wm, alpha), masking.g1_ggx(wo, wm, alpha))
    F = fresnel.conductor(stable.cosine(wi, wm), ETA, K)
    return bsdf.brdf(wi, wo, ndf.ggx(wm, alpha), G2, F)


def composed_plain(wi, wo, alpha):
    """The same at the plain half vector."""
    return composed(wi, wo, alpha, half=half_plain)


def plain(wi, wo, alpha):
    """The same with nothing compensated."""
    return bsdf.brdf_ggx(wi, wo, alpha, add=plain_sum) * conductor_of_sum(wi, wo)


HALF = (
    Variant("exact lengths", "ggxref.geometry.half_reflection", geometry.half_reflection),
    Variant("plain sum", "dupuy2023 (6), every renderer", half_plain),
)
BRDF = (
    Variant("one expression", "ggxref.bsdf.brdf_ggx", one_expression),
    Variant(
        "one expression, exact lengths", "ggxref.bsdf.brdf_ggx with the sum of exactly unit directions", exact_lengths
    ),
    Variant("composed", "ggxref.bsdf.brdf of the library's D, G2 and F", composed),
    Variant("composed, plain half vector", "the same at the plain half vector", composed_plain),
    Variant("one expression, plain", "ggxref.bsdf.brdf_ggx with the plain sum of the directions", plain),
)

__all__ = ["BRDF", "HALF", "exact_brdf", "exact_half", "three_bands"]
