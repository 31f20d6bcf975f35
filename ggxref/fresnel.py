"""Fresnel reflectance of a smooth interface for unpolarised light, dimensionless in [0, 1].

`cos_i` is the cosine between the direction and the micronormal; its absolute value is used, so the side is said by the
indices alone.
"""

import math

import jax
import jax.numpy as jnp
from jax import lax

from ggxref import _squares, stable
from ggxref._matrix import reciprocal_scale
from ggxref._types import Real, Scalar


@stable.widened
def dielectric(cos_i: Real, eta: Real) -> Scalar:
    r"""$F = (R_s^2 + R_p^2)/2$, $R_s = \frac{\eta c - c_t}{\eta c + c_t}$, $R_p = \frac{c - \eta c_t}{c + \eta c_t}$,
    $c_t = \sqrt{1 - \eta^2(1 - c^2)}$; 1 in total reflection, 0 at `eta = 1`.

    - `cos_i` in [-1, 1]; `eta = n_i / n_o > 0`.

    Fresnel's equations (Walter et al. 2007 (22)), used by heitz2014 §2.1 and walter2014 §1.1.
    """
    return _dielectric(*stable.floats(cos_i, eta))


@jax.custom_jvp
def _dielectric(cosine, eta):
    _, _, _, fine, r_s, r_p = _amplitudes(jnp.abs(cosine), eta)
    return jnp.where(fine, (r_s * r_s + r_p * r_p) / 2, jnp.where(eta > 1, 1, 0))


def _amplitudes(c, eta):
    """c_t, the denominators of R_s and R_p, whether light is split at all, R_s and R_p."""
    gap = (1 - eta) * (1 + eta)  # 1 - eta², exact also near eta = 1
    square = _squares.refracted_square(c, jnp.zeros_like(c), eta)
    ct = stable.sqrt(square)
    # Both numerators times their conjugates: ηc − c_t and c − ηc_t cancel as η → 1, these do not.
    s_sum, p_sum = eta * c + ct, c + eta * ct
    fine = ~((s_sum <= 0) | (square <= 0) | (gap == 0))  # also NaN, which stays NaN
    s_sum, p_sum = jnp.where(fine, s_sum, 1), jnp.where(fine, p_sum, 1)
    r_s = -gap / s_sum**2
    r_p = gap * (c * c - eta**2 * (1 - c) * (1 + c)) / p_sum**2
    return jnp.where(fine, ct, 1), s_sum, p_sum, fine, r_s, r_p


@_dielectric.defjvp
def _dielectric_jvp(primals, tangents):
    """Of R = (a − b)/(a + b), 2 (b da − a db)/(a + b)²: the difference is simple, its terms are large where c is small.

    By c, those of R_s and R_p add up to a multiple of sin²: what they differ by, V⁴ − (1 − (1 + η²) sin²) U⁴, is expanded about U,
    unless V is much smaller (η and c are). Divided by V⁴ a factor at a time, which would underflow.
    """
    (cosine, eta), (dc, deta) = primals, tangents
    c = jnp.abs(cosine)
    ct, u, v, fine, r_s, r_p = _amplitudes(c, eta)
    gap, sin_square, ratio, over_v = (1 - eta) * (1 + eta), (1 - c) * (1 + c), v / u, 1 / v
    by_eta = 2 * c / ct * (r_s / u**2 - r_p * over_v * over_v * (1 - 2 * eta**2 * sin_square))
    d = (eta - 1) * gap / (c + ct) / u  # V/U − 1 = d sin²
    e = d * (2 + sin_square * d)  # (V/U)² − 1 = e sin²
    far = ratio < 0.5
    apart = (ratio**4 - (c * c - eta**2 * sin_square)) / jnp.where(far, sin_square, 1)
    rest = jnp.where(far, apart, 1 + eta**2 + e * (2 + sin_square * e))
    p = gap * over_v
    by_c = -2 * (eta * over_v) * (sin_square / ct) * (p * rest * p) * over_v
    return _dielectric(*primals), jnp.where(fine, by_c * jnp.sign(cosine), 0) * dc + jnp.where(fine, by_eta, 0) * deta


@stable.widened
def conductor(cos_i: Real, eta: Real, k: Real, *, square: Real | None = None) -> Scalar:
    r"""$F$ for the complex index $\eta + ik = n_o/n_i$ of the metal, relative to the side that the light is on.

    This is the η of the tables of metals, the inverse of `dielectric`'s: `conductor(c, n, 0) = dielectric(c, 1/n)`.

    - `cos_i` in [-1, 1]; `eta > 0`, `k >= 0`.
    - `square`: `cos_i`², where it was there before its root. F waits less for it; its derivative goes by `cos_i` alone.

    Fresnel's equations for absorbing media, as in heitz2014 §2.1 and walter2014 §1.1 ("complex index of refraction").
    """
    return _conductor(*stable.floats(cos_i, cos_i * cos_i if square is None else square, eta, k))


