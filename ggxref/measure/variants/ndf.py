"""Forms of the GGX density D [1/sr]. `wm`: unit, (3,); `alpha`: (2,)."""

import math

import jax.numpy as jnp

from ggxref import ndf
from ggxref.measure.reference import REFERENCES
from ggxref.measure.variants.form import Variant

exact = REFERENCES["ndf.ggx"]


def cosine(wm, alpha):
    """α²/(π (cos²θ (α² − 1) + 1)²): isotropic."""
    a = alpha[0] * alpha[0]
    return a / (math.pi * (wm[2] * wm[2] * (a - 1) + 1) ** 2)


def tangent(wm, alpha):
    """1/(π αxαy cos⁴θ (1 + tan²θ (cos²φ/αx² + sin²φ/αy²))²)."""
    cos_square = wm[2] * wm[2]
    sin_square = 1 - cos_square
    tan_square = sin_square / cos_square
    cos_phi, sin_phi = wm[0] / jnp.sqrt(sin_square), wm[1] / jnp.sqrt(sin_square)
    e = tan_square * ((cos_phi / alpha[0]) ** 2 + (sin_phi / alpha[1]) ** 2)
    return 1 / (math.pi * alpha[0] * alpha[1] * cos_square * cos_square * (1 + e) ** 2)


def cross_product(wm, alpha):
    """(α/(‖n × ω_m‖² + (α cos θ)²))²/π: Lagrange's identity for 1 − cos², isotropic."""
    a = wm[2] * alpha[0]
    k = alpha[0] / (wm[0] * wm[0] + wm[1] * wm[1] + a * a)
    return k * k * (1 / math.pi)


def cofactors(wm, alpha):
    """|A|³/(π ‖cof(A) ω_m‖⁴) for A = diag(αx, αy, 1): no division before the fourth power."""
    det = alpha[0] * alpha[1]
    x, y, z = wm[0] * alpha[1], wm[1] * alpha[0], wm[2] * det
    square = x * x + y * y + z * z
    return det * det * det / (math.pi * square * square)


VARIANTS = (
    Variant("sum of squares", "ggxref.ndf.ggx", ndf.ggx),
    Variant("cos²", "Walter et al. 2007 (33) with tan² cleared; Karis 2013 and most real-time renderers", cosine),
    Variant("tan²", "heitz2014 §5; pbrt-v4", tangent),
    Variant("cross product", "Filament, mobile form", cross_product),
    Variant("cofactors", "walter2014 (1) with A⁻ᵀ cleared", cofactors),
)
