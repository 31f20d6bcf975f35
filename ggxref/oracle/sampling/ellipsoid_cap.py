"""Visible normals of the ellipsoid NDF through a spherical cap, in the canonical form of A. design.md."""

from flint import arb

from ggxref.oracle.ellipsoid import canonical
from ggxref.oracle.linalg import Matrix, Vec3, Vector
from ggxref.oracle.sampling import sphere


def sample(u: Vector, wi: Vector, A: Matrix) -> Vec3:
    """m = A^T (o' + i') normalised, o' uniform on the cap z > -i_z', i' = A wi / |A wi|, A canonical."""
    A = canonical(A)
    return sphere.half_in_cap(u, wi, -sphere.incident(wi, A)[2], A)


def pdf(wm: Vector, wi: Vector, A: Matrix) -> arb:
    """The density of visible normals [1/sr]: dupuy2023 (1) with A canonical for M^-1."""
    return sphere.visible(wm, wi, canonical(A))
