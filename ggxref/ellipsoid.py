r"""The ellipsoid $\{x : \|A x\| = C_e\}$: its parameterisations, its curvature, and its projected areas.

The shape matrix `A` is (3, 3) and non-singular, with $\det A$ inside the dtype's range. `A`, `c A` and `Q A` with `Q`
orthogonal give one distribution of normals. `size` is $C_e$ (walter2014 §2.4); areas are in its unit squared.
"""

import math

import jax.numpy as jnp

from ggxref import stable
from ggxref._types import Mat2, Mat3, Real, Scalar, Vec2, Vec3


def times(A: Mat3, x: Real, y: Real, z: Real) -> tuple[Scalar, Scalar, Scalar]:
    """`A (x, y, z)` written out: XLA fuses it, and no accelerator computes it in fewer bits than were given."""
    (a, b, c), (d, e, f), (g, h, i) = A
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def cofactor(A: Mat3) -> tuple[Mat3, Scalar]:
    r"""The cofactor matrix $\det(A)\,A^{-T}$ and $\det A$, without a division: (3, 3) and ().

    The rows of a smooth or skewed `A` are nearly parallel: plain minors would lose the digits that they share, once each,
    and the determinant twice.
    """
    # The minor (i, j) takes the rows i + 1 and i + 2 and the columns j + 1 and j + 2, around the corner.
    E = jnp.tile(A, (2, 2))
    rows = stable.dot((E[1:4, 1:4], E[1:4, 2:5]), (E[2:5, 2:5], -E[2:5, 1:4]))
    return rows, stable.dot(A[0], rows[0])


