"""Vectors of three balls and matrices of rows, written out."""

from collections.abc import Sequence

from flint import arb

from ggxref.oracle.precision import exactly, root, sign

Vector = Sequence[arb]
Matrix = Sequence[Sequence[arb]]
Vec3 = tuple[arb, arb, arb]
Mat3 = tuple[Vec3, Vec3, Vec3]

ZERO, ONE = arb(0), arb(1)
N: Vec3 = (ZERO, ZERO, ONE)  # the macrosurface normal


def dot(a: Vector, b: Vector) -> arb:
    """a . b, without rounding where both are exact, so that perpendicular vectors are known as such."""
    (ax, ay, az), (bx, by, bz) = a, b
    with exactly():
        return ax * bx + ay * by + az * bz


def cross(a: Vector, b: Vector) -> Vec3:
    """a x b, without rounding where both are exact."""
    (ax, ay, az), (bx, by, bz) = a, b
    with exactly():
        return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def norm(a: Vector) -> arb:
    """|a|."""
    return root(dot(a, a))


def cosine(a: Vector, b: Vector) -> arb:
    """a . b / (|a| |b|), 0 if they are perpendicular."""
    return dot(a, b) / (norm(a) * norm(b))


def square(x: arb) -> arb:
    """x^2. The operator makes a NaN of a ball about 0."""
    return x * x


def scale(c: arb, a: Vector) -> Vec3:
    """c a."""
    x, y, z = a
    return c * x, c * y, c * z


def add(*vectors: Vector) -> Vec3:
    """The sum of vectors."""
    x, y, z = (sum(parts, ZERO) for parts in zip(*vectors, strict=True))
    return x, y, z


def negative(a: Vector) -> Vec3:
    """-a."""
    x, y, z = a
    return -x, -y, -z


def normalise(a: Vector) -> Vec3:
    """a / |a|."""
    length = norm(a)
    if length == 0:
        raise ValueError("a direction of length zero")
    x, y, z = a
    return x / length, y / length, z / length


def apply(M: Matrix, a: Vector) -> Vec3:
    """M a, without rounding where both are exact."""
    r, s, t = M
    return dot(r, a), dot(s, a), dot(t, a)


def transpose(M: Matrix) -> Mat3:
    """The transpose of a 3x3 matrix."""
    (a, b, c), (d, e, f), (g, h, i) = M
    return (a, d, g), (b, e, h), (c, f, i)


def product(L: Matrix, M: Matrix) -> Mat3:
    """L M."""
    columns = transpose(M)
    a, b, c = ((dot(row, columns[0]), dot(row, columns[1]), dot(row, columns[2])) for row in L)
    return a, b, c


def determinant(M: Matrix) -> arb:
    """|M|, without rounding where M is exact."""
    return dot(M[0], cross(M[1], M[2]))


def inverse_transpose(M: Matrix) -> Mat3:
    """M^-T: its rows are the cross products of M's rows over |M|."""
    det = determinant(M)
    if sign(det) == 0:
        raise ValueError("the matrix is singular")
    a, b, c = ((x / det, y / det, z / det) for x, y, z in (cross(M[1], M[2]), cross(M[2], M[0]), cross(M[0], M[1])))
    return a, b, c


def surds(a: arb, p: arb, b: arb, q: arb) -> arb:
    """a sqrt(p) + b sqrt(q) of exact numbers, p and q > 0, with its sign decided: cancellation to 0 gives 0."""
    if sign(a) * sign(b) < 0:
        with exactly():
            difference = a * a * p - b * b * q
        if difference == 0:
            return ZERO
        return difference / (a * p.sqrt() - b * q.sqrt())
    return a * p.sqrt() + b * q.sqrt()
