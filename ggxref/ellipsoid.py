r"""The ellipsoid $\{x : \|A x\| = C_e\}$: its parameterisations, its curvature, and its projected areas.

The shape matrix `A` is (3, 3) and non-singular, with $\det A$ inside the dtype's range. `A`, `c A` and `Q A` with `Q`
orthogonal give one distribution of normals. `size` is $C_e$ (walter2014 §2.4); areas are in its unit squared.
"""

import math

import jax
import jax.numpy as jnp

from ggxref import _pairs, stable
from ggxref._canonical import beside_the_pole, canonical_terms
from ggxref._lune_sum import lune_sum
from ggxref._matrix import length, near_one, normal_square, reciprocal_scale, times
from ggxref._types import Mat2, Mat3, Real, Scalar, Vec2, Vec3


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
    square, ex, ey, n1, n2 = beside_the_pole(near_one(A)[0])
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
    q, q_rest = _pairs.ratio(_pairs.square_of_pairs(*image), d_square)
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


@stable.widened
def lune_area(u: Vec3, v: Vec3, A: Mat3, size: Real) -> Scalar:
    r"""Area projected along `u` of the part with $m\cdot u > 0$ and $m\cdot v > 0$:
    $\pi C_e^2 (\|Au\|\|Av\| + Au\cdot Av) / (2 |A| \|Av\|)$.

    - `u`, `v`: unit, (3,), anywhere on the sphere; `u = v` gives `projected_area`.

    walter2014 (28).
    """
    A, scale = near_one(A)
    x, y = tuple(u), tuple(v)
    _, ratio = lune_sum(_pairs.times(A, x), _pairs.times(A, y), A, x, y)
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
    total, _ = lune_sum(_pairs.times(A, ray), ((x, zero), (y, zero), (z, zero)), A, ray, n)
    return total / (2 * normal_square(A))
