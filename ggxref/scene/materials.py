r"""Materials: a microfacet model of the library, its sampler, and the rows of parameters that it is given.

A `Kind` is what the compiler sees, a row of `Rows` what the material is; materials of one kind cost one evaluation.
Radiance is carried as L/n², which a refraction conserves, so that refraction needs no factor η² (heitz2014 §2.2).

In the local frame the known direction `wi` is above the horizon. Seen from inside, all three axes of the frame are reversed:
the underside of a microsurface has the normals −ωm, so that it keeps its shape matrix.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array, lax

from ggxref import _special, bsdf, fresnel, geometry, jacobian, masking, ndf, sampling, stable
from ggxref._types import Scalar, Turn, Vec2, Vec3

Formula = Callable[..., Array]

NDFS = ("ggx", "beckmann", "ellipsoid")
G2S = ("separable", "height_correlated", "v_cavity")
G2_OF_G1 = {"separable": masking.g2_separable, "height_correlated": masking.g2_height_correlated}
FRESNELS = ("one", "schlick", "exact")
TURNS = {
    "2 terms": lambda u: _special.cos_sin_turn(u, 2),
    "3 terms": lambda u: _special.cos_sin_turn(u, 3),
    "exact": _special.cos_sin_turn,
}
"""Forms of cos 2πu and sin 2πu in a sampler: Taylor polynomials on an eighth of a turn, the last to the dtype's precision."""
PRECISIONS = {"bfloat16": (8, 7), "float16": (5, 10), "float32": (8, 23)}
"""Bits of exponent and mantissa with which a material's parameters, directions, values and densities are stored.

What is done with them is done in float32: half precision that is fast is another machine's, what it loses is not.
"""

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
TURNING = ("normals", "cross_section", "spherical_cap", "bounded_cap", "ellipsoid_cap", "ellipsoid_bounded")
"""Samplers that turn u into an azimuth, by any of `TURNS`."""


@dataclass(frozen=True)
class Kind:
    """What is compiled. More than one form of G2, Fresnel, trigonometry or precision: the row's number picks among them.

    - `surface`: "conductor" (any opaque microsurface), "dielectric" or "diffuse".
    """

    surface: str = "conductor"
    ndf: str = "ggx"
    g2: tuple[str, ...] = ("height_correlated",)
    fresnel: tuple[str, ...] = ("exact",)
    sampler: str = "spherical_cap"
    diffuse: bool = False
    trigonometry: tuple[str, ...] = ("exact",)
    precision: tuple[str, ...] = ("float32",)


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
    trigonometry: Array
    precision: Array


FRESNEL_FORMS: dict[str, Formula] = {
    "one": lambda row, cosine: row.f0 * jnp.ones_like(cosine),
    "schlick": lambda row, cosine: fresnel.schlick(cosine, row.f0),
    "exact": lambda row, cosine: fresnel.conductor(cosine, row.eta, row.k),
}
FORMS = ("g2", "fresnel", "trigonometry", "precision")
"""The fields of `Rows` that number the forms of a kind."""


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
        return NORMALS[kind.ndf][0](u[:2], row.alpha, turn=_turn(kind, row))
    if kind.sampler == "v_cavity":
        return sampling.v_cavity.sample(u, wi, row.alpha, distribution=kind.ndf)  # pyright: ignore[reportArgumentType]
    form = {"turn": _turn(kind, row)} if kind.sampler in TURNING else {}
    return getattr(sampling, kind.sampler).sample(u[:2], wi, _shape(kind, row), **form)


def _turn(kind: Kind, row: Rows) -> Turn:
    def turn(u):
        forms = [TURNS[name](u) for name in kind.trigonometry]
        cos, sin = (dict(zip(kind.trigonometry, form, strict=True)) for form in zip(*forms, strict=True))
        return _pick(kind.trigonometry, row.trigonometry, cos), _pick(kind.trigonometry, row.trigonometry, sin)

    return turn


def _density(kind: Kind, row: Rows, wm: Vec3, wi: Vec3) -> Scalar:
    if kind.sampler == "normals":
        return NORMALS[kind.ndf][1](wm, row.alpha)
    if kind.sampler == "v_cavity":
        return sampling.v_cavity.pdf(wm, wi, row.alpha, distribution=kind.ndf)  # pyright: ignore[reportArgumentType]
    return getattr(sampling, kind.sampler).pdf(wm, wi, _shape(kind, row))