@stable.widened
def length(x: Real, y: Real, z: Real) -> Scalar:
    """Euclidean norm of a vector in components; its gradient at the zero vector is 0."""
    return stable.sqrt(x * x + y * y + z * z)


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

    Gram–Schmidt from the third column on: $\Sigma = C C^T$ by subtraction, $S - e e^T$, loses the digits that a strong
    skew shares with `e`.
    """
    a1, a2, a3 = A.T
    a3_square = a3[0] * a3[0] + a3[1] * a3[1] + a3[2] * a3[2]
    e = stable.dot(a1, a3) / a3_square, stable.dot(a2, a3) / a3_square
    # The parts of a1 and a2 perpendicular to a3 have the lengths |a1 x a3| / |a3| and so on, and these cross products
    # are cofactors.
    cof, det = cofactor(A)
    n1, n2 = -cof[:, 1], cof[:, 0]
    n1_length = length(*n1)
    c00 = n1_length / a3_square
    c10 = stable.dot(n1, n2) / (n1_length * a3_square)
    c11 = jnp.abs(det) / (n1_length * jnp.sqrt(a3_square))
    zero, one = jnp.zeros_like(c00), jnp.ones_like(c00)
    return jnp.stack([jnp.stack([c00, c10, zero]), jnp.stack([zero, c11, zero]), jnp.stack([*e, one])])


@stable.widened
def from_slopes(mean: Vec2, scatter: Mat2) -> Mat3:
    r"""The canonical `A` whose slope density is the Student-t density at `mean` with shape `scatter`/2.

    - `mean`: (2,), the centre of the slope density, $-e$. `scatter`: (2, 2), symmetric, positive definite, Σ = C Cᵀ:
      `mean = 0` and `scatter = diag(αx², αy²)` is GGX.
    """
    c00 = jnp.sqrt(scatter[0, 0])
    c10 = scatter[1, 0] / c00
    determinant = scatter[0, 0] * scatter[1, 1] - scatter[1, 0] * scatter[0, 1]
    c11 = jnp.sqrt(determinant / scatter[0, 0])
    zero, one = jnp.zeros_like(c00), jnp.ones_like(c00)
    return jnp.stack([jnp.stack([c00, c10, zero]), jnp.stack([zero, c11, zero]), jnp.stack([-mean[0], -mean[1], one])])


@stable.widened
def to_slopes(A: Mat3) -> tuple[Vec2, Mat2]:
    """The `(mean, scatter)` of `from_slopes` for any `A`: (2,) and (2, 2)."""
    (c00, c10, _), (_, c11, _), (ex, ey, _) = canonical(A)
    off = c00 * c10
    return -jnp.stack([ex, ey]), jnp.stack([jnp.stack([c00 * c00, off]), jnp.stack([off, c10 * c10 + c11 * c11])])


def sggx(A: Mat3) -> Mat3:
    r"""The SGGX microflake matrix of the same ellipsoid, $S = A^T A$: (3, 3), symmetric. walter2014 §5.2."""
    columns = A.T
    return jnp.stack([jnp.stack([a[0] * b[0] + a[1] * b[1] + a[2] * b[2] for b in columns]) for a in columns])


@stable.widened
def size(A: Mat3) -> Scalar:
    r"""The $C_e$ that gives unit projected area along n: $\sqrt{|\det A| / (\pi \|A n\|)}$. walter2014 (29)."""
    return jnp.sqrt(jnp.abs(cofactor(A)[1]) / (math.pi * length(*A[:, 2])))


@stable.widened
def gaussian_curvature(wm: Vec3, A: Mat3, size: Real) -> Scalar:
    r"""Gaussian curvature where the normal is `wm`: $K = |A|^2 \|A^{-T}\omega_m\|^4 / C_e^2$.

    - `wm`: unit, (3,), anywhere on the sphere.

    walter2014 (20).
    """
    cof, det = cofactor(A)
    x, y, z = times(cof, *wm)
    # |A|^2 |cof m / det|^4 = (|cof m|^2 / det)^2: no fourth power to underflow.
    return ((x * x + y * y + z * z) / det / size) ** 2


@stable.widened
def projected_area(w: Vec3, A: Mat3, size: Real) -> Scalar:
    r"""Area of the ellipsoid's shadow along `w`: $\pi C_e^2 \|A\omega\| / |A|$.

    - `w`: unit, (3,), anywhere on the sphere.

    walter2014 (26).
    """
    return math.pi * size**2 * length(*times(A, *w)) / jnp.abs(cofactor(A)[1])


def lune_sum(u: Vec3, v: Vec3, A: Mat3) -> Scalar:
    r"""$\|Au\|\|Av\| + Au\cdot Av$, the factor of every lune, exact also where $Au \approx -Av$.

    There the sum cancels, and $\|Au \times Av\|^2 / (\|Au\|\|Av\| - Au\cdot Av)$ does not; $Au \times Av$ is
    $\mathrm{cof}(A)(u \times v)$ (walter2014 (25), printed with $M^T$ for $M^{-T}$).
    """
    au, av = times(A, *u), times(A, *v)
    product = length(*au) * length(*av)
    cosine = au[0] * av[0] + au[1] * av[1] + au[2] * av[2]
    cross = times(cofactor(A)[0], *stable.cross(u, v))
    square = cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]
    obtuse = cosine < 0
    # The inner `where` keeps the branch not taken away from 0/0 at u = v.
    return jnp.where(obtuse, square / jnp.where(obtuse, product - cosine, 1), product + cosine)


@stable.widened
def lune_area(u: Vec3, v: Vec3, A: Mat3, size: Real) -> Scalar:
    r"""Area projected along `u` of the part with $m\cdot u > 0$ and $m\cdot v > 0$:
    $\pi C_e^2 (\|Au\|\|Av\| + Au\cdot Av) / (2 |A| \|Av\|)$.

    - `u`, `v`: unit, (3,), anywhere on the sphere; `u = v` gives `projected_area`.

    walter2014 (28).
    """
    det = jnp.abs(cofactor(A)[1])
    return math.pi * size**2 * lune_sum(u, v, A) / (2 * det * length(*times(A, *v)))


def mean_normal(A: Mat3) -> Vec3:
    r"""Average normal of the half ellipsoid $m\cdot n > 0$, by area: $A^T A n / \|A^T A n\|$: unit, (3,).

    It is not n where the ellipsoid is skewed. walter2014 §5.1.
    """
    return jnp.stack(stable.unit(*times(A.T, *A[:, 2])))


@stable.widened
def sigma(w: Vec3, A: Mat3) -> Scalar:
    r"""$\sigma = A_\ell^\perp(\omega, n)/A_e^\perp(n) = (\|A\omega\|\|An\| + A\omega\cdot An)/(2\|An\|^2)$; `w` anywhere.

    walter2014 (26), (28).
    """
    n = jnp.zeros_like(w).at[2].set(1)
    a = A[:, 2]
    return lune_sum(w, n, A) / (2 * (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]))
