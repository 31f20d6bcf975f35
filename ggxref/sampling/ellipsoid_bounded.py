r"""Visible normals of the ellipsoid NDF from a smaller cap, as tokuyoshi2024 does for GGX, with a bound that is proved.

With `A` canonical, `m` the unit micronormal and `o` its reflection, $o_z' + i_z' = (i_z + o_z)/(\|A i\|\,\|A^{-T}m\|^2)$. The
micronormals that reflect `i` above the horizon have an inclination of at most $\theta_1 = (\theta_i + 90°)/2$, and at
inclination θ $\|A^{-T}m\|^2 \le Q(\theta) = \cos^2\theta + (\sin\theta + \|e\|\cos\theta)^2/c^2$, `c` the smaller singular value of `C`. So
$o_z' + i_z' \ge i_z/(\|A i\| \max_{\theta\le\theta_1} Q)$. At e = 0 and α ≤ 1 this is tokuyoshi2024's bound.
"""

import jax
import jax.numpy as jnp

from ggxref import _pairs, ndf, stable
from ggxref._canonical import Canonical, canonical_terms
from ggxref._errorfree import two_sum
from ggxref._matrix import length, length_of_pairs, near_one, normal_square
from ggxref._pairs import Triple
from ggxref._seen import area_ggx
from ggxref._types import Mat3, Scalar, Turn, Vec2, Vec3
from ggxref.ellipsoid import inverse_square
from ggxref.sampling._cap import half_vector
from ggxref.sampling._ellipsoid import from_sphere, to_sphere


def _rounded_to_sphere(wi: Vec3, A: Canonical) -> Triple:
    x, y, z = map(_pairs.rounded, to_sphere(wi, A))
    return x, y, z


def _largest_q(wi: Vec3, A: Canonical):
    """c² and c² (max Q - 1) over [0, θ₁]: Q is a sinusoid of 2θ with one maximum in [0°, 90°]."""
    c00, c10, c11, ex, ey = A
    x, y, z = stable.turning(*wi)  # along ωi the maximum's derivative would jump where it moves to the end
    c = c00 * c11 * 2 / (length(c00 + c11, c10, 0) + length(c00 - c11, c10, 0))
    skew = length(ex, ey, 0)
    lift, gap = skew * skew, (1 - c) * (1 + c)
    # c² (Q - 1) = mean + b cos 2θ + |e| sin 2θ, b = mean - gap and b² + |e|² = mean² + |e|² c²: the peak, mean + ‖(|e|, b)‖,
    # is formed without the cancellation of its sum.
    mean, b = (lift + gap) / 2, (lift - gap) / 2
    amplitude = length(skew, b, 0)
    sunk = mean < 0
    peak = jnp.where(sunk, lift * c * c / jnp.where(sunk, amplitude - mean, 1), mean + amplitude)
    # cos 2θ₁ = −sin θi; cos²θ₁ = (1 − sin θi)/2.
    sin_i = length(x, y, 0)
    cos_square, sin_square = z * z / (2 * (1 + sin_i)), (1 + sin_i) / 2
    slant = stable.sqrt(cos_square * sin_square)
    at_end = gap * sin_square + 2 * skew * slant + lift * cos_square
    return c * c, jnp.where(b >= -amplitude * sin_i, peak, at_end)


def _cut(wi, A):
    """o'_z + i'_z at the cap's lower end, times ‖A ωi‖."""
    c_square, q = _largest_q(wi, A)
    return jnp.where(wi[2] <= 0, 0, wi[2] * (c_square / (c_square + q)))


@stable.widened
def bound(wi: Vec3, A: Mat3) -> Scalar:
    r"""Lower end of the cap in sphere space: $i_z/(\|A\omega_i\|\max Q) - i_z'$; $-i_z'$ where `wi` is not above the horizon.

    - `wi`: unit, (3,). `A`: shape matrix, (3, 3), non-singular.
    """
    return _bound(wi, canonical_terms(A))


