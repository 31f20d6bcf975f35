r"""The ellipsoid $\{x : \|A x\| = C_e\}$: its parameterisations, its curvature, and its projected areas.

The shape matrix `A` is (3, 3) and non-singular, with $\det A$ inside the dtype's range. `A`, `c A` and `Q A` with `Q`
orthogonal give one distribution of normals. `size` is $C_e$ (walter2014 §2.4); areas are in its unit squared.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from ggxref import _pairs, stable
from ggxref._types import Mat2, Mat3, Real, Scalar, Vec2, Vec3


def times(A: Mat3, x: Real, y: Real, z: Real) -> tuple[Scalar, Scalar, Scalar]:
    """`A (x, y, z)` written out: XLA fuses it, and no accelerator computes it in fewer bits than were given."""
    (a, b, c), (d, e, f), (g, h, i) = A
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


@stable.widened
def cofactor(A: Mat3) -> tuple[Mat3, Scalar]:
    r"""The cofactor matrix $\det(A)\,A^{-T}$ and $\det A$, without a division: (3, 3) and ().

    The rows of a smooth or skewed `A` are nearly parallel: plain minors would lose the digits that they share, once each,
    and the determinant twice.
    """
    # As one array: nine expressions are nine pieces to the compiler.
    around = jnp.tile(A, (2, 2))
    (a, b), (c, d) = ([around[i : i + 3, j : j + 3] for j in (1, 2)] for i in (1, 2))
    return stable.dot((a, b), (d, -c)), determinant(A)


@stable.widened
def determinant(A: Mat3) -> Scalar:
    r"""$\det A$, of either sign, rounded once. `A`: (3, 3)."""
    return _pairs.rounded(_pairs.determinant(A))


@stable.widened
def length(x: Real, y: Real, z: Real) -> Scalar:
    """Euclidean norm of a vector in components; its gradient at the zero vector is 0."""
    return stable.sqrt(x * x + y * y + z * z)


def _length_of_pairs(a: _pairs.Pairs) -> _pairs.Pair:
    return _pairs.square_root(_pairs.square_of_pairs(*a))


def normal_square(A: Mat3) -> Scalar:
    r"""$\|A n\|^2$, rounded once. `A`: (3, 3)."""
    n = A[0, 2], A[1, 2], A[2, 2]
    return _pairs.rounded(_pairs.dot(n, n))


def reciprocal_scale(x: Scalar) -> Scalar:
    """A power of two near 1/|x|: a factor that rounds nothing."""
    integer = jnp.int32 if x.dtype == jnp.float32 else jnp.int64
    one, infinity = (lax.bitcast_convert_type(jnp.asarray(c, x.dtype), integer) for c in (1, jnp.inf))
    # By its exponent's bits: a division, which XLA computes once for all its uses, would cut the expression in pieces.
    scale = 2 * one - (lax.bitcast_convert_type(x, integer) & infinity)
    least = lax.bitcast_convert_type(jnp.asarray(jnp.finfo(x.dtype).tiny, x.dtype), integer)
    return lax.stop_gradient(lax.bitcast_convert_type(jnp.maximum(scale, least), x.dtype))


def near_one(A: Mat3) -> tuple[Mat3, Scalar]:
    """`A` times a power of two that brings A n to about 1, and that factor: `c A` is the same distribution, but its minors, of
    which there are products, would leave the range for c = 1e12.
    """
    scale = reciprocal_scale(jnp.abs(A[0, 2]) + jnp.abs(A[1, 2]) + jnp.abs(A[2, 2]))
    return A * scale, scale


@stable.widened
def shape_matrix(alpha: Vec2, angles: Vec3) -> Mat3:
    r"""$A = S R_x(\theta_x) R_y(\theta_y) R_z(\theta_z)$ with $S = \mathrm{diag}(\alpha_x, \alpha_y, 1)$.

    - `alpha`: (2,), positive. `angles`: $(\theta_x, \theta_y, \theta_z)$ in radians, (3,): the first two move the
      density's peak off the macronormal, the last turns the anisotropy in the tangent plane.

    walter2014 (2), (3).
    """
    (cx, cy, cz), (sx, sy, sz) = jnp.cos(angles), jnp.sin(angles)
    rows = [
        jnp.stack([cy * cz, -cy * sz, sy]) * alpha[0],
        jnp.stack([cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -sx * cy]) * alpha[1],
        jnp.stack([sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy]),
    ]
    return jnp.stack(rows)


def _beside_the_pole(A):
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
    square, ex, ey, n1, n2 = _beside_the_pole(A)
    n1_length, along = _pairs.one_pass(_length_of_pairs(n1), _pairs.inner(n1, n2))
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
    up, (x, y, z) = stable.unit(*A[:, 2]), stable.unit(*n1)
    q1 = up[1] * z - up[2] * y, up[2] * x - up[0] * z, up[0] * y - up[1] * x
    return q1, tuple(jnp.where(signed < 0, c, -c) for c in (x, y, z)), up


def _change(A, dA, terms, lower, frame):
    r"""What $Q^T dA/\|A n\|$ is beyond a scale of M and a turn of n: of the five numbers, and of `lower`, the 0 below c00."""
    c00, c10, c11, ex, ey = terms
    norm = length(*A[:, 2])
    g = [[(q[0] * a[0] + q[1] * a[1] + q[2] * a[2]) / norm for a in dA.T] for q in frame]
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


@stable.widened
def canonical(A: Mat3) -> Mat3:
    r"""The representative of `A`'s distribution with $A n = n$: $\begin{pmatrix} C^T & 0 \\ e^T & 1 \end{pmatrix}$.

    `C` is lower triangular with a positive diagonal: five numbers, unique, with no degenerate angle. Scale by
    $1/\|A n\|$, rotate $A n$ onto n.

    Each is rounded once; the form of a canonical `A` is `A` itself.

    Gram–Schmidt from the third column on: $\Sigma = C C^T$ by subtraction, $S - e e^T$, loses the digits that a strong
    skew shares with `e`.
    """
    c00, c10, c11, ex, ey = canonical_terms(A)
    zero, one = jnp.zeros_like(c00), jnp.ones_like(c00)
    return jnp.stack([jnp.stack([c00, c10, zero]), jnp.stack([zero, c11, zero]), jnp.stack([ex, ey, one])])


@jax.custom_jvp
def _conditional(a, b, c, d):
    """`d - b c / a`, from the determinant; by `a`, the derivative of that quotient would cancel."""
    return stable.dot((a, -b), (d, c)) / a


@_conditional.defjvp
def _conditional_jvp(primals, tangents):
    (a, b, c, _), (da, db, dc, dd) = primals, tangents
    return _conditional(*primals), dd + (b / a) * (c / a) * da - (c / a) * db - (b / a) * dc


@stable.widened
def from_slopes(mean: Vec2, scatter: Mat2) -> Mat3:
    r"""The canonical `A` whose slope density is the Student-t density at `mean` with shape `scatter`/2.

    - `mean`: (2,), the centre of the slope density, $-e$. `scatter`: (2, 2), symmetric, positive definite, Σ = C Cᵀ:
      `mean = 0` and `scatter = diag(αx², αy²)` is GGX.
    """
    c00 = jnp.sqrt(scatter[0, 0])
    c10 = scatter[1, 0] / c00
    c11 = jnp.sqrt(_conditional(scatter[0, 0], scatter[0, 1], scatter[1, 0], scatter[1, 1]))
    zero, one = jnp.zeros_like(c00), jnp.ones_like(c00)
    return jnp.stack([jnp.stack([c00, c10, zero]), jnp.stack([zero, c11, zero]), jnp.stack([-mean[0], -mean[1], one])])


@stable.widened
def to_slopes(A: Mat3) -> tuple[Vec2, Mat2]:
    """The `(mean, scatter)` of `from_slopes` for any `A`: (2,) and (2, 2)."""
    square, ex, ey, n1, n2 = _beside_the_pole(near_one(A)[0])
    square, ex, ey = map(_pairs.rounded, (square, ex, ey))
    # Not by C, whose parts turn with the ellipse where it is nearly a line.
    xx, xy, yy = (_pairs.rounded(_pairs.inner(a, b)) / square / square for a, b in ((n1, n1), (n1, n2), (n2, n2)))
    return -jnp.stack([ex, ey]), jnp.stack([jnp.stack([xx, xy]), jnp.stack([xy, yy])])


@stable.widened
def sggx(A: Mat3) -> Mat3:
    r"""The SGGX microflake matrix of the same ellipsoid, $S = A^T A$: (3, 3), symmetric. walter2014 §5.2."""
    columns = A.T
    return jnp.stack([jnp.stack([a[0] * b[0] + a[1] * b[1] + a[2] * b[2] for b in columns]) for a in columns])


@stable.widened
def size(A: Mat3) -> Scalar:
    r"""The $C_e$ that gives unit projected area along n: $\sqrt{|\det A| / (\pi \|A n\|)}$. walter2014 (29)."""
    A, scale = near_one(A)
    return jnp.sqrt(jnp.abs(determinant(A)) / (math.pi * length(*A[:, 2]))) / scale


def inverse_square(wm: Vec3, A: Mat3) -> tuple[Scalar, Scalar]:
    r"""$\|A^{-T}\omega_m\|^2/\|\omega_m\|^2$ and $|\det A|$, each rounded once; the first's derivative is that of the numerator.

    - `wm`: unit, (3,), anywhere on the sphere. `A`: (3, 3), non-singular, of either sign.

    Under skew $\mathrm{cof}(A)\,\omega_m$ cancels at the peak of the density: minors and product are in two words.
    """
    return _inverse_square(wm, A)


@jax.custom_jvp
def _inverse_square(wm, A):
    return _inverse_square_and_parts(wm, A)[:2]


def _inverse_square_and_parts(wm, A):
    r"""The two of `inverse_square`, then d, $d A^{-T}\omega_m$ and the rows of $d A^{-T}$, where d is $\det A$ but for a power of two."""
    w, minors = tuple(wm), _pairs.cofactor(A)
    det = _pairs.dot_of_pairs(minors[0], tuple(A[0]))
    # Divided before they are squared: cof m is α² at the peak.
    scale = reciprocal_scale(det[0])
    d, d_rest = det[0] * scale, det[1] * scale
    image = [(x * scale, rest * scale) for x, rest in (_pairs.dot_of_pairs(row, w) for row in minors)]
    x, y, z = (x for x, _ in image)
    d_square = _pairs.square_of_pairs((d, d_rest))
    q, q_rest = _pairs.over(_pairs.square_of_pairs(*image), d_square, stable.reciprocal(d_square[0]))
    longer = 2 * stable.excess(wm)
    square = jnp.where(longer > -1, 1 + longer, 1)  # ‖w‖², but for the zero vector
    q = q + (q_rest - q * (longer / square))
    return q, jnp.abs(_pairs.rounded(det)), d, (x, y, z), [[_pairs.rounded(p) * scale for p in row] for row in minors]


@_inverse_square.defjvp
def _inverse_square_jvp(primals, tangents):
    r"""$2v\cdot(d\omega_m - dA^T y)$ with $y = A^{-T}\omega_m$, $v = A^{-1}y$, and $|\det A|\,\mathrm{tr}(A^{-1}dA)$."""
    dw, dA = tangents
    q, det, d, y, (a, b, c) = _inverse_square_and_parts(*primals)
    q, det, d, *rest = stable.one_loop(q, det, d, *y, *a, *b, *c)
    y, inverse = [p / d for p in rest[:3]], [[p / d for p in rest[i : i + 3]] for i in (3, 6, 9)]
    v = [sum(inverse[i][j] * y[i] for i in range(3)) for j in range(3)]
    change = sum(v[j] * (dw[j] - sum(y[i] * dA[i, j] for i in range(3))) for j in range(3))
    return (q, det), (2 * change, det * sum(inverse[i][j] * dA[i, j] for i in range(3) for j in range(3)))


@stable.widened
def gaussian_curvature(wm: Vec3, A: Mat3, size: Real) -> Scalar:
    r"""Gaussian curvature where the normal is `wm`: $K = |A|^2 \|A^{-T}\omega_m\|^4 / C_e^2$.

    - `wm`: unit, (3,), anywhere on the sphere.

    walter2014 (20).
    """
    A, scale = near_one(A)
    q, det = inverse_square(wm, A)
    return (det * q / (size * scale)) ** 2


@stable.widened
def projected_area(w: Vec3, A: Mat3, size: Real) -> Scalar:
    r"""Area of the ellipsoid's shadow along `w`: $\pi C_e^2 \|A\omega\| / |A|$.

    - `w`: unit, (3,), anywhere on the sphere.

    walter2014 (26).
    """
    A, scale = near_one(A)
    square = _pairs.rounded(_pairs.square_of_pairs(*_pairs.times(A, tuple(w))))
    return math.pi * (size * scale) ** 2 * stable.sqrt(square) / jnp.abs(determinant(A))


@jax.custom_jvp
def _lune_sum(
    au: _pairs.Pairs, av: _pairs.Pairs, A: Mat3, u: tuple[Scalar, ...], v: tuple[Scalar, ...]
) -> tuple[Scalar, Scalar]:
    r"""$T = \|Au\|\|Av\| + Au\cdot Av$, the factor of every lune, and $T/\|Av\|$, each rounded once; exact also where $Au \approx -Av$.

    - `au`, `av`: `A u` and `A v`. Derivatives are by the others.

    There the sum cancels, and $\|Au \times Av\|^2 / (\|Au\|\|Av\| - Au\cdot Av)$ does not, of vectors in two words: rounded, they
    would have lost the angle between them.
    """
    return lune_parts(au, av)[:2]


def lune_parts(au, av):
    """The two of `_lune_sum`, then Au × Av, and ‖Au‖ and ‖Av‖ in two words."""
    u_length, v_length = (_length_of_pairs(a) for a in (au, av))
    product, n = _pairs.product(u_length, v_length), _pairs.cross_of_pairs(au, av)
    cosine = _pairs.inner(au, av)
    # Down to 110° the sum keeps its digits better.
    obtuse = cosine[0] < -product[0] / 3
    zero, one = jnp.zeros_like(product[0]), jnp.ones_like(product[0])
    divisor = _pairs.choice(obtuse, _pairs.less(product, cosine), (one, zero))
    conjugate = _pairs.ratio(_pairs.square_of_pairs(*n), divisor)
    total = _pairs.choice(obtuse, conjugate, _pairs.total(product, cosine))
    ratio = _pairs.ratio(total, v_length)
    return _pairs.rounded(total), _pairs.rounded(ratio), tuple(map(_pairs.rounded, n)), u_length, v_length


@_lune_sum.defjvp
def _lune_sum_jvp(primals, tangents):
    r"""With $a = Au$, $b = Av$, $n = a \times b$: by a, of T, $\|b\| h$ with $h = \hat a + \hat b = (T\hat a + n \times \hat a)/(\|a\|\|b\|)$, whose
    terms are perpendicular; by A, $h\,(\|b\| u + \|a\| v)^T$, in two words, as it cancels where $u \approx -v$. $T/\|b\|$ keeps, by b, only
    what is perpendicular to it."""
    (au, av, A, u, v), (_, _, dA, du, dv) = primals, tangents
    total, ratio, n, a_length, b_length = lune_parts(au, av)
    s = [weighted((x, b_length), (y, a_length)) for x, y in zip(u, v, strict=True)]
    a_length, b_length = map(_pairs.rounded, (a_length, b_length))
    total, ratio, a_length, b_length, *rest = stable.one_loop(total, ratio, a_length, b_length, *n, *s)
    n, s = rest[:3], rest[3:]
    a, b = ([value / norm for value, _ in pair] for pair, norm in ((au, a_length), (av, b_length)))
    product = a_length * b_length
    h = [(total * c + d) / product for c, d in zip(a, plain_cross(n, a), strict=True)]
    by_a, by_A = b_length * plain_dot(h, times(A, *du)), plain_dot(h, times(dA, *s))
    db = times(A, *dv)
    across = -plain_dot(plain_cross(n, b), db) / b_length
    by_total = by_a + by_A + across + ratio * plain_dot(b, db)
    return (total, ratio), (by_total, (by_a + by_A + across - ratio * plain_dot(b, times(dA, *v))) / b_length)


def weighted(*terms):
    """Sum of numbers times numbers in two words, rounded once."""
    value, rest = _pairs.dot(tuple(x for x, _ in terms), tuple(weight for _, (weight, _) in terms))
    return value + (rest + sum(x * low for x, (_, low) in terms))


def plain_dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def plain_cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@stable.widened
def lune_area(u: Vec3, v: Vec3, A: Mat3, size: Real) -> Scalar:
    r"""Area projected along `u` of the part with $m\cdot u > 0$ and $m\cdot v > 0$:
    $\pi C_e^2 (\|Au\|\|Av\| + Au\cdot Av) / (2 |A| \|Av\|)$.

    - `u`, `v`: unit, (3,), anywhere on the sphere; `u = v` gives `projected_area`.

    walter2014 (28).
    """
    A, scale = near_one(A)
    x, y = tuple(u), tuple(v)
    _, ratio = _lune_sum(_pairs.times(A, x), _pairs.times(A, y), A, x, y)
    return math.pi * (size * scale) ** 2 * ratio / (2 * jnp.abs(determinant(A)))


@stable.widened
def mean_normal(A: Mat3) -> Vec3:
    r"""Average normal of the half ellipsoid $m\cdot n > 0$, by area: $A^T A n / \|A^T A n\|$: unit, (3,).

    It is not n where the ellipsoid is skewed. walter2014 §5.1.
    """
    A, _ = near_one(A)
    return jnp.stack(stable.unit(*times(A.T, *A[:, 2])))


@stable.widened
def sigma(w: Vec3, A: Mat3) -> Scalar:
    r"""$\sigma = A_\ell^\perp(\omega, n)/A_e^\perp(n) = (\|A\omega\|\|An\| + A\omega\cdot An)/(2\|An\|^2)$; `w` anywhere.

    walter2014 (26), (28).
    """
    A, _ = near_one(A)
    x, y, z = A[:, 2]
    ray, zero = tuple(w), jnp.zeros_like(z)
    n = zero, zero, jnp.ones_like(z)
    total, _ = _lune_sum(_pairs.times(A, ray), ((x, zero), (y, zero), (z, zero)), A, ray, n)
    return total / (2 * normal_square(A))
