"""The shape matrix A of the ellipsoid {x : |A x| = size}: its parameterisations, curvature and projected areas."""

from flint import arb

from ggxref.oracle.linalg import (
    ONE,
    ZERO,
    Mat3,
    Matrix,
    N,
    Vec3,
    Vector,
    apply,
    determinant,
    dot,
    inverse_transpose,
    norm,
    normalise,
    product,
    surds,
    transpose,
)
from ggxref.oracle.precision import exactly, sign

Slopes = tuple[tuple[arb, arb], tuple[tuple[arb, arb], tuple[arb, arb]]]


def shape_matrix(alpha: Vector, angles: Vector) -> Mat3:
    """S Rx(theta_x) Ry(theta_y) Rz(theta_z), S = diag(ax, ay, 1), angles in radians. walter2014 (2), (3)."""
    ax, ay = alpha
    (sx, cx), (sy, cy), (sz, cz) = (angle.sin_cos() for angle in angles)
    S = ((ax, ZERO, ZERO), (ZERO, ay, ZERO), (ZERO, ZERO, ONE))
    Rx = ((ONE, ZERO, ZERO), (ZERO, cx, -sx), (ZERO, sx, cx))
    Ry = ((cy, ZERO, sy), (ZERO, ONE, ZERO), (-sy, ZERO, cy))
    Rz = ((cz, -sz, ZERO), (sz, cz, ZERO), (ZERO, ZERO, ONE))
    return product(product(product(S, Rx), Ry), Rz)


def to_slopes(A: Matrix) -> Slopes:
    """(mean, scatter) of the slopes: with S = A^T A / |A n|^2, mean = -e = -S[:2, 2] and scatter = S[:2, :2] - e e^T.

    The numerators are polynomials of A, taken exactly: a scatter that is diagonal or isotropic is known as such.
    """
    a, b, c = transpose(A)
    with exactly():
        p = dot(c, c)
        pe = dot(a, c), dot(b, c)
        xx, xy, yy = (dot(u, v) * p - dot(u, c) * dot(v, c) for u, v in ((a, a), (a, b), (b, b)))
        pp = p * p
    xx, xy, yy = xx / pp, xy / pp, yy / pp
    return (-pe[0] / p, -pe[1] / p), ((xx, xy), (xy, yy))


def from_slopes(mean: Vector, scatter: Matrix) -> Mat3:
    """[[C^T, 0], [e^T, 1]] with C C^T = scatter (C lower, its diagonal positive) and e = -mean. design.md."""
    (xx, xy), (_, yy) = scatter
    with exactly():
        det = xx * yy - xy * xy
    if sign(xx) <= 0 or sign(det) <= 0:
        raise ValueError(f"the scatter of the slopes is not positive definite: {scatter}")
    c00 = xx.sqrt()
    # Of the plain C11 = sqrt(yy - C10^2), in which the minors are taken before the root.
    return (c00, xy / c00, ZERO), (ZERO, (det / xx).sqrt(), ZERO), (-mean[0], -mean[1], ONE)


def canonical(A: Matrix) -> Mat3:
    """[[C00, C10, 0], [0, C11, 0], [ex, ey, 1]]: the one among all c Q A (Q orthogonal) with A n = n. design.md."""
    return from_slopes(*to_slopes(A))


def sggx(A: Matrix) -> Mat3:
    """S = A^T A. walter2014 section 5.2."""
    return product(transpose(A), A)


def size(A: Matrix) -> arb:
    """C_e = sqrt(|det A| / (pi |A n|)): unit projected area along n. walter2014 (29)."""
    return (abs(determinant(A)) / (arb.pi() * norm(apply(A, N)))).sqrt()


def gaussian_curvature(wm: Vector, A: Matrix, size: arb) -> arb:
    """|A|^2 |A^-T m|^4 / C_e^2. walter2014 (20)."""
    return determinant(A) ** 2 * norm(apply(inverse_transpose(A), normalise(wm))) ** 4 / size**2


def projected_area(w: Vector, A: Matrix, size: arb) -> arb:
    """pi C_e^2 |A w| / |det A|. walter2014 (26)."""
    return arb.pi() * size**2 * norm(apply(A, normalise(w))) / abs(determinant(A))


def lune_area(u: Vector, v: Vector, A: Matrix, size: arb) -> arb:
    """pi C_e^2 (|Au| |Av| + Au.Av) / (2 |det A| |Av|), u and v unit. walter2014 (28).

    u is normalised after A is applied, so that the lune of opposite directions is known to be empty.
    """
    Au, Av = apply(A, u), apply(A, v)
    with exactly():
        squares = dot(Au, Au) * dot(Av, Av)
    visible = surds(ONE, squares, dot(Au, Av), ONE)
    return arb.pi() * size**2 * visible / (2 * abs(determinant(A)) * norm(Av) * norm(u))


def mean_normal(A: Matrix) -> Vec3:
    """A^T A n, normalised. walter2014 section 5.1."""
    return normalise(apply(transpose(A), apply(A, N)))
