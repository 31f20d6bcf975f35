"""Special functions, where JAX has none or its own loses digits: each by a series or by Newton's method, in the dtype given."""

import math

import jax
import jax.numpy as jnp

from ggxref._types import Real, Scalar


def log1p(x: Scalar) -> Scalar:
    """`log(1 + x)`. XLA's own, in float64, is 129 ULP off on (−0.42, −0.29), where `1 + x` has digits enough."""
    far = x < -0.29
    return jnp.where(far, jnp.log(1 + jnp.where(far, x, 0)), jnp.log1p(jnp.where(far, 0, x)))


# Taylor coefficients of sin 2πv / v and cos 2πv in v²: on |v| <= 1/8 the first term left out is below half an ulp.
_SIN = [(-1) ** k * (2 * math.pi) ** (2 * k + 1) / math.factorial(2 * k + 1) for k in range(9)]
_COS = [(-1) ** k * (2 * math.pi) ** (2 * k) / math.factorial(2 * k) for k in range(9)]


def _horner(coefficients, x):
    value = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        value = value * x + c
    return value


def cos_sin_turn(u: Real, terms: int | None = None) -> tuple[Scalar, Scalar]:
    r"""$(\cos 2\pi u, \sin 2\pi u)$ for `u` in [0, 1].

    `u` is reduced to an eighth of a turn exactly, before the rounding of $\pi$ can enter; the polynomial that is left
    costs a fraction of the library's functions, which must reduce any argument.

    - `terms`: of each Taylor series, at most 9; without it, as many as the dtype can hold.
    """
    u = jnp.asarray(u)
    cos_terms, sin_terms = (terms, terms) if terms else (9, 9) if u.dtype == jnp.float64 else (6, 5)
    quarter = jnp.round(4 * u)
    v = u - quarter / 4
    square = v * v
    c, s = _horner(_COS[:cos_terms], square), v * _horner(_SIN[:sin_terms], square)
    swap = (quarter == 1) | (quarter == 3)
    c, s = jnp.where(swap, s, c), jnp.where(swap, c, s)
    negate_cos, negate_sin = (quarter == 1) | (quarter == 2), (quarter == 2) | (quarter == 3)
    return jnp.where(negate_cos, -c, c), jnp.where(negate_sin, -s, s)


# Chebyshev coefficients in t = (a - 3) / (a + 3) of sqrt(pi) (1 + 2 a^2) exp(a^2) ierfc(a), a smooth function that is
# 1 at both ends of [0, inf). tests/test_stable.py computes them again with arb.
_IERFC = (
    0.8983020427745623,
    0.11262785225761364,
    0.03571305852948175,
    -0.08726578763158488,
    0.059453479214879104,
    -0.02438560091618397,
    0.006522770600882268,
    -0.001005650624929731,
    1.2794620962747412e-05,
    2.978488482221082e-05,
    -4.347826728577626e-06,
    -6.093356111432701e-07,
    2.10743212981155e-07,
    1.1652759571892747e-08,
    -9.038074775178108e-09,
    -3.030761419449976e-10,
    3.982604818145382e-10,
    1.7577574077580366e-11,
    -1.8236389678792617e-11,
    -1.5040092030317944e-12,
    8.316356698523843e-13,
    1.2574718318109538e-13,
    -3.4581066655988014e-14,
    -9.476313500734717e-15,
    1.0395855246885352e-15,
    6.309879635822399e-16,
    8.575482470432927e-18,
    -3.562663873637638e-17,
    -4.9147812293757106e-18,
    1.4988660813585e-18,
)


def _ierfc_scaled(a):
    """exp(a²) ierfc(a) for a >= 0."""
    coefficients = _IERFC if a.dtype == jnp.float64 else _IERFC[:16]
    t = (a - 3) / (a + 3)
    b, b_next = jnp.zeros_like(t), jnp.zeros_like(t)
    for c in reversed(coefficients[1:]):  # Clenshaw
        b, b_next = c + 2 * t * b - b_next, b
    return (coefficients[0] + t * b - b_next) / (math.sqrt(math.pi) * (1 + 2 * a * a))


