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
    cosine,
    cross,
    determinant,
    dot,
    norm,
    normalise,
    scale,
    square,
    transpose,
)
from ggxref.oracle.precision import exactly, root, sign
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

    Where wi = n, e1 and e2 are the first two rows of `geometry.basis(e3)`. A^T is applied before the axes are normalised:
    a component that it takes to 0 is then known to be 0.
    """
    xa, ya = _concentric(u)
    e3, An = apply(A, wi), apply(A, N)
    if wi[0] == 0 and wi[1] == 0:
        s, (e1, e2, e3) = ONE, basis(sphere.incident(wi, A))
    else:
        s = (1 + cosine(e3, An)) / 2
        e2 = cross(e3, An)
        e1 = cross(e2, e3)
    rim = 0 in u
    xb = s * xa + (1 - s) * (abs(xa) if rim else root(1 - square(ya)))
    # The rim's far half stays the sphere's silhouette; its near half becomes the lune's edge, where m is horizontal.
    zb = ZERO if rim and xa > 0 else root(1 - square(xb) - square(ya))
    axes = zip((xb, ya, zb), (e1, e2, e3), strict=True)
    x, y, z = add(*(scale(part / norm(e), apply(transpose(A), e)) for part, e in axes))
    return normalise((x, y, ZERO if rim and xa <= 0 else z))


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
    Ai = apply(A, wi)
    t, b, _ = basis(Ai)
    across, up, along = (apply(transpose(A), axis) for axis in (t, b, Ai))
    for tries, row in enumerate(u, start=1):
        x, y = _disk(row)
        m = add(scale(x, across), scale(y, up), scale((1 - row[1]).sqrt() / norm(Ai), along))
        if sign(m[2]) > 0:
            return normalise(m), arb(tries)
    return (ZERO, ZERO, ZERO), ZERO


def _longest_half_axis(A: Matrix) -> arb:
    """1 / the smallest singular value of A: the square root of the largest eigenvalue of (A^T A)^-1, in closed form.

    With K = 3 S - tr(S) I for the adjugate S of A^T A, and p^2 = |K|^2 / 6 (Frobenius), that of S is
    (tr S + 2 p cos(angle / 3)) / 3, cos(angle) = det K / (2 p^3). K is exact, so that eigenvalues which agree do so exactly.
    """
    (a, b, c), (_, d, e), (_, _, f) = ellipsoid.sggx(A)
    with exactly():
        xx, yy, zz = d * f - e * e, a * f - c * c, a * d - b * b
        xy, xz, yz = c * e - b * f, b * e - c * d, b * c - a * e
        trace = xx + yy + zz
        K = (3 * xx - trace, 3 * xy, 3 * xz), (3 * xy, 3 * yy - trace, 3 * yz), (3 * xz, 3 * yz, 3 * zz - trace)
        total = dot(K[0], K[0]) + dot(K[1], K[1]) + dot(K[2], K[2])
        det = determinant(K)
        gap = total**3 - 54 * det**2
    angle = arb.atan2(root(gap / 54), det)
    return root((trace + 2 * root(total / 6) * (angle / 3).cos()) / 3) / abs(determinant(A))


def sample_rejection_sphere(u: Sequence[Vector], wi: Vector, A: Matrix) -> tuple[Vec3, arb]:
    """Version 1: (m, tries) of the first row of u whose ray along -wi, through the bounding sphere's silhouette, meets
    the lune. The disk's axes are the first two rows of `geometry.basis(wi)`.
    """
    t, b, i = basis(wi)
    radius, S = _longest_half_axis(A), ellipsoid.sggx(A)
    for tries, row in enumerate(u, start=1):
        x, y = _disk(row)
        point = add(scale(radius * x, t), scale(radius * y, b))
        # |A (point + along i)|^2 = 1: the root nearer to the viewer.
        Si = apply(S, i)
        whole, half, rest = dot(i, Si), dot(point, Si), dot(point, apply(S, point)) - 1
        discriminant = square(half) - whole * rest
        if sign(discriminant) < 0:
            continue
        along = (discriminant.sqrt() - half) / whole
        m = apply(S, add(point, scale(along, i)))
        if sign(m[2]) > 0:
            return normalise(m), arb(tries)
    return (ZERO, ZERO, ZERO), ZERO
