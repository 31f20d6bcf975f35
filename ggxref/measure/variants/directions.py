"""Forms of the samplers' maps and of the trigonometry in them: directions, graded by the norm of their error."""

import math

import jax.numpy as jnp

from ggxref import _special
from ggxref.measure.doubledouble import cos_sin_turn
from ggxref.measure.reference import REFERENCES
from ggxref.measure.variants.form import Variant
from ggxref.sampling import cross_section, spherical_cap
from ggxref.sampling._sphere import ray, sum_in_cap, unstretch

exact_cap = REFERENCES["sampling.spherical_cap.sample"]
exact_cross_section = REFERENCES["sampling.cross_section.sample"]


def exact_turn(x):
    return cos_sin_turn(x)


def turn_ours(x):
    return jnp.stack(_special.cos_sin_turn(x))


def turn_library(x):
    return jnp.stack([jnp.cos(2 * math.pi * x), jnp.sin(2 * math.pi * x)])


def _polynomial(terms):
    """Taylor polynomials with so many terms each, on an eighth of a turn."""
    return lambda x: jnp.stack(_special.cos_sin_turn(x, terms))


def _unit(x, y, z):
    v = jnp.stack([x, y, z])
    return v / jnp.linalg.norm(v)


def cap_uncorrected(u, wi, alpha):
    """The half vector as the plain sum, which loses its digits at the rim of the cap."""
    h = sum_in_cap(u, ray(alpha[0] * wi[0], alpha[1] * wi[1], wi[2]), 0)
    return unstretch(h.x, h.y, h.z, alpha)


def cap_printed(u, wi, alpha):
    """dupuy2023 listings 1 and 3 (line 8 of listing 1 corrected), with library trigonometry."""
    x, y, z = _unit(alpha[0] * wi[0], alpha[1] * wi[1], wi[2])
    phi = 2 * math.pi * u[0]
    c = (1 - u[1]) * (1 + z) - z
    s = jnp.sqrt(jnp.clip(1 - c * c, 0, 1))
    return _unit(alpha[0] * (s * jnp.cos(phi) + x), alpha[1] * (s * jnp.sin(phi) + y), c + z)


def cross_section_printed(u, wi, alpha):
    """dupuy2023 listings 1 and 2 (line 8 of listing 1 corrected), with library trigonometry."""
    i = _unit(alpha[0] * wi[0], alpha[1] * wi[1], wi[2])
    flat = i[0] * i[0] + i[1] * i[1]
    scale = 1 / jnp.sqrt(jnp.where(flat > 0, flat, 1))
    zero, one = jnp.zeros_like(flat), jnp.ones_like(flat)
    w1 = jnp.where(flat > 0, jnp.stack([-i[1] * scale, i[0] * scale, zero]), jnp.stack([one, zero, zero]))
    w2 = jnp.cross(i, w1)
    phi, r = 2 * math.pi * u[0], jnp.sqrt(u[1])
    t1, t2 = r * jnp.cos(phi), r * jnp.sin(phi)
    s = (1 + i[2]) / 2
    t2 = (1 - s) * jnp.sqrt(1 - t1 * t1) + s * t2
    m = t1 * w1 + t2 * w2 + jnp.sqrt(jnp.maximum(0, 1 - t1 * t1 - t2 * t2)) * i
    return _unit(alpha[0] * m[0], alpha[1] * m[1], jnp.maximum(0, m[2]))


TURN = (
    Variant("polynomial", "ggxref._special.cos_sin_turn", turn_ours),
    Variant("library", "cos and sin of 2πu in the working precision", turn_library),
    Variant("4 terms", "Taylor, x⁷ and x⁶", _polynomial(4)),
    Variant("3 terms", "Taylor, x⁵ and x⁴", _polynomial(3)),
)
CAP = (
    Variant("corrected", "ggxref.sampling.spherical_cap.sample", spherical_cap.sample),
    Variant("plain sum", "ggxref.sampling.spherical_cap.sample without the correction of o' + i'", cap_uncorrected),
    Variant("printed", "dupuy2023 listing 3", cap_printed),
)
CROSS_SECTION = (
    Variant("no cancellation", "ggxref.sampling.cross_section.sample", cross_section.sample),
    Variant("printed", "dupuy2023 listing 2 (Heitz 2018)", cross_section_printed),
)
