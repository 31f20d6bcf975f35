"""Special functions, where JAX has none or its own loses digits: each by a series or by Newton's method, in the dtype given."""

import math
from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ggxref._errorfree import fast_two_sum, two_product, two_sum
from ggxref._pairs import Pair
from ggxref._types import Real, Scalar
from ggxref.stable import crude_quotient, reciprocal


def log1p(x: Scalar) -> Scalar:
    """`log(1 + x)`. XLA's own, in float64, is 129 ULP off on (−0.42, −0.29), where `1 + x` has digits enough."""
    far = x < -0.29
    return jnp.where(far, jnp.log(1 + jnp.where(far, x, 0)), jnp.log1p(jnp.where(far, 0, x)))


# Taylor coefficients of sin 2πv / v and cos 2πv in v²: on |v| <= 1/8 the first term left out is below half an ulp.
_SIN = [(-1) ** k * (2 * math.pi) ** (2 * k + 1) / math.factorial(2 * k + 1) for k in range(9)]
_COS = [(-1) ** k * (2 * math.pi) ** (2 * k) / math.factorial(2 * k) for k in range(9)]
TAU_REST = 2.4492935982947064e-16  # of 2π, beyond its float64


def horner(coefficients, x):
    value = jnp.full_like(x, coefficients[-1])
    for c in reversed(coefficients[:-1]):
        value = value * x + c
    return value


def _powers(chebyshev: tuple[float, ...], terms: int) -> dict[jnp.dtype, list[float]]:
    """Chebyshev's series in powers, for Horner's rule: in float32 of so many terms. Clenshaw's rule would round twice as often."""
    convert = np.polynomial.chebyshev.cheb2poly
    narrow, wide = convert(chebyshev[:terms]).tolist(), convert(chebyshev).tolist()
    return {jnp.dtype("float32"): narrow, jnp.dtype("float64"): wide}