def _pick(names: tuple[str, ...], number: Array, values: dict[str, Array]) -> Array:
    """The one form that the kind has, or the one of several that the row names."""
    value = values[names[0]]
    for k, name in enumerate(names[1:], start=1):
        value = jnp.where(number == k, values[name], value)
    return value


def _g2(kind: Kind, row: Rows, wi: Vec3, wo: Vec3, wm: Vec3) -> Scalar:
    if kind.g2 == ("v_cavity",):
        return masking.g2_v_cavity(wi, wo, wm)
    g1: Formula = getattr(masking, f"g1_{kind.ndf}")
    g1_i, g1_o = g1(wi, wm, _shape(kind, row)), g1(wo, wm, _shape(kind, row))
    forms = {name: form(g1_i, g1_o) for name, form in G2_OF_G1.items()}
    # The height-correlated form is of reflection; transmission takes the product (heitz2014 §2.1).
    return jnp.where(wo[2] > 0, _pick(kind.g2, row.g2, forms), forms["separable"])


def _fresnel(kind: Kind, row: Rows, cosine: Scalar) -> Scalar:
    if kind.surface == "dielectric":
        return fresnel.dielectric(cosine, 1 / row.eta)
    return _pick(kind.fresnel, row.fresnel, {name: FRESNEL_FORMS[name](row, cosine) for name in kind.fresnel})


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
    row, (wi, wo) = _given(kind, row), (_direction(kind, row, w) for w in (wi, wo))
    wm = geometry.half_reflection(wi, wo)
    if kind.surface == "dielectric":
        across = geometry.half_refraction(wi, wo, jnp.ones_like(row.eta), row.eta)
        wm = stable.either(wo[2] > 0, wm, across)
    value, pdf = _with_diffuse(kind, row, wo, *_at(kind, row, wi, wo, wm))
    return _rounded(kind, row, value), _rounded(kind, row, pdf)


def _rounded(kind: Kind, row: Rows, x: Array) -> Array:
    """`x` as the kind's precision, or the one of several that the row names, stores it."""
    return _pick(
        kind.precision, row.precision, {name: lax.reduce_precision(x, *PRECISIONS[name]) for name in kind.precision}
    )


def _given(kind: Kind, row: Rows) -> Rows:
    return row._replace(**{k: _rounded(kind, row, v) for k, v in row._asdict().items() if k not in FORMS})


def _direction(kind: Kind, row: Rows, w: Vec3) -> Vec3:
    """A direction that was stored, and made unit again."""
    return w if kind.precision == ("float32",) else stable.direction(*_rounded(kind, row, w))


def cosine_lobe(u: Vec2) -> Vec3:
    """A direction with density cos θ/π: unit, (3,)."""
    c, s = _special.cos_sin_turn(u[0])
    r = stable.sqrt(u[1])
    return jnp.stack([r * c, r * s, stable.sqrt(1 - u[1])])


def sample(kind: Kind, row: Rows, u: Array, wi: Vec3) -> Scatter:
    """Draw `wo` for `wi` above the horizon. `u`: in [0, 1)⁴, (4,): three for the sampler, one for the choice of the lobe."""
    if kind.surface == "diffuse":
        wo = cosine_lobe(u[:2])
        return Scatter(wo, *evaluate(kind, row, wi, wo))
    row, wi = _given(kind, row), _direction(kind, row, wi)
    wm = _draw(kind, row, u[:3], wi)
    wo = geometry.reflect(wi, wm)
    if kind.surface == "dielectric":
        F = _fresnel(kind, row, stable.cosine(wi, wm))
        wo = stable.either(u[3] < F, wo, geometry.refract(wi, wm, 1 / row.eta))
    if kind.diffuse:
        wo = stable.either(u[3] < _diffuse_share(row), cosine_lobe(u[:2]), wo)
        wm = geometry.half_reflection(wi, wo)
    value, pdf = _with_diffuse(kind, row, wo, *_at(kind, row, wi, wo, wm))
    return Scatter(_direction(kind, row, wo), _rounded(kind, row, value), _rounded(kind, row, pdf))
