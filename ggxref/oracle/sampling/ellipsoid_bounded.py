"""Visible normals of the ellipsoid NDF from a cap without most of the reflections below the horizon.

With A canonical and o the reflection of wi about a unit m, o_z' + i_z' = (i_z + o_z) / (|A wi| |A^-T m|^2). Reflection
above the horizon needs theta_m <= t1 = (theta_i + 90 deg) / 2, and there |A^-T m|^2 is at most the Q of `_largest`.
"""

from flint import arb

from ggxref.oracle.ellipsoid import canonical, to_slopes
from ggxref.oracle.linalg import Matrix, Vec3, Vector, apply, dot, inverse_transpose, norm, normalise, square
from ggxref.oracle.precision import root, sign
from ggxref.oracle.sampling import sphere


def _least_square(scatter: Matrix) -> arb:
    """Square of the smaller singular value of C: the determinant of C C^T over its larger eigenvalue."""
    (xx, xy), (_, yy) = scatter
    return (xx * yy - square(xy)) / ((xx + yy + root(square(xx - yy) + 4 * square(xy))) / 2)


def _largest(wi: Vector, A: Matrix) -> arb:
    """Q = max over t in [0, t1] of q(t) = cos^2 t + (sin t + |e| cos t)^2 / c^2, c the smaller singular value of C.

    q = mean + b cos 2t + d sin 2t with d >= 0 climbs to its one maximum in [0, 90 deg] and falls, so that Q is q(t1) where
    q climbs at t1, else the maximum, which is q(0) if d = 0. cos 2 t1 = -sin theta_i, sin 2 t1 = cos theta_i.
    """
    (ex, ey), scatter = to_slopes(A)
    c2 = _least_square(scatter)
    x, y, z = normalise(wi)
    e, sin_i = norm((ex, ey, arb(0))), norm((x, y, arb(0)))
    at_0, at_90, d = 1 + square(e) / c2, 1 / c2, e / c2
    mean, b = (at_0 + at_90) / 2, (at_0 - at_90) / 2
    end, peak = mean - b * sin_i + d * z, at_0 if d == 0 else mean + root(square(b) + square(d))
    climb = -b * z - d * sin_i
    if climb > 0:
        return end
    # Where the balls leave it open, t1 is next to the maximum and the two are nearly the same.
    return peak if climb < 0 else end.union(peak)


def bound(wi: Vector, A: Matrix) -> arb:
    """Lower end of the cap: i_z / (|A wi| Q) - i_z', A canonical; -i_z' where wi is not above the horizon."""
    stretched = apply(canonical(A), wi)
    if sign(wi[2]) <= 0:
        return -stretched[2] / norm(stretched)
    return (wi[2] / _largest(wi, A) - stretched[2]) / norm(stretched)


def sample(u: Vector, wi: Vector, A: Matrix) -> Vec3:
    """`ellipsoid_cap.sample` with the cap's lower end at `bound`."""
    return sphere.half_in_cap(u, wi, bound(wi, A), canonical(A))


def _in_cap(wm: Vector, wi: Vector, A: Matrix) -> bool:
    """o_z' >= bound for a facing m: 2 (i.m) z_m / |A^-T m|^2 >= i_z / Q, A canonical."""
    if sign(wi[2]) <= 0:
        return True
    q = apply(inverse_transpose(canonical(A)), wm)
    return sign(2 * dot(wi, wm) * wm[2] * _largest(wi, A) - wi[2] * dot(q, q)) >= 0


def pdf(wm: Vector, wi: Vector, A: Matrix) -> arb:
    """The cap's uniform density times both Jacobians [1/sr]; 0 where m reflects wi out of the cap."""
    if not sphere.front(wm, wi) or not _in_cap(wm, wi, A):
        return arb(0)
    return sphere.uniform_half(wm, wi, bound(wi, A), canonical(A))
