"""Kepler's equation at eccentricity 1, by Chebyshev series in two words: it inverts the marginal of a uniform disk."""

import math

import jax
import jax.numpy as jnp
from jax import lax

from ggxref._errorfree import fast_two_sum, two_product
from ggxref._pairs import Pair, choice
from ggxref._special import TAU_REST, horner, two_word_powers
from ggxref._types import Real, Scalar

# Taylor coefficients of (sin x − x)/x³ and (cos x − 1 + x²/2)/x⁴ in x².
_SINE = [(-1) ** k / math.factorial(2 * k + 1) for k in range(1, 10)]
_COSINE = [(-1) ** k / math.factorial(2 * k) for k in range(2, 11)]


# Chebyshev coefficients of E/4π over w = v^(1/3), in 8 w² − 1, and of (π − E)/4π over d = 1/2 − v, in 128 d²/9 − 1: E of
# `kepler`, up to v = 1/8 and from there on. tests/test_stable.py computes them again with arb.
_KEPLER_NEAR = (
    0.27373137601720254,
    0.007135259045858628,
    0.00024371797026280213,
    1.0855022415556047e-05,
    5.481501206835336e-07,
    2.978469451636786e-08,
    1.6980439530995776e-09,
    1.0014660759912268e-10,
    6.057314463054036e-12,
    3.735866874587357e-13,
    2.3401426544559826e-14,
    1.4845159694774116e-15,
    9.516738185171933e-17,
)
_KEPLER_FAR = (
    0.26887894686018443,
    0.020660468553657853,
    0.002002799141877438,
    0.0002526200015789652,
    3.613616561824433e-05,
    5.564513787932918e-06,
    8.993386696716911e-07,
    1.5040441726102928e-07,
    2.5800911710162963e-08,
    4.5137433332609895e-09,
    8.02091179414251e-10,
    1.4435679356584195e-10,
    2.625662276966304e-11,
    4.818482423580063e-12,
    8.910240037646088e-13,
    1.6585487164549058e-13,
    3.105016650813989e-14,
    5.84249781510308e-15,
    1.1042933395719963e-15,
    2.095624866272094e-16,
    3.991253708041466e-17,
    7.626422005656268e-18,
)

# What their first coefficients have beyond float64.
_KEPLER_RESTS = 1.7946030696967673e-17, 1.7949918229824025e-17


_NEAR, _FAR = (
    two_word_powers(series, rest, (math.tau, TAU_REST), terms)  # of E/2
    for series, rest, terms in zip((_KEPLER_NEAR, _KEPLER_FAR), _KEPLER_RESTS, (7, 11), strict=True)
)

# The bits of 1/∛x are these less a third of those of x, to within 4 %.
_CBRT = {jnp.dtype("float32"): (jnp.int32, 0x54A2328C, 2), jnp.dtype("float64"): (jnp.int64, 0x553EF0FF289DD796, 3)}


def _cbrt(x):
    r"""$\sqrt[3]x$ for 0 <= x <= 1, and what its rounding left out: XLA's is a power."""
    integer, magic, steps = _CBRT[x.dtype]
    small = x < 2.0**-60  # whose products would be subnormal
    x, scale = jnp.where(small, x * 2.0**60, x), jnp.where(small, 2.0**-20, 1).astype(x.dtype)
    third = (lax.bitcast_convert_type(x, integer).astype(x.dtype) / 3).astype(integer)
    inverse = lax.bitcast_convert_type(integer(magic) - third, x.dtype)
    for _ in range(steps):
        inverse = inverse * (4 - x * inverse * inverse * inverse) / 3
    square, square_rest = two_product(inverse, inverse)
    root, rest = two_product(x, square)
    product, product_rest = two_product(root, inverse)
    # x inverse³ is 1 but for three times the error of the inverse.
    off = (1 - product) - (product_rest + (rest + x * square_rest) * inverse)
    return fast_two_sum(root * scale, (rest + x * square_rest + root * off * (2 / 3)) * scale)


def _odd(series, x, rest, t):
    """`x` times the series at `t`, of which all but the constant are small, in two words."""
    constant, constant_rest, *others = series
    value, error = two_product(x, jnp.asarray(constant, x.dtype))
    return fast_two_sum(value, x * (t * horner(others, t) + constant_rest) + (rest * constant + error))


def _cos_sin(angle, rest):
    """Cosine and sine of an angle in [0, 0.9], each of two words: what is not exact is small."""
    wide = angle.dtype == jnp.float64
    square, square_rest = two_product(angle, angle)
    high = 1 - square / 2
    lost = (1 - high) - square / 2
    s = fast_two_sum(angle, rest * high + angle * (square * horner(_SINE[: 9 if wide else 5], square)))
    beyond = square * square * horner(_COSINE[: 9 if wide else 5], square) - (square_rest / 2 + s[0] * rest)
    return fast_two_sum(high, lost + beyond), s


@jax.custom_jvp
def kepler(v: Real) -> tuple[Scalar, Scalar]:
    """`kepler_pairs`, rounded; with a derivative."""
    (c, c_rest), (s, s_rest) = kepler_pairs(jnp.asarray(v))
    return c + c_rest, s + s_rest


def kepler_pairs(v: Scalar) -> tuple[Pair, Pair]:
    r"""$(\cos\frac E2, \sin\frac E2)$ for the root E in [0, π] of $E - \sin E = 2\pi v$, `v` in [0, 1/2]: Kepler's equation at
    eccentricity 1.

    E/2 is the angle that cuts the fraction `v` of a disk's area, so this inverts the marginal of a uniform disk. E is an odd
    function of the cube root of `v`, π − E one of 1/2 − v; the cosine takes its digits from the latter.
    """
    upper = v > 0.125
    (w, w_rest), d = _cbrt(jnp.where(upper, 0, v)), 0.5 - v
    near = _odd(_NEAR[v.dtype], w, w_rest, 8 * w * w - 1)
    far = _odd(_FAR[v.dtype], d, (0.5 - d) - v, (128 / 9) * d * d - 1)
    c, s = _cos_sin(*(jnp.where(upper, y, x) for x, y in zip(near, far, strict=True)))
    return choice(upper, s, c), choice(upper, c, s)


@kepler.defjvp
def _kepler_jvp(primals, tangents):
    c, s = kepler(*primals)
    turn = jnp.where(s > 0, math.pi / 2 / jnp.where(s > 0, s, 1), 0)  # of E/2, times sin E/2
    return (c, s), (-turn * tangents[0], turn * (c / jnp.where(s > 0, s, 1)) * tangents[0])
