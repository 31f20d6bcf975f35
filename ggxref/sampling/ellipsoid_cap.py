"""Visible normals of the ellipsoid NDF from a uniform spherical cap: dupuy2023's method after a linear map."""

import jax.numpy as jnp

from ggxref import _pairs, _special, stable
from ggxref._types import Mat3, Real, Scalar, Turn, Vec2, Vec3
from ggxref.ellipsoid import Canonical, canonical_terms, length, reciprocal_scale
from ggxref.sampling._sphere import half_in_cap, ray, ray_factor
from ggxref.sampling._visible import pdf_ellipsoid as pdf

__all__ = ["pdf", "sample"]


def to_sphere(wi: Vec3, A: Canonical) -> tuple[Scalar, Scalar, Scalar]:
    """`A wi` for a canonical `A`: along the sphere-space direction. Its sums cancel as soon as `A` is skewed."""
    c00, c10, c11, ex, ey = A
    x, y, z = wi
    horizontal = _pairs.rounded(_pairs.dot((c00, c10), (x, y)))
    return horizontal, c11 * y, _pairs.rounded(_pairs.dot((ex, ey, jnp.ones_like(z)), (x, y, z)))


def half_vector(u: Vec2, wi: Vec3, A: Canonical, cut: Real, turn: Turn) -> tuple[Scalar, Scalar, Scalar]:
    """`half_in_cap` about `A wi`, which is as long as α: shortened to about 1, as Aᵀ makes it longer by α once more.

    - `cut`: in units of the length of `A wi`.
    """
    i = to_sphere(wi, A)
    scale = reciprocal_scale(jnp.maximum(jnp.maximum(jnp.abs(i[0]), jnp.abs(i[1])), jnp.abs(i[2])))
    x, y, z = (c * scale for c in i)
    cut = stable.relative(cut * scale, length(x, y, z))
    x, y, z = stable.turning(x, y, z)
    return stable.one_loop(*half_in_cap(u, ray(x, y, z), cut * ray_factor(x, y, z), turn))


def from_sphere(x: Scalar, y: Scalar, z: Scalar, A: Canonical) -> Vec3:
    """The micronormal along `Aᵀ (x, y, z)` for a canonical `A`: unit, (3,). Its height is z's sign, exactly."""
    c00, c10, c11, ex, ey = A
    image = _pairs.dot((c00, ex), (x, z)), _pairs.dot((c10, c11, ey), (x, y, z))
    return stable.direction(*map(_pairs.rounded, image), z)


@stable.widened
def sample(u: Vec2, wi: Vec3, A: Mat3, *, turn: Turn = _special.cos_sin_turn) -> Vec3:
    r"""With `A` in canonical form, $\omega_m \propto A^T(o' + i')$, $i' = A\omega_i/\|A\omega_i\|$, `o'` uniform on $\{z > -i_z'\}$.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), anywhere but where A ω_i points straight below.
    - `turn`: the form of cos 2πu and sin 2πu.
    - `A`: shape matrix, (3, 3), non-singular. Returns a micronormal with density `pdf`: unit, (3,), above the horizon.

    dupuy2023 listing 3 under walter2014 (24): in sphere space the reflections of the half sphere about A n fill a cap.
    """
    terms = canonical_terms(A)
    return from_sphere(*half_vector(u, wi, terms, 0, turn), terms)
