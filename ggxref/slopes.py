r"""Slope space: the slope of a micronormal is $\tilde m = (-x_m/z_m, -y_m/z_m)$, and P22 its density.

P22 is a density per unit of slope area, dimensionless, and $D(\omega_m) = P^{22}(\tilde m) / (\omega_m\cdot n)^4$.
`alpha` is $(\alpha_x, \alpha_y)$, positive, (2,). $\sigma(\omega) = \int \max(0, \omega\cdot\omega_m) D(\omega_m)\,d\omega_m$ is the
projected area of the faces turned to ω, per unit of macrosurface: the normalisation of what ω sees.
"""

import math

import jax
import jax.numpy as jnp
from jax import lax

from ggxref import _pairs, _special, _squares, stable
from ggxref._canonical import canonical_terms
from ggxref._errorfree import two_product, two_sum
from ggxref._matrix import reciprocal_scale
from ggxref._seen import area_ggx, over_beckmann, over_ggx
from ggxref._types import Mat3, Real, Scalar, Vec2, Vec3


@stable.widened
def from_normal(wm: Vec3) -> Vec2:
    """Slope of the micronormal `wm`: unit, (3,), above the horizon; the result is (2,). heitz2014 §5.1."""
    return jnp.stack([-wm[0] / wm[2], -wm[1] / wm[2]])


@stable.widened
def to_normal(slope: Vec2) -> Vec3:
    """The micronormal with that slope: unit, (3,). heitz2014 §5.1, algorithm 4 step 5."""
    x, y = slope
    scale = reciprocal_scale(jnp.maximum(jnp.maximum(jnp.abs(x), jnp.abs(y)), 1))  # a square may leave the range
    return jnp.stack(stable.unit(-x * scale, -y * scale, scale))


@stable.widened
def stretch(w: Vec3, factors: Vec2) -> Vec3:
    r"""Direction after stretching the surface: $(\lambda_x x, \lambda_y y, z)$, normalised.

    - `w`: unit, (3,), anywhere on the sphere; `factors`: $(\lambda_x, \lambda_y)$, positive, (2,).

    heitz2014 §5.2; dupuy2023 listing 1 with `factors = alpha`.
    """
    return jnp.stack(stable.unit(factors[0] * w[0], factors[1] * w[1], w[2]))


@stable.widened
def ggx(slope: Vec2, alpha: Vec2) -> Scalar:
    r"""$P^{22} = 1 / (\pi\alpha_x\alpha_y (1 + \tilde x^2/\alpha_x^2 + \tilde y^2/\alpha_y^2)^2)$. heitz2014 §5."""
    zero = jnp.zeros_like(slope[0])
    return _bell((slope[0], zero), (slope[1], zero), alpha[0], alpha[1], zero, zero + 1)


@jax.custom_jvp
def _bell(x, y, a, b, c, factor):
    r"""$f/(\pi a b (1 + u^2 + v^2)^2)$ with $u = x/a$, $v = (y - c u)/b$, `x` and `y` sums of two. Its derivatives do not underflow
    before it does."""
    zero, one = jnp.zeros_like(a), jnp.ones_like(a)
    u = _pairs.ratio(two_sum(*x), (a, zero))
    v = _pairs.ratio(_pairs.less(two_sum(*y), _pairs.product((c, zero), u)), (b, zero))
    q = _pairs.rounded(_pairs.square_of_pairs((one, zero), u, v))
    _, _, plain = _bell_parts(x, y, a, b, c)
    end = float(jnp.finfo(plain.dtype).max) / 16  # beyond, the second words are not there
    return factor * _squares.lobe(a, b, jnp.where(plain < end, q, plain))


def _bell_parts(x, y, a, b, c):
    """u, v and 1 + u² + v²."""
    u = (x[0] + x[1]) / a
    v = ((y[0] + y[1]) - c * u) / b
    return u, v, 1 + u * u + v * v


@_bell.defjvp
def _bell_jvp(primals, tangents):
    (x, y, a, b, c, factor), (dx, dy, da, db, dc, dfactor) = primals, tangents
    (u, v, q), value = _bell_parts(x, y, a, b, c), _bell(*primals)
    by_v = 4 * v / q
    by_u = 4 * u / q - by_v * (c / b)
    # Quotients by a and b first: the value times a small factor may underflow.
    across = (value * ((by_v * v - 1) / b)) * db - (value * (by_v / b)) * sum(dy) + (value * (by_v / b * u)) * dc
    along = (value * ((by_u * u - 1) / a)) * da - (value * (by_u / a)) * sum(dx)
    return value, across + along + _bell(x, y, a, b, c, jnp.ones_like(factor)) * dfactor