def two_word_powers(
    chebyshev: tuple[float, ...], rest: float, factor: tuple[float, float], terms: int
) -> dict[jnp.dtype, list[float]]:
    """As `_powers`, times a factor; the constant, which carries the digits, as a sum of two, as the factor is.

    - `rest`: what the first coefficient has beyond float64.
    """

    def powers(series, dtype):
        # At t = 0 the polynomials are 1, 0, -1, 0, 1, ...
        first = Fraction(rest) + sum((-1) ** (k // 2) * Fraction(c) for k, c in enumerate(series) if k % 2 == 0)
        first *= Fraction(factor[0]) + Fraction(factor[1])
        value = float(np.asarray(float(first)).astype(dtype))
        others = [factor[0] * c for c in np.polynomial.chebyshev.cheb2poly(series).tolist()[1:]]
        return [value, float(first - Fraction(value)), *others]

    sizes = {jnp.dtype("float32"): chebyshev[:terms], jnp.dtype("float64"): chebyshev}
    return {dtype: powers(series, dtype) for dtype, series in sizes.items()}


def cos_sin_turn(u: Real, terms: int | None = None) -> tuple[Scalar, Scalar]:
    r"""$(\cos 2\pi u, \sin 2\pi u)$ for `u` in [0, 1].

    `u` is reduced to an eighth of a turn exactly, before the rounding of $\pi$ can enter; the polynomial that is left
    costs a fraction of the library's functions, which must reduce any argument.

    - `terms`: of each Taylor series, at most 9; without it, as many as the dtype can hold.
    """
    u = jnp.asarray(u)
    cos_terms, sin_terms = (terms, terms) if terms else (9, 9) if u.dtype == jnp.float64 else (6, 5)
    quarter, v = _quarters(u)
    square = v * v
    # 2π in two words: its rounding is as large as all others of the sine.
    tau = float(np.asarray(math.tau).astype(u.dtype))
    rest = (math.tau - tau) + TAU_REST
    c = horner(_COS[:cos_terms], square)
    s = v * tau + v * (rest + square * horner(_SIN[1:sin_terms], square))
    return _turned(quarter, c, s)


def _quarters(u):
    """The nearest number of quarters of a turn, and what is left of `u`, exactly: at most an eighth."""
    quarter = jnp.round(4 * u)
    return quarter, u - quarter / 4


def _turned(quarter, c, s):
    """Cosine and sine, so many quarters of a turn on."""
    swap = (quarter == 1) | (quarter == 3)
    c, s = jnp.where(swap, s, c), jnp.where(swap, c, s)
    negate_cos, negate_sin = (quarter == 1) | (quarter == 2), (quarter == 2) | (quarter == 3)
    return jnp.where(negate_cos, -c, c), jnp.where(negate_sin, -s, s)


@jax.custom_jvp
def two_word_turn(u: Scalar) -> tuple[Pair, Pair]:
    """`cos_sin_turn` in two words."""
    quarter, v = _quarters(u)
    c, s = cos_sin_eighth((v, jnp.zeros_like(v)))
    (c, s), (c_rest, s_rest) = (_turned(quarter, *words) for words in zip(c, s, strict=True))
    return (c, c_rest), (s, s_rest)


@two_word_turn.defjvp
def _two_word_turn_jvp(primals, tangents):
    (c, _), (s, _) = values = two_word_turn(*primals)
    angle, zero = math.tau * tangents[0], jnp.zeros_like(c)
    return values, ((-s * angle, zero), (c * angle, zero))


def cos_sin_eighth(v: Pair) -> tuple[Pair, Pair]:
    r"""$(\cos 2\pi v, \sin 2\pi v)$ for |v| <= 1/8, `v` and results in two words: to within 0.4 ε. No derivative."""
    turn, turn_rest = v
    cos_terms, sin_terms = (9, 9) if turn.dtype == jnp.float64 else (6, 5)
    square = turn * turn
    tau = float(np.asarray(math.tau).astype(turn.dtype))
    value, error = two_product(turn, jnp.full_like(turn, tau))
    rest = error + turn * ((math.tau - tau) + TAU_REST + square * horner(_SIN[1:sin_terms], square))
    s, s_rest = fast_two_sum(value, rest)
    c, c_rest = fast_two_sum(jnp.ones_like(turn), square * horner(_COS[1:cos_terms], square))
    angle = math.tau * turn_rest
    return (c, c_rest - s * angle), (s, s_rest + c * angle)


# 1/k!, and ln 2 in two words, of which the first times an exponent is exact.
_EXP = [1 / math.factorial(k) for k in range(2, 14)]
_LN2 = {
    jnp.dtype("float32"): (0.693145751953125, 1.428606820309417e-06),
    jnp.dtype("float64"): (0.6931471803691238, 1.9082149292705877e-10),
}


def exp_minus(x: Scalar, rest: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    r"""$e^{-(x + \mathrm{rest})}$ as `(m + m_rest) * 2**-k`: (m, m_rest, k). XLA's own has an error of its own, and underflows."""
    high, low = _LN2[x.dtype]
    k = jnp.round(x * (1 / math.log(2)))
    y, y_rest = k * high - x, k * low - rest
    both = y + y_rest
    m = 1 + y
    curve = both * both * horner(_EXP[:6] if x.dtype == jnp.float32 else _EXP, both)
    return m, ((1 - m) + y) + (y_rest + curve), k


def power_of_two(k: Scalar) -> Scalar:
    """2**k of a whole number; 0 below the normal range."""
    info = jnp.finfo(k.dtype)
    integer = jnp.int32 if info.bits == 32 else jnp.int64
    biased = jnp.maximum(k + (info.maxexp - 1), 0).astype(integer)
    return lax.bitcast_convert_type(biased << info.nmant, k.dtype)


# Taylor coefficients of (artanh s − s)/s³ in s².
_ARTANH = [1 / k for k in range(3, 27, 2)]


def _nearest_power(x: Scalar, y: Scalar) -> tuple[Scalar, Scalar]:
    """(k, `x 2**-k`), the latter from 2/3 to 3/2 of `y`: the bits of a number are nearly its logarithm. Both positive."""
    info = jnp.finfo(x.dtype)
    integer = jnp.int32 if info.bits == 32 else jnp.int64
    x_bits, y_bits = (lax.bitcast_convert_type(a, integer) for a in (x, y))
    k = (x_bits - y_bits + (1 << (info.nmant - 1))) >> info.nmant
    return k.astype(x.dtype), lax.bitcast_convert_type(x_bits - (k << info.nmant), x.dtype)


def log1p_over_square(a: Pair, z: Scalar) -> tuple[Pair, Pair]:
    """`log(1 + a/z²)` in two words, and `a + z²` with its rest as a share of it, for `a >= 0`, `z > 0`; z² may underflow.

    With 1 + a/z² = 2^k m, log m = 2 artanh((m − 1)/(m + 1)): all but the first term is small.
    """
    n, z = _nearest_power(z, jnp.ones_like(z))
    up, down = power_of_two(-n), power_of_two(n)
    square, square_rest = two_product(z, z)
    total, lost = two_sum(square * down * down, a[0])
    lost = lost + (a[1] + square_rest * down * down)
    k, m = _nearest_power(total, square)
    k = k - 2 * n
    share = crude_quotient(lost / 4, total / 4)  # up to the end of the range
    m_rest = m * share
    # Near the peak, a/z² itself has the digits.
    top = jnp.where(k == 0, a[0] * up * up, m - square)
    top_rest = jnp.where(k == 0, a[1] * up * up, m_rest - square_rest)
    bottom, bottom_rest = two_sum(m, square)
    inverse = reciprocal(bottom)
    s = top * inverse
    product, error = two_product(s, bottom)
    s_rest = (((top - product) - error) + (top_rest - s * (bottom_rest + (m_rest + square_rest)))) * inverse
    high, low = _LN2[s.dtype]
    value, rest = two_sum(k * high, 2 * s)
    beyond = s * s * s * horner(_ARTANH[:6] if s.dtype == jnp.float32 else _ARTANH, s * s)
    return fast_two_sum(value, rest + (2 * (s_rest + beyond) + k * low)), (total, share)


# Chebyshev coefficients in t = (a - 3) / (a + 3) of sqrt(pi) (1 + sqrt(pi) a + 2 a^2) exp(a^2) ierfc(a), a smooth function
# that is 1 at both ends of [0, inf), and flat at 0, where t has but the absolute precision of 1. tests/test_stable.py
# computes them again with arb.
_IERFC = (
    1.076454505291804,
    -0.01334871003563987,
    -0.08953327017717706,
    0.02356605395210076,
    0.009379703391662228,
    -0.009478842578515573,
    0.0036571921672572793,
    -0.0007562986582984636,
    4.5761064363555275e-05,
    1.804522886680375e-05,
    -4.061765004093192e-06,
    -2.480149041963323e-07,
    1.7712104839134037e-07,
    -3.494339044430806e-11,
    -7.410135868977286e-09,
    1.4456809387604993e-10,
    3.31266244263937e-10,
    -2.8359503477231995e-12,
    -1.582132476173926e-11,
    -4.629322776956003e-13,
    7.707676032549949e-13,
    7.096442064463471e-14,
    -3.55128801378049e-14,
    -6.728873301924289e-15,
    1.3409783573360659e-15,
    5.129096048426886e-16,
    -2.09399041055519e-17,
    -3.2431383422233466e-17,
    -2.8189531838422533e-18,
)


_IERFC_REST = 1.0602091124949601e-16  # of the first, beyond float64
_ROOT_PI, _ROOT_PI_REST = math.sqrt(math.pi), 1.453787399267733e-16
_IERFC_POWERS = _powers(_IERFC, 13)
_HALF_IERFC = two_word_powers(_IERFC, _IERFC_REST, (0.28209479177387814, 3.83386490329147e-18), 13)  # over 2 sqrt(pi)


def _ierfc_scaled(a):
    """exp(a²) ierfc(a) for a >= 0."""
    return horner(_IERFC_POWERS[a.dtype], (a - 3) / (a + 3)) / (_ROOT_PI * (1 + a * (_ROOT_PI + 2 * a)))


def half_ierfc(a: Scalar, square: Pair) -> tuple[Pair, Pair, Scalar]:
    r"""Half the first repeated integral of erfc, $\int_a^\infty \mathrm{erfc} = e^{-a^2}/\sqrt\pi - a\,\mathrm{erfc}(a)$, for `a >= 0`, as a
    quotient of numbers in two words times 2**-k: (numerator, denominator, k).

    This is the shape of every Gaussian projected area: Beckmann's Λ is half `ierfc(a) / a`. The two terms agree in all
    but $1/2a^2$ of themselves, hence a Chebyshev series (after Shepherd & Laframboise 1981) times the exponential.

    - `square`: a² in two words: the rounding of `a` alone changes the exponential by 2a² times as much.
    """
    first, first_rest, *others = _HALF_IERFC[a.dtype]
    t = 1 - 6 * reciprocal(a + 3)
    series, series_rest = fast_two_sum(jnp.asarray(first, a.dtype), t * horner(others, t) + first_rest)
    m, m_rest, k = exp_minus(*square)
    numerator, lost = two_product(m, series)
    double, double_rest = two_sum(2 * square[0], jnp.ones_like(a))
    denominator, denominator_rest = two_sum(double, a * _ROOT_PI)
    rest = denominator_rest + (double_rest + (2 * square[1] + a * _ROOT_PI_REST))
    return (numerator, lost + (m * series_rest + m_rest * series)), (denominator, rest), k


# exp(a²) erfc(a) as a power series: up to a = 1/2 the first term left out is below half an ulp. The functions themselves
# round twice more, and take the compiler longer.
_ERFCX = [(-1) ** k / math.gamma(k / 2 + 1) for k in range(28)]


def gaussian_tails(a: Scalar) -> tuple[Scalar, Scalar]:
    """`exp(a²) erfc(a)` and `exp(a²) ierfc(a)` for `a >= 0`: the tails without their underflow."""
    scaled = _ierfc_scaled(a)
    small = a < 0.5
    direct = horner(_ERFCX if a.dtype == jnp.float64 else _ERFCX[:16], jnp.where(small, a, 0))
    return jnp.where(small, direct, (1 / math.sqrt(math.pi) - scaled) / jnp.where(small, 1, a)), scaled