@jax.custom_jvp
def _bound(wi: Vec3, A: Canonical) -> Scalar:
    r"""$-(e\cdot\omega_i + i_z (1 - r))/\|A\omega_i\|$, $r = 1/\max Q$: the sum cancels where the mean slope faces away."""
    x, y, z = wi
    zero = jnp.zeros_like(z)
    c_square, q = stable.one_loop(*_largest_q(wi, A))
    rest = _pairs.choice(z > 0, _pairs.ratio((q, zero), two_sum(c_square, q)), (jnp.ones_like(z), zero))
    fall = _pairs.total(_pairs.dot((A.ex, A.ey), (x, y)), _pairs.product((z, zero), rest))
    return -_pairs.rounded(_pairs.ratio(fall, length_of_pairs(to_sphere(wi, A))))


@_bound.defjvp
def _bound_jvp(primals, tangents):
    r"""Of $(z r - h)/N$, $h = e\cdot\omega_i + z$ and $N^2 = \|a\|^2 + h^2$, without the terms that cancel: of smooth surfaces it is of
    the order of ‖a‖², a = C (x, y). Below, `a`, `b`, `h` and `skew` are in units of N.
    """
    (wi, A), (dwi, dA) = primals, tangents
    (x, y, z), (dx, dy, dz), up = wi, dwi, wi[2] > 0
    (c_square, q), (dc_square, dq) = jax.jvp(_largest_q, primals, tangents)
    skew, *sphere = map(_pairs.rounded, (_pairs.dot((A.ex, A.ey), (x, y)), *to_sphere(wi, A)))
    r, rest = jnp.where(up, c_square / (c_square + q), 0), jnp.where(up, q / (c_square + q), 1)
    N = length(*sphere)
    skew, a, b, h = (c / N for c in (skew, *sphere))
    value, square = _bound(wi, A), a * a + b * b
    by_z, by_skew = r * h * skew - square * rest, square + r * h * (z / N)
    by_r = jnp.where(up, z / (c_square + q), 0)
    by_z, by_skew, rest, r, by_r, a, b, N = stable.one_loop(by_z, by_skew, rest, r, by_r, value * a, value * b, 1 / N)
    da, db = A.c00 * dx + dA.c00 * x + A.c10 * dy + dA.c10 * y, A.c11 * dy + dA.c11 * y
    dskew = A.ex * dx + dA.ex * x + A.ey * dy + dA.ey * y
    change = by_z * dz + by_r * (rest * dc_square - r * dq) - by_skew * dskew - (a * da + b * db)
    return value, change * N


@stable.widened
def sample(u: Vec2, wi: Vec3, A: Mat3, *, turn: Turn | None = None) -> Vec3:
    """As `ellipsoid_cap.sample` with the cap's lower end at `bound`: only for single reflection.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), anywhere but where A ω_i points straight below.
    - `turn`: a form of cos 2πu and sin 2πu, in one word; else in two.
    - `A`: shape matrix, (3, 3), non-singular. Returns a micronormal with density `pdf`: unit, (3,), above the horizon.
    """
    terms = canonical_terms(A)
    return from_sphere(half_vector(u, wi, terms, _cut(wi, terms), turn), terms)


@stable.widened
def pdf(wm: Vec3, wi: Vec3, A: Mat3) -> Scalar:
    r"""$2 D(\omega_m)\max(0, \omega_i\cdot\omega_m)/(\|A\omega_i\|(1 - L))$, `L` the `bound` [1/sr]; 0 outside the cap.

    - `wm`, `wi`: unit, (3,). `A`: shape matrix, (3, 3), non-singular.
    - The edge is widened by a few ulps, so that no generated sample gets density 0.

    tokuyoshi2024's p_bound, for the ellipsoid.
    """
    A, _ = near_one(A)
    terms = canonical_terms(A)
    wi = jnp.stack(stable.turning(*wi))  # the quotient does not depend on its length
    one = jnp.ones_like(wi[2])
    rise = area_ggx(_rounded_to_sphere(wi, terms), (one, one), 1)
    cosine, cut = stable.cosine(wi, wm), _cut(wi, terms)
    slack = 1 - 64 * float(jnp.finfo(wm.dtype).eps)
    # A is canonical up to a rotation and the factor ‖A n‖.
    q, det = inverse_square(wm, A)
    outside = (cosine <= 0) | (2 * cosine * wm[2] < slack * cut * (normal_square(A) * q))  # a NaN is not
    area = rise - cut
    return jnp.where(outside, 0, 2 * ndf.ellipsoid_of(wm, A, q, det) * cosine / jnp.where(outside, 1, area))
