"""Visible normals of the ellipsoid NDF from a cap without most of the reflections below the horizon.

With A canonical and o the reflection of wi about a unit m, o_z' + i_z' = (i_z + o_z) / (|A wi| |A^-T m|^2). Reflection
above the horizon needs theta_m <= t1 = (theta_i + 90 deg) / 2, and there |A^-T m|^2 is at most the Q of `_largest`.
"""

from flint import arb

from ggxref.oracle.ellipsoid import canonical
from ggxref.oracle.linalg import Mat3, Matrix, Vec3, Vector, apply, dot, inverse_transpose, norm, normalise
from ggxref.oracle.precision import root, sign
from ggxref.oracle.sampling import sphere


def _least_square(A: Matrix) -> arb:
    """Square of the smaller singular value of C: the determinant of C C^T over its larger eigenvalue."""
    (c00, c10, _), (_, c11, _), _ = A
    xx, xy, yy = c00**2, c00 * c10, c10**2 + c11**2
    return (c00 * c11) ** 2 / ((xx + yy + root((xx - yy) ** 2 + 4 * xy**2)) / 2)


def _largest(wi: Vector, A: Matrix) -> arb:
    """Q = max over t in [0, t1] of q(t) = cos^2 t + (sin t + |e| cos t)^2 / c^2, c the smaller singular value of C.

    q = mean + b cos 2t + d sin 2t with d >= 0 climbs to its one maximum in [0, 90 deg] and falls, so that Q is q(t1) where
    q climbs at t1, else the maximum. cos 2 t1 = -sin theta_i, sin 2 t1 = cos theta_i.
    """
    (ex, ey, _), c2 = A[2], _least_square(A)
    x, y, z = normalise(wi)
    e, sin_i = norm((ex, ey, arb(0))), norm((x, y, arb(0)))
    at_0, at_90, d = 1 + e**2 / c2, 1 / c2, e / c2
    mean, b = (at_0 + at_90) / 2, (at_0 - at_90) / 2
    end, peak = mean - b * sin_i + d * z, mean + root(b**2 + d**2)
    climb = -b * z - d * sin_i
    if climb > 0:
        return end
    # Where the balls leave it open, t1 is next to the maximum and the two are nearly the same.
    return peak if climb < 0 else end.union(peak)


def _lower(wi: Vector, A: Mat3) -> arb:
    stretched = apply(A, normalise(wi))
    i, length = normalise(stretched), norm(stretched)
    if sign(wi[2]) <= 0:
        return -i[2]
    return normalise(wi)[2] / (length * _largest(wi, A)) - i[2]


def bound(wi: Vector, A: Matrix) -> arb:
    """Lower end of the cap: i_z / (|A wi| Q) - i_z'; -i_z' where wi is not above the horizon."""
    return _lower(wi, canonical(A))


def sample(u: Vector, wi: Vector, A: Matrix) -> Vec3:
    """`ellipsoid_cap.sample` with the cap's lower end at `bound`."""
    A = canonical(A)
    return sphere.half_in_cap(u, wi, _lower(wi, A), A)


def _in_cap(wm: Vector, wi: Vector, A: Matrix) -> bool:
    """o_z' >= bound for a facing m: 2 (i.m) z_m / |A^-T m|^2 >= i_z / Q."""
    if sign(wi[2]) <= 0:
        return True
    i, m = normalise(wi), normalise(wm)
    q = apply(inverse_transpose(A), m)
    return sign(2 * dot(i, m) * m[2] * _largest(wi, A) - i[2] * dot(q, q)) >= 0


def pdf(wm: Vector, wi: Vector, A: Matrix) -> arb:
    """The cap's uniform density times both Jacobians [1/sr]; 0 where m reflects wi out of the cap."""
    A = canonical(A)
    if not sphere.front(wm, wi) or not _in_cap(wm, wi, A):
        return arb(0)
    return sphere.uniform_half(wm, wi, _lower(wi, A), A)