@stable.widened
def beckmann(slope: Vec2, alpha: Vec2) -> Scalar:
    r"""$P^{22} = \exp(-\tilde x^2/\alpha_x^2 - \tilde y^2/\alpha_y^2) / (\pi\alpha_x\alpha_y)$. heitz2014 §5."""
    return _beckmann_times(slope, alpha, 1.0)


def _beckmann_times(slope, alpha, factor):
    return gaussian(slope[0], slope[1], jnp.ones_like(slope[0]), alpha, factor, 0.0)


def gaussian(x: Scalar, y: Scalar, z: Scalar, alpha: Vec2, factor: Real, longer: Real) -> Scalar:
    r"""$\exp(-\rho/z^2) / (\pi\alpha_x\alpha_y z^4)$, $\rho = x^2/\alpha_x^2 + y^2/\alpha_y^2$, `z > 0`, times a factor, by which its tails may be
    within the dtype's range where it itself is not.

    - `longer`: by how much the length of (x, y, z) exceeds 1, which counts four times; a constant to the derivative.
    """
    rho = (x / alpha[0]) ** 2 + (y / alpha[1]) ** 2
    # Beyond this exponent it is 0 in the dtype; towards the horizon z⁴ then is 0 too, and it or its gradient 0/0.
    seen = ~(rho >= -2 * math.log(float(jnp.finfo(z.dtype).tiny)) * z**2)
    x, y, z = (jnp.where(seen, c, d) for c, d in ((x, 0), (y, 0), (z, 1)))
    exponent, rest = _pairs.tangent_square(x, y, z, alpha[0], alpha[1])
    m, m_rest, k = _special.exp_minus(exponent, rest)
    m = m + (m_rest + 4 * m * lax.stop_gradient(longer))
    # The power of two in halves: the peak 1/(π αx αy) reaches into tails where the exponential alone has underflowed.
    half = jnp.floor(k / 2)
    top, z_square = m * _special.power_of_two(-half) * factor, z**2
    value = top / (math.pi * alpha[0] * z_square * (alpha[1] * z_square)) * _special.power_of_two(half - k)
    return jnp.where(seen, value, 0)


@stable.widened
def student_t(slope: Vec2, alpha: Vec2, gamma: Real) -> Scalar:
    r"""$P^{22} = (\gamma-1)^\gamma / (\pi\alpha_x\alpha_y (\gamma-1+\tilde x^2/\alpha_x^2+\tilde y^2/\alpha_y^2)^\gamma)$.

    - `gamma > 1`: 2 is GGX, infinity Beckmann.

    Ribardière et al. 2017.
    """
    one, gamma = jnp.ones_like(slope[0]), jnp.asarray(gamma, slope.dtype)
    return student(slope[0], slope[1], one, alpha[0], alpha[1], gamma, jnp.zeros_like(one))


@jax.custom_jvp
def student(x: Scalar, y: Scalar, z: Scalar, ax: Scalar, ay: Scalar, gamma: Scalar, longer: Scalar) -> Scalar:
    r"""$(\gamma-1)^\gamma / (\pi\alpha_x\alpha_y z^4 (\gamma-1+\rho/z^2)^\gamma)$, $\rho = x^2/\alpha_x^2 + y^2/\alpha_y^2$, `z > 0`.

    - `longer`: by how much the length of (x, y, z) exceeds 1, which counts four times; a constant to the derivative.
    """
    # With q = z² + ρ/(γ−1) this is (z²/q)^(γ−2) / (π αx αy q²): nothing is divided by z. Its exponent is in two words.
    _, (log, log_rest), (q, beyond) = _student_logarithm(x, y, z, ax, ay, gamma)
    exponent, rest = two_product(gamma - 2, log)
    end = jnp.finfo(z.dtype).maxexp
    seen = ~(exponent > 4 * end)  # beyond, D is 0 in the dtype
    rest = rest + (gamma - 2) * log_rest
    m, m_rest, k = _special.exp_minus(jnp.where(seen, exponent, 4 * end), jnp.where(seen, rest, 0))
    m = m + (m_rest + m * (4 * longer - 2 * beyond))
    # In halves, as in `beckmann`; below 2, D may be infinite in the dtype.
    k = jnp.maximum(k, 2 - 2 * end)
    half = jnp.floor(k / 2)
    near, far = m * _special.power_of_two(-half), _special.power_of_two(half - k)
    return jnp.where(q == jnp.inf, 0, (near / (ax * q)) * (far / (math.pi * (ay * q))))


