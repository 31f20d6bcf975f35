"""Forms of the visible-normal density, of ω_i·ω_m, and of the dielectric Fresnel term."""

import jax.numpy as jnp

from ggxref import fresnel, ndf, slopes, stable
from ggxref.measure.reference import REFERENCES
from ggxref.measure.variants.form import Variant
from ggxref.measure.variants.masking import g1_tangent
from ggxref.measure.variants.ndf import tangent
from ggxref.sampling import spherical_cap

exact_pdf = REFERENCES["sampling.spherical_cap.pdf"]
exact_fresnel = REFERENCES["fresnel.dielectric"]


def exact_dot(wi, wm):
    """Of the vectors as given: neither is normalised."""
    return wi[0] * wm[0] + wi[1] * wm[1] + wi[2] * wm[2]


def compensated_dot(wi, wm):
    return stable.dot(wi, wm)


def plain_dot(wi, wm):
    return wi[0] * wm[0] + wi[1] * wm[1] + wi[2] * wm[2]


def pdf_printed(wm, wi, alpha):
    """G1(ω_i) max(0, ω_i·ω_m) D(ω_m)/z_i."""
    return g1_tangent(wi, alpha) * jnp.maximum(plain_dot(wi, wm), 0) * tangent(wm, alpha) / wi[2]


def pdf_plain_dot(wm, wi, alpha):
    """The library's with an ordinary dot product."""
    return jnp.maximum(plain_dot(wi, wm), 0) * ndf.ggx(wm, alpha) / slopes.sigma_ggx(wi, alpha)


def fresnel_printed(cos_i, eta):
    """Rs = (ηc − ct)/(ηc + ct), Rp = (c − ηct)/(c + ηct), from sin² = 1 − c²."""
    c = jnp.abs(cos_i)
    sin_square = eta * eta * (1 - c * c)
    ct = jnp.sqrt(jnp.maximum(1 - sin_square, 0))
    s, p = (eta * c - ct) / (eta * c + ct), (c - eta * ct) / (c + eta * ct)
    return jnp.where(sin_square >= 1, 1, (s * s + p * p) / 2)


def fresnel_plain_root(cos_i, eta):
    """The library's, with c_t² = 1 − η² + (ηc)² by an ordinary sum."""
    c, gap = jnp.abs(cos_i), (1 - eta) * (1 + eta)
    square = gap + (eta * c) ** 2
    ct = jnp.sqrt(jnp.maximum(square, 0))
    s, p = gap / (eta * c + ct) ** 2, gap * (c * c - eta * eta * (1 - c) * (1 + c)) / (c + eta * ct) ** 2
    return jnp.where(square <= 0, 1, (s * s + p * p) / 2)


def fresnel_schlick(cos_i, eta):
    """F0 + (1 − F0)(1 − c)^5, F0 from η."""
    return fresnel.schlick(cos_i, ((eta - 1) / (eta + 1)) ** 2)


PDF = (
    Variant("compensated dot", "ggxref.sampling.spherical_cap.pdf", spherical_cap.pdf),
    Variant("plain dot", "the same with an ordinary dot product", pdf_plain_dot),
    Variant("G1 D/z", "heitz2014 (2); Mitsuba 3, pbrt-v4", pdf_printed),
)
DOT = (
    Variant("compensated", "ggxref.stable.dot (Ogita, Rump & Oishi 2005)", compensated_dot),
    Variant("plain", "every renderer", plain_dot),
)
FRESNEL = (
    Variant("conjugate", "ggxref.fresnel.dielectric", fresnel.dielectric),
    Variant("conjugate, plain root", "the same with 1 − η² + (ηc)² by an ordinary sum", fresnel_plain_root),
    Variant("printed", "Walter et al. 2007 (22), PBR book", fresnel_printed),
    Variant("Schlick", "Schlick 1994", fresnel_schlick, approximate=True),
)

__all__ = ["DOT", "FRESNEL", "PDF", "exact_dot", "exact_fresnel", "exact_pdf", "fresnel_plain_root"]
