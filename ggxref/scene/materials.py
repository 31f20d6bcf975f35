r"""Materials: a microfacet model of the library, its sampler, and the rows of parameters that it is given.

A `Kind` is what the compiler sees, a row of `Rows` what the material is; materials of one kind cost one evaluation.
Radiance is carried as L/n², which a refraction conserves, so that refraction needs no factor η² (heitz2014 §2.2).

In the local frame the known direction `wi` is above the horizon: seen from inside, the frame is turned about its x axis, and
the underside of the microsurface has the shape matrix A diag(−1, 1, 1).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from ggxref import bsdf, fresnel, geometry, jacobian, masking, ndf, sampling, stable
from ggxref._types import Scalar, Vec2, Vec3

Formula = Callable[..., Array]

NDFS = ("ggx", "beckmann", "ellipsoid")
G2S = ("separable", "height_correlated", "v_cavity")
FRESNELS = ("one", "schlick", "exact")

NORMALS = {
    "ggx": (sampling.normals.sample_ggx, sampling.normals.pdf_ggx),
    "beckmann": (sampling.normals.sample_beckmann, sampling.normals.pdf_beckmann),
}
VISIBLE = {
    "ggx": ("slope_ggx", "cross_section", "spherical_cap", "bounded_cap"),
    "beckmann": ("slope_beckmann",),
    "ellipsoid": ("lune", "ellipsoid_cap", "ellipsoid_bounded"),
}
BOUNDED = ("bounded_cap", "ellipsoid_bounded")
"""Samplers of reflections alone: they leave out micronormals that refraction needs."""


@dataclass(frozen=True)
class Kind:
    """What is compiled. More than one G2 or Fresnel form: the row's `g2` and `fresnel` number picks among them.

    - `surface`: "conductor" (any opaque microsurface), "dielectric" or "diffuse".
    - `dtype`: the formulas' own precision; the renderer's stays what it is.
    """

    surface: str = "conductor"
    ndf: str = "ggx"
    g2: tuple[str, ...] = ("height_correlated",)
    fresnel: tuple[str, ...] = ("exact",)
    sampler: str = "spherical_cap"
    diffuse: bool = False
    dtype: str = "float32"


class Rows(NamedTuple):
    """Parameters of the materials of one kind, the first axis counting them.

    - `alpha`: (n, 2); `A`: (n, 3, 3); `turn`: (n, 2), cosine and sine of the angle from the tangent to local x.
    - `eta`, `k`: (n,), index inside over outside; `f0`: (n,) for Schlick's form; `albedo`: (n,) of the diffuse part.
    """

    alpha: Array
    A: Array
    turn: Array
    eta: Array
    k: Array
    f0: Array
    albedo: Array
    g2: Array
    fresnel: Array


class Scatter(NamedTuple):
    """`wo`: unit, (3,); `value`: BSDF × |cos|; `pdf` [1/sr] of `wo`."""

    wo: Vec3
    value: Scalar
    pdf: Scalar


def samplers(kind: Kind) -> tuple[str, ...]:
    """The samplers that can draw this kind's micronormals."""
    plain = () if kind.ndf == "ellipsoid" else ("normals", "v_cavity")
    every = plain + VISIBLE[kind.ndf]
    return tuple(name for name in every if kind.surface == "conductor" or name not in BOUNDED)


def _shape(kind: Kind, row: Rows) -> Array:
    return row.A if kind.ndf == "ellipsoid" else row.alpha


def _draw(kind: Kind, row: Rows, u: Vec3, wi: Vec3) -> Vec3:
    if kind.sampler == "normals":
        return NORMALS[kind.ndf][0](u[:2], row.alpha)
    if kind.sampler == "v_cavity":
        return sampling.v_cavity.sample(u, wi, row.alpha, distribution=kind.ndf)  # pyright: ignore[reportArgumentType]
    return getattr(sampling, kind.sampler).sample(u[:2], wi, _shape(kind, row))


def _density(kind: Kind, row: Rows, wm: Vec3, wi: Vec3) -> Scalar:
    if kind.sampler == "normals":
        return NORMALS[kind.ndf][1](wm, row.alpha)
    if kind.sampler == "v_cavity":
        return sampling.v_cavity.pdf(wm, wi, row.alpha, distribution=kind.ndf)  # pyright: ignore[reportArgumentType]
    return getattr(sampling, kind.sampler).pdf(wm, wi, _shape(kind, row))


def _pick(names: tuple[str, ...], number: Array, values: dict[str, Formula]) -> Scalar:
    """The one form that the kind has, or the one of several that the row names."""
    value = values[names[0]]()
    for k, name in enumerate(names[1:], start=1):
        value = jnp.where(number == k, values[name](), value)
    return value


def _g2(kind: Kind, row: Rows, wi: Vec3, wo: Vec3, wm: Vec3) -> Scalar:
    g1: Formula = getattr(masking, f"g1_{kind.ndf}")
    shape = _shape(kind, row)
    # The height-correlated form is of reflection; transmission takes the product (heitz2014 §2.1).
    forms: dict[str, Formula] = {
        "separable": lambda: masking.g2_separable(g1(wi, wm, shape), g1(wo, wm, shape)),
        "height_correlated": lambda: jnp.where(
            wo[2] > 0,
            masking.g2_height_correlated(g1(wi, wm, shape), g1(wo, wm, shape)),
            masking.g2_separable(g1(wi, wm, shape), g1(wo, wm, shape)),
        ),
        "v_cavity": lambda: masking.g2_v_cavity(wi, wo, wm),
    }
    return _pick(kind.g2, row.g2, forms)


