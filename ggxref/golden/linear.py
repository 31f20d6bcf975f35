"""Vectors and matrices of exact numbers, as tuples."""

from flint import fmpq

Vector = tuple[fmpq, fmpq, fmpq]
Matrix = tuple[Vector, Vector, Vector]
ZERO, ONE = fmpq(0), fmpq(1)
N: Vector = (ZERO, ZERO, ONE)


def dot(a: Vector, b: Vector) -> fmpq:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def transposed(A: Matrix) -> Matrix:
    (a, b, c), (d, e, f), (g, h, i) = A
    return (a, d, g), (b, e, h), (c, f, i)


def times(A: Matrix, x: Vector) -> Vector:
    return dot(A[0], x), dot(A[1], x), dot(A[2], x)


def product(A: Matrix, B: Matrix) -> Matrix:
    columns = transposed(B)
    return times(columns, A[0]), times(columns, A[1]), times(columns, A[2])


def cofactor(A: Matrix) -> Matrix:
    return cross(A[1], A[2]), cross(A[2], A[0]), cross(A[0], A[1])


def determinant(A: Matrix) -> fmpq:
    return dot(A[0], cross(A[1], A[2]))


def combination(a: fmpq, x: Vector, b: fmpq, y: Vector) -> Vector:
    """a x + b y."""
    return a * x[0] + b * y[0], a * x[1] + b * y[1], a * x[2] + b * y[2]


def minus(x: Vector) -> Vector:
    return -x[0], -x[1], -x[2]