def _student_logarithm(x, y, z, ax, ay, gamma):
    """ρ/(γ−1) and log(q/z²) in two words, and q with its rest as a share of it."""
    zero, g = jnp.zeros_like(z), gamma - 1
    p = tuple(_pairs.ratio((c, zero), (a, zero)) for c, a in ((x, ax), (y, ay)))
    share = _pairs.ratio(_pairs.square_of_pairs(*p), (g, zero))
    return share, *_special.log1p_over_square(share, z)


def _student_parts(x, y, z, ax, ay, gamma):
    """q, and the share of it that is ρ/(γ−1)."""
    rest = ((x / ax) ** 2 + (y / ay) ** 2) / (gamma - 1)
    q = z * z + rest
    return q, rest / q


@jax.custom_jvp
def _by_gamma(x, y, z, ax, ay, gamma):
    """h/(γ−1) − (log(q/z²) − h), h the share of ρ/(γ−1) in q: what cancels here cancels in two words."""
    rest, log, total = _student_logarithm(x, y, z, ax, ay, gamma)
    # In one pass: computed again for the value, and contracted otherwise there, the words would not belong together.
    a, b, c, d, q, low = stable.one_loop(*rest, *log, *total)
    share = _pairs.ratio((a, b), (q, q * low))
    by_exponent = _pairs.ratio(share, (gamma - 1, jnp.zeros_like(q)))
    change = _pairs.rounded(_pairs.total(by_exponent, _pairs.less(share, (c, d))))
    beyond = jnp.where(q < jnp.inf, 1 / (gamma - 1) + 1 - c, 0)  # where h is 1; at infinity D is 0
    return jnp.where(q < 1e37, change, beyond)


@_by_gamma.defjvp
def _by_gamma_jvp(primals, tangents):
    z, g = primals[2], primals[-1] - 1
    (q, share), (dq, dshare) = jax.jvp(_student_parts, primals, tangents)
    return _by_gamma(*primals), dshare * (1 + 1 / g) - share / g * (tangents[-1] / g) - (dq / q - 2 * tangents[2] / z)


@student.defjvp
def _student_jvp(primals, tangents):
    """Each partial derivative as the value times a quotient, and what cancels by z and γ collected."""
    (x, y, z, ax, ay, gamma, _), (dx, dy, dz, dax, day, dgamma, _) = primals, tangents
    value, (q, share) = student(*primals), _student_parts(*primals[:6])
    g = gamma - 1
    change = value * _by_gamma(*primals[:6]) * dgamma
    change = change + value * (2 * ((gamma - 2) * share - 2 * z * (z / q)) / z) * dz
    for c, a, dc, da in ((x, ax, dx, dax), (y, ay, dy, day)):
        p = c / a
        slope = 2 * gamma * (p / (g * q))
        change = change - (value * slope / a) * dc + (value * (slope * p - 1) / a) * da
    return value, change


@stable.widened
def ellipsoid(slope: Vec2, A: Mat3) -> Scalar:
    r"""GGX off its centre and sheared: $1 / (\pi|C| (1 + \|C^{-1}(\tilde m + e)\|^2)^2)$ for the canonical `A`.

    The bivariate Student-t density with 2 degrees of freedom, location $-e$ and shape Σ/2 (design: canonical form).
    """
    c00, c10, c11, ex, ey = canonical_terms(A)
    return _bell((slope[0], ex), (slope[1], ey), c00, c11, c10, jnp.ones_like(ex))


@stable.widened
def sigma_ggx(w: Vec3, alpha: Vec2) -> Scalar:
    r"""$\sigma = (z + \|(\alpha_x x, \alpha_y y, z)\|)/2$, for `w` anywhere. dupuy2023 (4) after the stretch."""
    return area_ggx(tuple(w), tuple(alpha), 1.0) / 2


