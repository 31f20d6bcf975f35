r"""Quotients $\omega\cdot m / \sigma(\omega)$, the heart of G1 and of every visible density, with derivatives that do not cancel.

Where the quotient hardly depends on ω, as near normal incidence on a smooth surface, where σ is nearly z, the two terms of the
quotient rule cancel. As $\sigma = \omega\cdot\nabla\sigma$, what they leave is $\omega\times(m\times\nabla\sigma)/\sigma^2$. The cosine comes from
outside, in as many digits as it needs.
"""

import math

import jax
import jax.numpy as jnp
from jax import Array
from jax.scipy.special import erfc
from jaxtyping import Bool

from ggxref import _pairs, _squares, stable
from ggxref._lune_sum import directions, lune_parts
from ggxref._matrix import length, near_one, plain_cross, plain_dot, times
from ggxref._pairs import Triple
from ggxref._types import Mat3, Real, Scalar

Two = tuple[Scalar, Scalar]


@jax.custom_jvp
def over_ggx(w: Triple, m: Triple, alpha: Two, k: Real, cosine: Scalar) -> Scalar:
    r"""$\omega\cdot m/(k z + \|(\alpha_x x, \alpha_y y, z)\|)$: the denominator is 2σ for `k = 1`, as it must be for z < 0.

    0 where the denominator underflows. `cosine` is $\omega\cdot m$.
    """
    return cosine / _unless_underflown(area_ggx(w, alpha, k))


def _square(w, alpha):
    """s²."""
    return (alpha[0] * w[0]) ** 2 + (alpha[1] * w[1]) ** 2


def area_ggx(w: Triple, alpha: Two, k: Real) -> Scalar:
    """The denominator of `over_ggx`."""
    square = _squares.scaled_square(w, alpha)
    t = stable.sqrt(square + w[2] ** 2)
    below = w[2] < 0
    return jnp.where(below, square / jnp.where(below, t - w[2], 1), t + k * w[2])  # t + z cancels below the horizon


def _unless_underflown(area):
    return jnp.where(area < jnp.finfo(area.dtype).tiny, jnp.inf, area)


@over_ggx.defjvp
def _over_ggx_jvp(primals, tangents):
    w, _, alpha, k, cosine = primals
    square, area = _square(w, alpha), _unless_underflown(area_ggx(w, alpha, k))
    t = stable.sqrt(square + w[2] ** 2)
    t = jnp.where(t > 0, t, 1)
    by_z = jnp.where(w[2] < 0, area / t, w[2] / t + k)
    by_z = jnp.where(area < jnp.inf, by_z, 0)
    quotient = cosine / area
    change = turned_by(primals, tangents, quotient, area, by_z, 1 / t)
    return quotient, change - quotient * w[2] / area * tangents[3]


def over_ellipsoid(w: Triple, m: Triple, A: Mat3, cosine: Scalar, sigma: Scalar) -> Scalar:
    r"""$\omega\cdot m/\sigma(\omega)$ for the ellipsoid's σ, neither 0. `cosine` is $\omega\cdot m$."""
    return _over_ellipsoid(w, m, near_one(A)[0], cosine, sigma)


@jax.custom_jvp
def _over_ellipsoid(w, m, A, cosine, sigma):
    return cosine / sigma


@_over_ellipsoid.defjvp
def _over_ellipsoid_jvp(primals, tangents):
    r"""By ω, $\omega\times(m\times\nabla\sigma)/\sigma^2$, as σ is $\omega\cdot\nabla\sigma$: two of the three factors turn with the surface."""
    (w, m, A, _, sigma), (dw, dm, dA, _, _) = primals, tangents
    h, column, norm = _area_by(w, A)
    gradient = tuple(plain_dot(h, a) / (2 * norm) for a in A.T)
    by_w = plain_dot(plain_cross(m, gradient), plain_cross(dw, w)) / sigma
    x, y, _ = w
    by_A = (plain_dot(h, x * dA[:, 0] + y * dA[:, 1]) + plain_dot(column, dA[:, 2])) / (2 * norm)
    quotient = _over_ellipsoid(*primals)
    return quotient, (by_w + plain_dot(w, dm) - quotient * by_A) / sigma


