"""Visible normals of the ellipsoid NDF through the silhouette of a lune: walter2014 section 4, versions 1 to 3."""

from collections.abc import Sequence

from flint import arb

from ggxref.oracle import ellipsoid, ndf
from ggxref.oracle.geometry import basis
from ggxref.oracle.linalg import (
    ONE,
    ZERO,
    Matrix,
    N,
    Vec3,
    Vector,
    add,
    apply,
    cross,
    determinant,
    dot,
    normalise,
    scale,
    transpose,
)
from ggxref.oracle.precision import root, sign
from ggxref.oracle.sampling import sphere


def _concentric(u: Vector) -> tuple[arb, arb]:
    """Point of the unit disk. walter2014 (34)-(37)."""
    a, b = 2 * u[0] - 1, 2 * u[1] - 1
    if a == 0 and b == 0:
        return ZERO, ZERO
    if abs(a) > abs(b):
        sin, cos = (b / (4 * a)).sin_cos_pi()
        return a * cos, a * sin
    sin, cos = (a / (4 * b)).sin_cos_pi()
    return b * sin, b * cos


def sample(u: Vector, wi: Vector, A: Matrix) -> Vec3:
    """Version 3: the disk compressed to the crescent, lifted to the sphere, mapped to the ellipsoid. walter2014 (34)-(46).

    Where wi = n, e1 and e2 are the first two rows of `geometry.basis(e3)`.
    """
    xa, ya = _concentric(u)
    Ai, An = apply(A, wi), apply(A, N)
    e3, across = normalise(Ai), cross(Ai, An)
    if all(part == 0 for part in across):
        e1, e2, _ = basis(e3)
        s = ONE if sign(dot(Ai, An)) > 0 else ZERO
    else:
        e2 = normalise(across)
        e1 = cross(e2, e3)
        s = (1 + dot(e3, normalise(An))) / 2
    xb = s * xa + (1 - s) * root(1 - ya**2)
    zb = root(1 - xb**2 - ya**2)
    p = add(scale(xb, e1), scale(ya, e2), scale(zb, e3))
    return normalise(apply(transpose(A), p))


def pdf(wm: Vector, wi: Vector, A: Matrix) -> arb:
    """A_e(n) / A_l(wi, n) chi+(m.wi) D(m) |m.wi| [1/sr]. walter2014 (33)."""
    if not sphere.front(wm, wi):
        return arb(0)
    visible = ellipsoid.projected_area(N, A, ONE) / ellipsoid.lune_area(wi, N, A, ONE)
    return visible * ndf.ellipsoid(wm, A) * dot(normalise(wi), normalise(wm))


def _disk(u: Vector) -> tuple[arb, arb]:
    (sin, cos), r = (2 * u[0]).sin_cos_pi(), u[1].sqrt()
    return r * cos, r * sin


def sample_rejection_ellipsoid(u: Sequence[Vector], wi: Vector, A: Matrix) -> tuple[Vec3, arb]:
    """Version 2: (m, tries) of the first row of u whose point of the sphere-space silhouette lies on the lune.

    The disk's axes are the first two rows of `geometry.basis(A wi)`. (zero vector, 0) where every row fails.
    """
    t, b, e3 = basis(apply(A, wi))
    for tries, row in enumerate(u, start=1):
        x, y = _disk(row)
        p = add(scale(x, t), scale(y, b), scale((1 - row[1]).sqrt(), e3))
        m = apply(transpose(A), p)
        if sign(m[2]) > 0:
            return normalise(m), arb(tries)
    return (ZERO, ZERO, ZERO), ZERO


def _longest_half_axis(A: Matrix) -> arb:
    """1 / the smallest singular value of A: the square root of the largest eigenvalue of (A^T A)^-1, in closed form."""
    (a, b, c), (_, d, e), (_, _, f) = ellipsoid.sggx(A)
    adjugate = (
        (d * f - e * e, c * e - b * f, b * e - c * d),
        (ZERO, a * f - c * c, b * c - a * e),
        (ZERO, ZERO, a * d - b * b),
    )
    det = determinant(A) ** 2
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = (tuple(part / det for part in row) for row in adjugate)
    q = (xx + yy + zz) / 3
    p = root(((xx - q) ** 2 + (yy - q) ** 2 + (zz - q) ** 2 + 2 * (xy**2 + xz**2 + yz**2)) / 6)
    if p == 0:
        return q.sqrt()
    r = determinant(((xx - q, xy, xz), (xy, yy - q, yz), (xz, yz, zz - q))) / (2 * p**3)
    angle = r.min(ONE).max(-ONE).acos() / 3
    return (q + 2 * p * angle.cos()).sqrt()


def sample_rejection_sphere(u: Sequence[Vector], wi: Vector, A: Matrix) -> tuple[Vec3, arb]:
    """Version 1: (m, tries) of the first row of u whose ray along -wi, through the bounding sphere's silhouette, meets
    the lune. The disk's axes are the first two rows of `geometry.basis(wi)`.
    """
    t, b, i = basis(wi)
    radius, Ai = _longest_half_axis(A), apply(A, i)
    for tries, row in enumerate(u, start=1):
        x, y = _disk(row)
        q = apply(A, add(scale(radius * x, t), scale(radius * y, b)))
        # |A (point + along i)|^2 = 1: the root nearer to the viewer.
        square, half, rest = dot(Ai, Ai), dot(Ai, q), dot(q, q) - 1
        discriminant = half**2 - square * rest
        if sign(discriminant) < 0:
            continue
        along = (discriminant.sqrt() - half) / square
        m = apply(transpose(A), add(q, scale(along, Ai)))
        if sign(m[2]) > 0:
            return normalise(m), arb(tries)
    return (ZERO, ZERO, ZERO), ZERO