def _gaussian(x, y, z, ax, ay):
    """a² and s in two words, and a: of a = z/s, s = ‖(αx x, αy y)‖."""
    square = _pairs.square_of_pairs(two_product(ax, x), two_product(ay, y))
    inverse = stable.rsqrt(square[0])
    exponent = _pairs.over(_pairs.dot((z,), (z,)), square, inverse * inverse)
    return exponent, _pairs.root(square, inverse), z * inverse


@jax.custom_jvp
def _tail(x, y, z, ax, ay):
    """`s ierfc(z/s)/2` as a number and the exponent of 1/2 that it is to be multiplied with."""
    exponent, (s, s_rest), a = _gaussian(x, y, z, ax, ay)
    (top, top_rest), denominator, k = _special.half_ierfc(a, exponent)
    product, lost = two_product(s, top)
    numerator = product, lost + (s * top_rest + s_rest * top)
    value, rest = _pairs.ratio(numerator, denominator)
    return value + rest, k


@_tail.defjvp
def _tail_jvp(primals, tangents):
    """By s it changes by exp(−a²)/2√π, by z by −erfc(a)/2."""
    (x, y, _, ax, ay), (dx, dy, dz, dax, day) = primals, tangents
    value, k = _tail(*primals)
    exponent, (s, _), a = _gaussian(*primals)
    m, m_rest, _ = _special.exp_minus(*exponent)
    gauss = m + m_rest
    ds = (ax * x * (ax * dx + x * dax) + ay * y * (ay * dy + y * day)) / s
    change = gauss * (ds / (2 * math.sqrt(math.pi)) - _special.gaussian_tails(a)[0] * dz / 2)
    return (value, k), (change, jnp.zeros_like(k))


def gaussian_tail(w, alpha):
    """|z| Λ(w), 0 at normal incidence, as a number and a power of two: their product may underflow where Λ does not."""
    x, y, z, ax, ay = w[0], w[1], jnp.abs(w[2]), alpha[0], alpha[1]
    square = (ax * x) ** 2 + (ay * y) ** 2
    # From a = 30 on, it is 0 in every dtype.
    seen = ~((square < 4 * jnp.finfo(square.dtype).tiny) | (z * z >= 900 * square))  # also NaN, which stays NaN
    value, k = _tail(*(jnp.where(seen, c, 1) for c in (x, y, z)), ax, ay)
    return jnp.where(seen, value, 0), jnp.where(seen, _special.power_of_two(-k), 0)


@stable.widened
def sigma_beckmann(w: Vec3, alpha: Vec2) -> Scalar:
    r"""$\sigma = z\,(1 + \mathrm{erf}\,a)/2 + s\,e^{-a^2}/(2\sqrt\pi)$, $a = z/s$, $s = \|(\alpha_x x, \alpha_y y)\|$; `w` anywhere.

    Underflows to 0 far below the horizon, where no slope is steep enough to be seen. heitz2014 §5.1 (c).
    """
    tail, scale = gaussian_tail(w, alpha)
    return jnp.maximum(w[2], 0) + tail * scale


def _factor(slope, wi):
    """The normal of that slope, not unit, and its cosine; heitz2014 (7) with the signs of its appendix A, as (7) has them wrong."""
    m = -slope[0], -slope[1], jnp.ones_like(slope[0])
    return m, stable.cosine(wi, jnp.stack(m))


@stable.widened
def visible_ggx(slope: Vec2, wi: Vec3, alpha: Vec2) -> Scalar:
    r"""Density of the slopes that `wi` sees: $\max(0, -x_i\tilde x - y_i\tilde y + z_i)\,P^{22}(\tilde m)/\sigma(\omega_i)$.

    - `wi`: unit, (3,), anywhere but straight below: from below the horizon it still sees the steepest slopes.

    heitz2014 (7).
    """
    m, factor = _factor(slope, wi)
    share = 2 * over_ggx(tuple(wi), m, tuple(alpha), 1.0, factor)
    zero = jnp.zeros_like(factor)
    return _bell((slope[0], zero), (slope[1], zero), alpha[0], alpha[1], zero, jnp.where(factor <= 0, 0, share))


@stable.widened
def visible_beckmann(slope: Vec2, wi: Vec3, alpha: Vec2) -> Scalar:
    """`visible_ggx` for Beckmann slopes. heitz2014 (7)."""
    m, factor = _factor(slope, wi)
    share = over_beckmann(tuple(wi), m, tuple(alpha), sigma_beckmann(wi, alpha), factor)
    return _beckmann_times(slope, alpha, jnp.where(factor <= 0, 0, share))