def _area_by(w, A):
    r"""h, a vector and ‖An‖ =: ‖b‖: σ changes by $h/2\|b\|$ for $a = A\omega$, and by the vector over 2‖b‖ for the third column of A.

    With $h = \hat a + \hat b$ that vector is $z h - (\|a\|/\|b\|)((1 + 2c)\hat b - \hat a)$, $c = \hat a\cdot\hat b$, whose terms cancel where ω
    is nearly n or -n.
    """
    (p, q, r), z = A[:, 2], w[2]
    zero = jnp.zeros_like(z)
    a, b = _pairs.times(A, w), ((p, zero), (q, zero), (r, zero))
    (along, square), (total, _, n, a_length, b_length) = _beside_normal(w, A), lune_parts(a, b)
    a_length, b_length = _pairs.rounded(a_length), _pairs.rounded(b_length)
    total, a_length, b_length, longer, *n = stable.one_loop(total, a_length, b_length, 2 * z * along + square, *n)
    b, h = directions(a, b, a_length, b_length, total, n)
    more = longer / (b_length * (a_length + jnp.abs(z) * b_length))  # ‖a‖/‖b‖ − |z|
    aside = (2 * c / b_length**2 for c in plain_cross(b, n))  # 2 (‖a‖/‖b‖) (a's direction − c b's)
    upwards = (2 * total / b_length**2 * c for c in b)
    column = tuple(jnp.where(z < 0, more * c - t, s - more * c) for c, s, t in zip(h, aside, upwards, strict=True))
    return h, column, b_length


def _beside_normal(w, A):
    """b·d and ‖d‖² of b = A n and d = A (x, y, 0)."""
    x, y, _ = w
    d = [_pairs.rounded(_pairs.dot((row[0], row[1]), (x, y))) for row in A]
    along = (_pairs.dot(tuple(A[:, j]), tuple(A[:, 2])) for j in (0, 1))
    return _pairs.weighted((x, y), tuple(along)), plain_dot(d, d)


def ellipsoid_hides(w: Triple, A: Mat3) -> Bool[Array, ""]:
    r"""Whether $\sigma > z$ for an ω above the horizon, without the difference: near n the two agree in all digits."""
    A, _ = near_one(A)
    (along, square), z = _beside_normal(w, A), w[2]
    a_length, b_length = length(*times(A, *w)), length(*A[:, 2])
    return along * (a_length + 3 * z * b_length) + b_length * square > 0


@jax.custom_jvp
def over_beckmann(w: Triple, m: Triple, alpha: Two, sigma: Scalar, cosine: Scalar) -> Scalar:
    r"""$\omega\cdot m/\sigma(\omega)$ for Beckmann's σ; 0 where it underflows. `cosine` is $\omega\cdot m$."""
    return cosine / _unless_underflown(sigma)


@over_beckmann.defjvp
def _over_beckmann_jvp(primals, tangents):
    w, _, alpha, sigma, cosine = primals
    square = _square(w, alpha)
    s = jnp.sqrt(jnp.where(square > 0, square, 1))
    a = jnp.where(square > 0, jnp.clip(w[2] / s, -30, 30), 30 * jnp.sign(w[2]))
    by_s = jnp.exp(-a * a) / (2 * math.sqrt(math.pi))
    area = _unless_underflown(sigma)
    quotient = cosine / area
    return quotient, turned_by(primals, tangents, quotient, area, erfc(-a) / 2, by_s / s)


def turned_by(primals, tangents, quotient, area, by_z, by_square):
    """Of the quotient; `by_square` is the area's derivative by s²/2. By ω as that of an ellipsoid."""
    (w, m, (ax, ay), *_), (dw, dm, (dax, day), *_) = primals, tangents
    across = ax * w[0] * by_square, ay * w[1] * by_square
    by_w = plain_dot(plain_cross(m, (ax * across[0], ay * across[1], by_z)), plain_cross(dw, w)) / area
    by_alpha = across[0] * w[0] * dax + across[1] * w[1] * day
    return (by_w + plain_dot(w, dm) - quotient * by_alpha) / area
