"""Forms of Λ, G1 and G2 of GGX. `w`, `wi`, `wo`: unit, (3,), above the horizon; `alpha`: (2,)."""

import jax.numpy as jnp

from ggxref import masking, slopes
from ggxref.measure.reference import REFERENCES
from ggxref.measure.variants.form import Variant

exact_lambda = REFERENCES["masking.lambda_ggx"]


def exact_g1(w, alpha):
    return REFERENCES["masking.g1_ggx"](w, w, alpha)


def exact_g2(wi, wo, alpha):
    return REFERENCES["masking.g2_height_correlated"](exact_g1(wi, alpha), exact_g1(wo, alpha))


def _tan_square(w, alpha):
    """α²tan²θ along the azimuth, from 1 − cos²."""
    cos_square = w[2] * w[2]
    sin_square = 1 - cos_square
    alpha_square = ((alpha[0] * w[0]) ** 2 + (alpha[1] * w[1]) ** 2) / jnp.where(sin_square > 0, sin_square, 1)
    return alpha_square * sin_square / cos_square


def lambda_printed(w, alpha):
    """(−1 + √(1 + (αx²x² + αy²y²)/z²))/2."""
    return (-1 + jnp.sqrt(1 + ((alpha[0] * w[0]) ** 2 + (alpha[1] * w[1]) ** 2) / (w[2] * w[2]))) / 2


def lambda_tangent(w, alpha):
    """(−1 + √(1 + α²tan²θ))/2."""
    return (-1 + jnp.sqrt(1 + _tan_square(w, alpha))) / 2


def g1_ours(w, alpha):
    return masking.g1_ggx(w, w, alpha)


def g1_lambda(w, alpha):
    """1/(1 + Λ) with Λ as printed."""
    return 1 / (1 + lambda_printed(w, alpha))


def g1_tangent(w, alpha):
    """2/(1 + √(1 + α²tan²θ))."""
    return 2 / (1 + jnp.sqrt(1 + _tan_square(w, alpha)))


def g1_schlick(w, alpha):
    """z/(z(1 − k) + k), k = α/2."""
    k = alpha[0] / 2
    return w[2] / (w[2] * (1 - k) + k)


def g2_ours(wi, wo, alpha):
    return masking.g2_height_correlated(g1_ours(wi, alpha), g1_ours(wo, alpha))


def g2_lambda(wi, wo, alpha):
    """1/(1 + Λ_i + Λ_o) with Λ as printed."""
    return 1 / (1 + lambda_printed(wi, alpha) + lambda_printed(wo, alpha))


def g2_sigma(wi, wo, alpha):
    """2 z_i z_o/(z_o t_i + z_i t_o), t = ‖(αx x, αy y, z)‖."""
    t_i, t_o = 2 * slopes.sigma_ggx(wi, alpha) - wi[2], 2 * slopes.sigma_ggx(wo, alpha) - wo[2]
    return 2 * wi[2] * wo[2] / (wo[2] * t_i + wi[2] * t_o)


def g2_interpolated(wi, wo, alpha):
    """2 z_i z_o/lerp(2 z_i z_o, z_i + z_o, α)."""
    product, total = 2 * wi[2] * wo[2], wi[2] + wo[2]
    return product / (product + (total - product) * alpha[0])


def g2_separable(wi, wo, alpha):
    return masking.g2_separable(g1_ours(wi, alpha), g1_ours(wo, alpha))


LAMBDA = (
    Variant("conjugate", "ggxref.masking.lambda_ggx", masking.lambda_ggx),
    Variant("printed", "tokuyoshi2024; heitz2014 §2.1", lambda_printed),
    Variant("tan²", "Walter et al. 2007 (34); pbrt-v4", lambda_tangent),
)
G1 = (
    Variant("sigma", "ggxref.masking.g1_ggx", g1_ours),
    Variant("1/(1+Λ)", "tokuyoshi2024", g1_lambda),
    Variant("tan²", "Walter et al. 2007 (34)", g1_tangent),
    Variant("Schlick–Smith", "Schlick 1994 with k = α/2, Karis 2013", g1_schlick, approximate=True),
)
G2 = (
    Variant("from G1", "ggxref.masking.g2_height_correlated", g2_ours),
    Variant("from Λ", "heitz2014; pbrt-v4", g2_lambda),
    Variant("one quotient", "Lagarde & de Rousiers 2014", g2_sigma),
    Variant("interpolated", "Hammon 2017; Filament, fast form", g2_interpolated, approximate=True),
    Variant("separable", "walter2014 (5); Mitsuba 3", g2_separable, approximate=True),
)