@jax.custom_jvp
def _conductor(cosine, c_square, eta, k):
    sin_square = 1 - c_square  # (1 - c)(1 + c) has digits that F does not need
    # All in units of a power of two s near 1/|N|, as the products go with N to the ninth.
    s = reciprocal_scale(1 + eta + k)
    unit, n, k = s * s, eta * s, k * s
    # N = η + ik, a + ib = √(N² − sin²θ); what is left of cancelling sums is r_s = (1 − N²)/(c + a + ib)².
    gap, imaginary = (n - s) * (n + s) - k * k, 2 * n * k
    real = jnp.where(c_square > 0.5, (n - k) * (n + k) - unit * sin_square, gap + unit * c_square)
    norm = jnp.sqrt(real * real + imaginary * imaginary)  # a² + b²
    # Below `least`, N² is 0 to F; but a root of 0 would leave 0/0.
    least = math.sqrt(float(jnp.finfo(real.dtype).tiny))
    larger = norm + (jnp.abs(real) + least)  # 2a², or 2b², where real < 0; then a = ηk/b, as its difference cancels
    # Everything times that root, which is the only one left: no quotient waits for another.
    root = jnp.sqrt(larger)
    twice = jnp.where(real >= 0, larger, imaginary) * (math.sqrt(2) * s * jnp.abs(cosine))  # 2ac
    # |r_p/r_s|² = (W − 2ac sin²θ)/(W + 2ac sin²θ), W = (a² + b²)c² + sin⁴θ, and F is half of |r_s|² + |r_p|².
    W = (norm * (c_square / least) + (sin_square * sin_square + least) * (unit / least)) * root
    total = (norm + unit * c_square) * root + twice
    reflected = (gap * gap + imaginary * imaginary) * larger * W
    denominator = total * total * (W + twice * (sin_square / least))
    reflected = jnp.where(reflected > denominator, denominator, reflected)  # F is 1 at most, but for rounding
    return reflected / (denominator + float(jnp.finfo(real.dtype).tiny))


@_conductor.defjvp
def _conductor_jvp(primals, tangents):
    (cosine, _, eta, k), (dc, _, deta, dk) = primals, tangents
    by_c, by_eta, by_k = _conductor_slopes(cosine, eta, k)
    return _conductor(*primals), by_c * dc + by_eta * deta + by_k * dk


@stable.widened
def _conductor_slopes(cosine, eta, k):
    r"""By the complex amplitudes, with $N = \eta + ik$, $t^2 = N^2 - \sin^2\theta$ and $G = N^2 - 1$:
    $r_s = -G/(c+t)^2$, $r_p = G(N^2c^2 - \sin^2\theta)/(N^2c + t)^2$; as in `dielectric`, of either the difference is simple.
    """
    c = jnp.abs(cosine)
    sin_square = (1 - c) * (1 + c)
    N = lax.complex(*jnp.broadcast_arrays(eta, k))
    G = lax.complex((eta - 1) * (eta + 1) - k * k, 2 * eta * k)
    t = jnp.sqrt(G + c * c)
    critical = t == 0  # the derivative is infinite
    t = jnp.where(critical, 1, t)
    u, v = c + t, N * N * c + t
    r_s, r_p = -G / (u * u), G * (N * N * (c * c) - sin_square) / (v * v)
    by_N = 2 * (jnp.conj(r_p) / (v * v) * (N * N - 2 * sin_square) - jnp.conj(r_s) / (u * u)) * N * c / t
    # Here V = N²c + t and N U, U = c + t, differ by d U sin², and |V|² and |N U|² by e |U|² sin².
    d = (1 - N) * (G / u) / (N * c + t)
    n_square, e = _square(N), 2 * jnp.real(N * jnp.conj(d)) + sin_square * _square(d)
    # At F's minimum, where |N| is large and c small, n⁴ and the rest cancel but for a difference of squares.
    apart = (n_square + e - c * e) * (n_square + e + c * e)
    sum_over = jnp.where(c < 0.5, apart, n_square * n_square + e * (2 * n_square + sin_square * e)) + N * N
    by_c = -2 * sin_square * _square(G / v / v) * jnp.real(sum_over / t)
    slopes = by_c * jnp.sign(cosine), jnp.real(by_N), -jnp.imag(by_N)
    by_c, by_eta, by_k = (jnp.where(critical, 0, x) for x in slopes)
    return by_c, by_eta, by_k


def _square(x):
    """|x|² of a complex number."""
    return jnp.real(x) ** 2 + jnp.imag(x) ** 2


@stable.widened
def schlick(cos_i: Real, f0: Real) -> Scalar:
    r"""Schlick's approximation: $F = F_0 + (1 - F_0)(1 - |c|)^5$.

    - `cos_i` in [-1, 1]; `f0` in [0, 1], the reflectance at normal incidence.

    Schlick 1994.
    """
    return _schlick(*stable.floats(cos_i, f0))


@jax.custom_jvp
def _schlick(c, f0):
    return f0 + (1 - f0) * (1 - jnp.abs(c)) ** 5


@_schlick.defjvp
def _schlick_jvp(primals, tangents):
    (cosine, f0), (dc, df) = primals, tangents
    c = jnp.abs(cosine)
    rest = c * (5 + c * (-10 + c * (10 + c * (c - 5))))  # 1 - (1 - c)^5, which cancels at c = 0
    return _schlick(*primals), rest * df - 5 * (1 - f0) * (1 - c) ** 4 * jnp.sign(cosine) * dc