def _fresnel(kind: Kind, row: Rows, cosine: Scalar) -> Scalar:
    if kind.surface == "dielectric":
        return fresnel.dielectric(cosine, 1 / row.eta)
    forms: dict[str, Formula] = {
        "one": lambda: row.f0 * jnp.ones_like(cosine),
        "schlick": lambda: fresnel.schlick(cosine, row.f0),
        "exact": lambda: fresnel.conductor(cosine, row.eta, row.k),
    }
    return _pick(kind.fresnel, row.fresnel, forms)


def seen_from_below(row: Rows) -> Rows:
    """The row for rays inside: the underside of its microsurface, the index inverted."""
    A = jnp.stack([jnp.stack([-a[0], a[1], a[2]]) for a in row.A])
    return row._replace(A=A, eta=1 / row.eta)


def _diffuse_share(row: Rows) -> Scalar:
    return row.albedo / (row.albedo + row.f0 + 1e-3)


def _at(kind: Kind, row: Rows, wi: Vec3, wo: Vec3, wm: Vec3) -> tuple[Scalar, Scalar]:
    """BSDF × |cos| and pdf of the micronormal's part, both 0 on a side that it does not reach."""
    i_m, o_m = stable.cosine(wi, wm), stable.cosine(wo, wm)
    D, F = getattr(ndf, kind.ndf)(wm, _shape(kind, row)), _fresnel(kind, row, i_m)
    g2, density = _g2(kind, row, wi, wo, wm), _density(kind, row, wm, wi)
    mirrored = (wo[2] > 0) & (i_m > 0)
    value = jnp.where(mirrored, bsdf.brdf(wi, wo, D, g2, F), 0)
    pdf = jnp.where(mirrored & (o_m > 0), density * jacobian.reflection(wo, wm), 0)
    if kind.surface == "dielectric":
        through = (wo[2] < 0) & (i_m > 0) & (o_m < 0) & (F < 1)
        n_i, n_o = jnp.ones_like(row.eta), row.eta
        value = jnp.where(through, bsdf.btdf(wi, wo, n_i, n_o, D, g2, F), value)
        jacobian_through = jacobian.refraction(wi, wo, wm, n_i, n_o)
        pdf = jnp.where(through, density * (1 - F) * jacobian_through, pdf * F)
    return value * jnp.abs(wo[2]), pdf


def _with_diffuse(kind: Kind, row: Rows, wo: Vec3, value: Scalar, pdf: Scalar) -> tuple[Scalar, Scalar]:
    if not kind.diffuse:
        return value, pdf
    share, cosine = _diffuse_share(row), jnp.maximum(wo[2], 0) / math.pi
    return value + row.albedo * cosine, (1 - share) * pdf + share * cosine


def evaluate(kind: Kind, row: Rows, wi: Vec3, wo: Vec3) -> tuple[Scalar, Scalar]:
    """BSDF × |cos θo| and pdf of the pair, `wi` above the horizon. Units: 1/sr both."""
    if kind.surface == "diffuse":
        cosine = jnp.maximum(wo[2], 0) / math.pi
        return row.albedo * cosine, cosine
    dtype = wi.dtype
    row, wi, wo = _cast(kind, row, wi, wo)
    wm = geometry.half_reflection(wi, wo)
    if kind.surface == "dielectric":
        across = geometry.half_refraction(wi, wo, jnp.ones_like(row.eta), row.eta)
        wm = jnp.where(wo[2] > 0, wm, across)
    value, pdf = _with_diffuse(kind, row, wo, *_at(kind, row, wi, wo, wm))
    return value.astype(dtype), pdf.astype(dtype)


def _cast(kind, row, *directions):
    """Parameters and directions in the formulas' dtype."""
    whole = ("g2", "fresnel")
    row = row._replace(**{k: v.astype(kind.dtype) for k, v in row._asdict().items() if k not in whole})
    return row, *(w.astype(kind.dtype) for w in directions)


def cosine_lobe(u: Vec2) -> Vec3:
    """A direction with density cos θ/π: unit, (3,)."""
    c, s = stable.cos_sin_turn(u[0])
    r = stable.sqrt(u[1])
    return jnp.stack([r * c, r * s, stable.sqrt(1 - u[1])])


def sample(kind: Kind, row: Rows, u: Array, wi: Vec3) -> Scatter:
    """Draw `wo` for `wi` above the horizon. `u`: in [0, 1)⁴, (4,): three for the sampler, one for the choice of the lobe."""
    if kind.surface == "diffuse":
        wo = cosine_lobe(u[:2])
        return Scatter(wo, *evaluate(kind, row, wi, wo))
    dtype = wi.dtype
    row, wi = _cast(kind, row, wi)
    # Half precision has no 24 bits to hold u, and 1 is not in the range.
    below_one = 1 - float(jnp.finfo(kind.dtype).epsneg)
    u = jnp.minimum(u.astype(kind.dtype), below_one)
    wm = _draw(kind, row, u[:3], wi)
    wo = geometry.reflect(wi, wm)
    if kind.surface == "dielectric":
        F = _fresnel(kind, row, stable.cosine(wi, wm))
        wo = jnp.where(u[3] < F, wo, geometry.refract(wi, wm, 1 / row.eta))
    if kind.diffuse:
        wo = jnp.where(u[3] < _diffuse_share(row), cosine_lobe(u[:2]), wo)
        wm = geometry.half_reflection(wi, wo)
    value, pdf = _with_diffuse(kind, row, wo, *_at(kind, row, wi, wo, wm))
    return Scatter(wo.astype(dtype), value.astype(dtype), pdf.astype(dtype))
