"""The canonical form of a shape matrix as its five numbers, each rounded once, and the turn to it; with derivatives that keep their digits."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from ggxref import _pairs, stable
from ggxref._matrix import length, length_of_pairs, near_one, plain_cross, plain_dot, reciprocal_scale
from ggxref._types import Mat3, Scalar


def beside_the_pole(A):
    """|a3|², e, and a1 x a3 and a2 x a3 of A's columns: |a3| times the parts of a1 and a2 perpendicular to a3, turned; in two words.

    In small passes: XLA does not vectorise a loop of so many results that does all of it.
    """
    a1, a2, a3 = (tuple(A[i, j] for i in range(3)) for j in range(3))
    square = _pairs.dot(a3, a3)
    square, ex, ey = _pairs.one_pass(square, *(_pairs.ratio(_pairs.dot(a, a3), square) for a in (a1, a2)))
    x1, y1, z1, x2, y2, z2 = _pairs.one_pass(*_pairs.cross(a1, a3), *_pairs.cross(a2, a3))
    return square, ex, ey, (x1, y1, z1), (x2, y2, z2)


class Canonical(NamedTuple):
    r"""The five numbers of `canonical`: $C$, lower triangular, and $e$."""

    c00: Scalar
    c10: Scalar
    c11: Scalar
    ex: Scalar
    ey: Scalar


def canonical_terms(A: Mat3) -> Canonical:
    """`canonical` as its five numbers. `A`: (3, 3), non-singular, of either sign."""
    return _canonical_terms(near_one(A)[0])


@jax.custom_jvp
def _canonical_terms(A):
    return _canonical_and_normal(A)[0]


def _canonical_and_normal(A):
    """The five numbers, each rounded once, then a1 x a3 of A's columns, and c11 with the sign of det A."""
    square, ex, ey, n1, n2 = beside_the_pole(A)
    n1_length, along = _pairs.one_pass(length_of_pairs(n1), _pairs.inner(n1, n2))
    (det,) = _pairs.one_pass(_pairs.determinant(A))
    c00 = _pairs.ratio(n1_length, square)
    c10 = _pairs.ratio(along, _pairs.product(n1_length, square))
    c11 = _pairs.ratio(det, _pairs.product(n1_length, _pairs.square_root(square)))
    c00, c10, c11, ex, ey = stable.one_loop(*map(_pairs.rounded, (c00, c10, c11, ex, ey)))
    return Canonical(c00, c10, jnp.abs(c11), ex, ey), tuple(map(_pairs.rounded, n1)), c11


@_canonical_terms.defjvp
def _canonical_terms_jvp(primals, tangents):
    """The numbers' changes, and a turn about n that keeps the one below c00 at 0."""
    (A,), (dA,) = primals, tangents
    terms, n1, signed = _canonical_and_normal(A)
    change, lower = _change(A, dA, terms, jnp.zeros_like(signed), _frame(A, n1, signed))
    turn = lower / terms.c00
    return terms, change._replace(c10=change.c10 + terms.c11 * turn, c11=change.c11 - terms.c10 * turn)


def _frame(A, n1, signed):
    r"""The columns of Q in $A = \|A n\|\,Q M$, Q orthogonal and M canonical."""
    up, n = stable.unit(*A[:, 2]), stable.unit(*n1)
    return plain_cross(up, n), tuple(jnp.where(signed < 0, c, -c) for c in n), up


def _change(A, dA, terms, lower, frame):
    r"""What $Q^T dA/\|A n\|$ is beyond a scale of M and a turn of n: of the five numbers, and of `lower`, the 0 below c00."""
    c00, c10, c11, ex, ey = terms
    norm = length(*A[:, 2])
    g = [[plain_dot(q, a) / norm for a in dA.T] for q in frame]
    (g11, g12, g13), (g21, g22, g23), (g31, g32, g33) = g
    change = Canonical(
        g11 - ex * g13 - c00 * g33,
        g12 - ey * g13 - c10 * g33,
        g22 - ey * g23 - c11 * g33,
        g31 - ex * g33 + c00 * g13 + lower * g23,
        g32 - ey * g33 + c10 * g13 + c11 * g23,
    )
    return change, g21 - ex * g23 - lower * g33


class Frame(NamedTuple):
    """`canonical_terms`; of the turn to them, -1 where it reflects, else 1; and where it takes the second row of `basis(A n)`, the
    cosine and sine of the azimuth a right angle ahead of it, times a number.

    `lower` is the matrix's 0 below c00. For what does not depend on a turn about n the derivatives are those of a frame that
    keeps its azimuth, in which this number changes: to keep it 0, a smooth ellipsoid's frame turns by 1/α, which would cancel.
    """

    terms: Canonical
    lower: Scalar
    side: Scalar
    pole: tuple[Scalar, Scalar]


def canonical_frame(A: Mat3) -> Frame:
    """`Frame` of `A`: as `canonical_terms`."""
    return _canonical_frame(near_one(A)[0])


@jax.custom_jvp
def _canonical_frame(A):
    terms, n1, signed = _canonical_and_normal(A)
    side = jnp.where(signed < 0, -1, 1).astype(signed.dtype)
    side, cosine, sine = stable.one_loop(side, *_second_row(A, n1, side))
    return Frame(terms, jnp.zeros_like(side), side, (cosine, sine))


@jax.custom_jvp
def _steady_frame(A):
    """`_frame`, whose derivative has no turn about A n."""
    _, n1, signed = _canonical_and_normal(A)
    return _frame(A, n1, signed)


@_steady_frame.defjvp
def _steady_frame_jvp(primals, tangents):
    (A,), (dA,) = primals, tangents
    q1, q2, up = _steady_frame(A)
    norm = length(*A[:, 2])
    x, y = (sum(c * d for c, d in zip(q, dA[:, 2], strict=True)) / norm for q in (q1, q2))
    dq1, dq2 = (tuple(-t * c for c in up) for t in (x, y))
    return (q1, q2, up), (dq1, dq2, tuple(x * c + y * d for c, d in zip(q1, q2, strict=True)))


def _second_row(A, n1, side):
    """The azimuth of `canonical_frame`, from n1 = a1 x a3 of A's columns."""
    (x, y, z), (p, q, r) = n1, A[:, 2]
    s = jnp.where(jnp.signbit(r), -1, 1).astype(r.dtype)
    # n1 times the first two rows of the basis, shorter as it is perpendicular to A n.
    bend = z / (s * length(p, q, r) + r)
    cosine, sine = s * (y - bend * q), side * (x - bend * p)
    scale = reciprocal_scale(jnp.abs(cosine) + jnp.abs(sine))
    return cosine * scale, sine * scale


@_canonical_frame.defjvp
def _canonical_frame_jvp(primals, tangents):
    (A,), (dA,) = primals, tangents
    frame = _canonical_frame(A)
    terms, lower, side, (cosine, sine) = frame
    change, dlower = _change(A, dA, terms, lower, _steady_frame(A))
    _, (x, y) = jax.jvp(lambda A: _second_row(A, jnp.cross(A[:, 0], A[:, 2]), side), primals, tangents)
    turn = dlower / terms.c00
    return frame, Frame(change, dlower, jnp.zeros_like(side), (x - turn * sine, y + turn * cosine))