@jax.custom_jvp
def _ierfc(a, square, rest):
    return _ierfc_scaled(a) * (jnp.exp(-square) * (1 - rest))


@_ierfc.defjvp
def _ierfc_jvp(primals, tangents):
    return _ierfc(*primals), -jax.scipy.special.erfc(primals[0]) * tangents[0]


def ierfc(a: Real, square: tuple[Real, Real] | None = None) -> Scalar:
    r"""First repeated integral of erfc, $\int_a^\infty \mathrm{erfc} = e^{-a^2}/\sqrt\pi - a\,\mathrm{erfc}(a)$, for `a >= 0`.

    This is the shape of every Gaussian projected area: Beckmann's Λ is `ierfc(a) / (2 a)`. The two terms agree in all
    but $1/2a^2$ of themselves, hence a Chebyshev series (after Shepherd & Laframboise 1981) times the exponential.

    - `square`: a² in two words: the rounding of `a` alone changes the exponential by 2a² times as much.
    """
    a = jnp.asarray(a)
    return _ierfc(a, *(square or (a * a, jnp.zeros_like(a))))


# exp(a²) erfc(a) as a power series: up to a = 1/2 the first term left out is below half an ulp. The functions themselves
# round twice more, and take the compiler longer.
_ERFCX = [(-1) ** k / math.gamma(k / 2 + 1) for k in range(28)]


def gaussian_tails(a: Real) -> tuple[Scalar, Scalar]:
    """`exp(a²) erfc(a)` and `exp(a²) ierfc(a)` for `a >= 0`: the tails without their underflow."""
    scaled = _ierfc_scaled(a)
    small = a < 0.5
    direct = _horner(_ERFCX if a.dtype == jnp.float64 else _ERFCX[:16], jnp.where(small, a, 0))
    return jnp.where(small, direct, (1 / math.sqrt(math.pi) - scaled) / jnp.where(small, 1, a)), scaled


def _x_minus_sin(x):
    """x − sin x for 0 <= x <= pi, without the cancellation at 0."""
    square = x * x
    # x^3/3! - x^5/5! + ...: where it is used (x < 1.5), 13 terms reach the last bit of float64.
    series = _horner([(-1) ** k / math.factorial(2 * k + 3) for k in range(13)], square)
    return jnp.where(x < 1.5, x * square * series, x - jnp.sin(x))


@jax.custom_jvp
def kepler(v: Real) -> tuple[Scalar, Scalar]:
    r"""$(\cos\frac E2, \sin\frac E2)$ for the root E in [0, π] of $E - \sin E = 2\pi v$, `v` in [0, 1/2]: Kepler's equation at
    eccentricity 1.

    E/2 is the angle that cuts the fraction `v` of a disk's area, so this inverts the marginal of a uniform disk.
    """
    v = jnp.asarray(v)
    target = (2 * math.pi) * v
    # E ~ (6 target)^(1/3) for small targets, and within 16 % of the root everywhere: Halley's third step is exact.
    E = jnp.cbrt(6 * target)
    for _ in range(4):
        f = _x_minus_sin(E) - target
        slope = 2 * jnp.sin(E / 2) ** 2
        slope = jnp.where(slope > 0, slope, 1)
        step = f / slope
        E = E - step / (1 - 0.5 * step * (jnp.sin(E) / slope))
    # Towards 1/2 the cosine has the digits of π − E, the root of x + sin x = π − 2πv: one step of Newton's.
    x = math.pi - E
    x = x - (x + jnp.sin(x) - (2 * math.pi) * (0.5 - v)) / (1 + jnp.cos(jnp.minimum(x, 2)))
    far = v > 0.25
    return jnp.where(far, jnp.sin(x / 2), jnp.cos(E / 2)), jnp.where(far, jnp.cos(x / 2), jnp.sin(E / 2))


@kepler.defjvp
def _kepler_jvp(primals, tangents):
    c, s = kepler(*primals)
    turn = jnp.where(s > 0, math.pi / 2 / jnp.where(s > 0, s, 1), 0)  # of E/2, times sin E/2
    return (c, s), (-turn * tangents[0], turn * (c / jnp.where(s > 0, s, 1)) * tangents[0])
