"""Visible normals of the ellipsoid NDF from a uniform spherical cap: dupuy2023's method after a linear map."""

from ggxref import stable
from ggxref._types import Mat3, Turn, Vec2, Vec3
from ggxref.ellipsoid import canonical
from ggxref.sampling._sphere import Incident, half_in_cap, incident
from ggxref.sampling._visible import pdf_ellipsoid as pdf

__all__ = ["pdf", "sample"]


def to_sphere(wi: Vec3, canonical_A: Mat3) -> Incident:
    """`A wi` for a canonical `A`, as the sphere-space direction."""
    (c00, c10, _), (_, c11, _), (ex, ey, _) = canonical_A
    return incident(c00 * wi[0] + c10 * wi[1], c11 * wi[1], ex * wi[0] + ey * wi[1] + wi[2])


def from_sphere(x, y, z, canonical_A: Mat3) -> Vec3:
    """The micronormal along `Aᵀ (x, y, z)` for a canonical `A`: unit, (3,). Its height is z's sign, exactly."""
    (c00, c10, _), (_, c11, _), (ex, ey, _) = canonical_A
    return stable.direction(c00 * x + ex * z, c10 * x + c11 * y + ey * z, z)


def sample(u: Vec2, wi: Vec3, A: Mat3, *, turn: Turn = stable.cos_sin_turn) -> Vec3:
    r"""With `A` in canonical form, $\omega_m \propto A^T(o' + i')$, $i' = A\omega_i/\|A\omega_i\|$, `o'` uniform on $\{z > -i_z'\}$.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), anywhere but where A ω_i points straight below.
    - `turn`: the form of cos 2πu and sin 2πu.
    - `A`: shape matrix, (3, 3), non-singular. Returns a micronormal with density `pdf`: unit, (3,), above the horizon.

    dupuy2023 listing 3 under walter2014 (24): in sphere space the reflections of the half sphere about A n fill a cap.
    """
    A = canonical(A)
    return from_sphere(*half_in_cap(u, to_sphere(wi, A), 0, turn), A)
