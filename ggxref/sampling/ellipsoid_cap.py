"""Visible normals of the ellipsoid NDF from a uniform spherical cap: dupuy2023's method after a linear map."""

from ggxref import stable
from ggxref._canonical import canonical_terms
from ggxref._types import Mat3, Turn, Vec2, Vec3
from ggxref.sampling._cap import half_vector
from ggxref.sampling._ellipsoid import from_sphere
from ggxref.sampling._visible import pdf_ellipsoid as pdf

__all__ = ["pdf", "sample"]


@stable.widened
def sample(u: Vec2, wi: Vec3, A: Mat3, *, turn: Turn | None = None) -> Vec3:
    r"""With `A` in canonical form, $\omega_m \propto A^T(o' + i')$, $i' = A\omega_i/\|A\omega_i\|$, `o'` uniform on $\{z > -i_z'\}$.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), anywhere but where A ω_i points straight below.
    - `turn`: a form of cos 2πu and sin 2πu, in one word; else in two.
    - `A`: shape matrix, (3, 3), non-singular. Returns a micronormal with density `pdf`: unit, (3,), above the horizon.

    dupuy2023 listing 3 under walter2014 (24): in sphere space the reflections of the half sphere about A n fill a cap.
    """
    terms = canonical_terms(A)
    return from_sphere(half_vector(u, wi, terms, 0, turn), terms)
