"""Numerical primitives that the formulas stand on: each is here because the plain form loses digits.

Every function takes and returns the dtype of its arguments. Where a derivative is infinite (a square root at 0), the
derivative returned is 0, so that a gradient never holds NaN.
"""

import functools
import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array, lax
from jaxtyping import Bool, Float

from ggxref._errorfree import collected, quotient, traced_once, two_product, two_sum
from ggxref._types import Real, Scalar, Vec2, Vec3

Components = Float[Array, " n"] | tuple[Float[Array, "..."], ...]


def widened(function: Callable) -> Callable:
    """`function`, computed in float32 where it is given half precision: the square of 1e-4 is 0 in float16.

    The result has the dtype of all arguments together.
    """

    @functools.wraps(function)
    def in_float32(*args, **named):
        numbers = args, {k: x for k, x in named.items() if not (isinstance(x, str) or callable(x))}
        given = [jnp.result_type(x) for x in jax.tree.leaves(numbers)]
        if not any(jnp.issubdtype(each, jnp.floating) and each.itemsize == 2 for each in given):
            return function(*args, **named)
        dtype = jnp.result_type(*given)
        wide, wide_named = jax.tree.map(lambda x: jnp.asarray(x, jnp.promote_types(dtype, jnp.float32)), numbers)
        result = function(*wide, **(named | wide_named))
        return jax.tree.map(lambda x: x.astype(dtype) if jnp.issubdtype(x.dtype, jnp.floating) else x, result)

    return in_float32


@functools.partial(jax.custom_jvp, nondiff_argnums=(2,))
def _dot(a, b, fold):
    total, errors = collected([two_product(x, y) for x, y in zip(a, b, strict=True)])
    if fold == 2:
        return total + sum(errors)
    rest = 0
    for error in errors:  # these are summed the same way
        total, lost = two_sum(total, error)
        rest = rest + lost
    return total + rest


@_dot.defjvp
def _dot_jvp(fold, primals, tangents):
    (a, b), (da, db) = primals, tangents
    change, *terms = (x * dy + dx * y for x, dx, y, dy in zip(a, da, b, db, strict=True))
    for term in terms:
        change = change + term
    return _dot(a, b, fold), change


@widened
def dot(a: Components, b: Components) -> Array:
    r"""$a \cdot b$ in twice the working precision, rounded once: from two (3,), or from two tuples of equally many
    components, whose shapes broadcast.

    Ogita, Rump & Oishi 2005, algorithm 5.3.
    """
    return _dot(a, b, 2)


@widened
def cosine(w: Vec3, wm: Vec3) -> Scalar:
    r"""$\omega \cdot \omega_m$ in three times the working precision, rounded once.

    The plain sum has an unbounded relative error where the vectors are nearly perpendicular, and there the products
    cancel down to their own errors, which `dot` adds with a rounding each. On this stand the factor
    $\omega_i \cdot \omega_m$ of every visible density and the decision which side of a microfacet is seen.

    Ogita, Rump & Oishi 2005, algorithm 5.10 with K = 3.
    """
    return _dot(w, wm, 3)


@jax.custom_jvp
def over_heights(a: tuple[Scalar, ...], b: tuple[Scalar, ...], cosine: Scalar) -> Scalar:
    """`a · b / (a_z b_z)`, 1 + the product of the tangents; 0 where a height is. Its derivative is the product's alone.

    `cosine` is `a · b`, in as many digits as it needs.
    """
    return cosine * _inverse_heights(a, b)


def _inverse_heights(a, b):
    z = a[2] * b[2]
    return jnp.where(z == 0, 0, 1 / jnp.where(z == 0, 1, z))


@over_heights.defjvp
def _over_heights_jvp(primals, tangents):
    (a, b, _), (da, db, _) = primals, tangents
    inverse = _inverse_heights(a, b)
    product = (a[0] * b[0] + a[1] * b[1]) * inverse
    change = (a[0] * db[0] + b[0] * da[0] + a[1] * db[1] + b[1] * da[1]) * inverse
    return over_heights(*primals), change - product * (da[2] * b[2] + a[2] * db[2]) * inverse


def cross(a: Vec3, b: Vec3) -> Vec3:
    """$a \\times b$, each component as exact as `dot`: the plain ones cancel where a and b are nearly parallel."""
    # Component i takes the components i + 1 and i + 2, around the corner.
    a, b = jnp.tile(a, 2), jnp.tile(b, 2)
    return dot((a[1:4], a[2:5]), (b[2:5], -b[1:4]))


@widened
def excess(w: Vec3) -> Scalar:
    """By how much the length of `w`, a unit vector before it was rounded, exceeds 1: `(w·w − 1)/2`, to within ε²."""
    return _excess(*w)


@jax.custom_jvp
def _excess(x, y, z):
    total, errors = collected([two_product(c, c) for c in (z, x, y)])
    return ((total - 1) + sum(errors)) / 2


@_excess.defjvp
def _excess_jvp(primals, tangents):
    return _excess(*primals), sum(c * dc for c, dc in zip(primals, tangents, strict=True))


@widened
def unit_sum(a: Vec3, b: Vec3) -> tuple[Scalar, Scalar, Scalar]:
    """`a + b` for exactly unit directions: where they nearly cancel, what rounding added to the lengths is as large.

    The sum itself is then exact. A component at a time: arrays of three are neither inlined nor vectorised by XLA.
    """
    longer_a, longer_b = excess(a), excess(b)
    x, y, z = (p + q - (p * longer_a + q * longer_b) for p, q in zip(a, b, strict=True))
    return x, y, z


@widened
def weighted_sum(a: Vec3, b: Vec3, n_a: Real, n_b: Real) -> tuple[Scalar, Scalar, Scalar]:
    """`n_a a + n_b b` for exactly unit directions, as `unit_sum`; here the products are rounded, and cancel."""
    n_a, n_b = jnp.asarray(n_a, a.dtype), jnp.asarray(n_b, a.dtype)
    longer_a, longer_b = n_a * excess(a), n_b * excess(b)

    def component(x, y):
        total, errors = collected([two_product(n_a, x), two_product(n_b, y)])
        return total + (sum(errors) - (x * longer_a + y * longer_b))

    x, y, z = map(component, a, b)
    return x, y, z


@widened
def stretched_square(w: Vec3, alpha: Vec2) -> Scalar:
    r"""$(x^2/\alpha_x^2 + y^2/\alpha_y^2 + z^2) / \|w\|^2$, rounded once; its derivative is that of the numerator.

    D is the inverse of its square: half of D's error came from here, and half of that from a `w` that is unit only to its
    dtype.
    """
    return _stretched_square(w[0], w[1], w[2], alpha[0], alpha[1])


@widened
def scaled_square(w: Vec3, alpha: Vec2) -> Scalar:
    r"""$\alpha_x^2 x^2 + \alpha_y^2 y^2$, rounded once: plainly, half of Λ's error."""
    return _scaled_square(w[0], w[1], alpha[0], alpha[1])


@jax.custom_jvp
def _scaled_square(x, y, ax, ay):
    (p, p_rest), (q, q_rest) = two_product(ax, x), two_product(ay, y)
    total, errors = collected([two_product(c, c) for c in (p, q)])
    return total + (sum(errors) + 2 * (p * p_rest + q * q_rest))


@_scaled_square.defjvp
def _scaled_square_jvp(primals, tangents):
    (x, y, ax, ay), (dx, dy, dax, day) = primals, tangents
    return _scaled_square(*primals), 2 * (ax * x * (ax * dx + x * dax) + ay * y * (ay * dy + y * day))


@jax.custom_jvp
def _stretched_square(x, y, z, ax, ay):
    (p, p_rest), (q, q_rest) = quotient(x, ax), quotient(y, ay)
    total, errors = collected([two_product(c, c) for c in (p, q, z)])
    longer = 2 * _excess(x, y, z)
    square = jnp.where(longer > -1, 1 + longer, 1)  # ‖w‖², but for the zero vector
    return total + (sum(errors) + 2 * (p * p_rest + q * q_rest) - total * (longer / square))


@_stretched_square.defjvp
def _stretched_square_jvp(primals, tangents):
    (x, y, z, ax, ay), (dx, dy, dz, dax, day) = primals, tangents
    p, q = x / ax, y / ay
    change = p * ((dx - p * dax) / ax) + q * ((dy - q * day) / ay) + z * dz
    return _stretched_square(*primals), 2 * change


def log1p(x: Scalar) -> Scalar:
    """`log(1 + x)`. XLA's own, in float64, is 129 ULP off on (−0.42, −0.29), where `1 + x` has digits enough."""
    far = x < -0.29
    return jnp.where(far, jnp.log(1 + jnp.where(far, x, 0)), jnp.log1p(jnp.where(far, 0, x)))


@jax.custom_jvp
def lobe(a: Scalar, b: Scalar, q: Scalar) -> Scalar:
    r"""$1/(\pi a b q^2)$, the shape of every GGX: each product within the range, and in the derivative each quotient."""
    return 1 / (math.pi * (a * q) * (b * q))


@lobe.defjvp
def _lobe_jvp(primals, tangents):
    value = lobe(*primals)
    da, db, dq = (dx / x for x, dx in zip(primals, tangents, strict=True))
    return value, -value * (da + db + 2 * dq)


@jax.custom_jvp
def one_minus_square(x: Scalar) -> Scalar:
    """`1 - x²`, exact near 1, with the derivative -2x: that of the product cancels near 0."""
    return (1 - x) * (1 + x)


@one_minus_square.defjvp
def _one_minus_square_jvp(primals, tangents):
    return one_minus_square(*primals), -2 * primals[0] * tangents[0]


@jax.custom_jvp
def sqrt(x: Real) -> Scalar:
    """Square root with derivative 0, not infinity, at `x <= 0`; 0 for negative `x`, which only rounding may make."""
    return jnp.sqrt(jnp.maximum(x, 0))


@sqrt.defjvp
def _sqrt_jvp(primals, tangents):
    (x,), (dx,) = primals, tangents
    root = sqrt(x)
    # The derivative is written by hand: the two `where` that would stop its NaN cost a third of a sampler's time.
    return root, jnp.where(root > 0, 0.5 / jnp.where(root > 0, root, 1), 0) * dx


# The bits of 1/√x less those of x halved, to within 4 % of x; each Newton step doubles the digits.
_RSQRT = {jnp.dtype("float32"): (jnp.uint32, 0x5F3759DF, 3), jnp.dtype("float64"): (jnp.uint64, 0x5FE6EB50C7B537A9, 4)}


@jax.custom_jvp
@traced_once
def rsqrt(x: Scalar) -> Scalar:
    r"""$1/\sqrt x$ to within 1 ulp, for positive finite `x` in the normal range.

    By Newton's method, all products: XLA cuts a loop in two at a root or a quotient that several of its results use.
    """
    integer, magic, steps = _RSQRT[x.dtype]
    guess = integer(magic) - (lax.bitcast_convert_type(x, integer) >> 1)
    root = lax.bitcast_convert_type(guess, x.dtype)
    for _ in range(steps):
        root = root + 0.5 * root * (1 - x * root * root)
    return root


@rsqrt.defjvp
def _rsqrt_jvp(primals, tangents):
    (x,), (dx,) = primals, tangents
    root = rsqrt(x)
    return root, -0.5 * root / x * dx


def floats(*numbers: Real) -> tuple[Array, ...]:
    """As arrays of their common floating dtype: a rule of differentiation takes no integer, and one dtype for all."""
    dtype = jnp.result_type(*numbers, 1.0)
    return tuple(jnp.asarray(x, dtype) for x in numbers)


@jax.custom_jvp
def turning(x: Scalar, y: Scalar, z: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """The vector as it is, for what depends on its direction alone: as if its length were a constant.

    A change along the vector cancels later on, but for its rounding, next to which what turns a smooth surface's normals is
    small. Here it is left out before.
    """
    return x, y, z


@turning.defjvp
def _turning_jvp(primals, tangents):
    (x, y, z), (dx, dy, dz) = primals, tangents
    square = x * x + y * y + z * z
    length = jnp.sqrt(jnp.where(square > 0, square, 1))
    p, q, r = x / length, y / length, z / length
    held = lax.stop_gradient(length) / length  # 1, for second derivatives
    turned = (
        held * ((q * q + r * r) * dx - p * (q * dy + r * dz)),
        held * ((p * p + r * r) * dy - q * (p * dx + r * dz)),
        held * ((p * p + q * q) * dz - r * (p * dx + q * dy)),
    )
    return turning(*primals), turned


@widened
def unit(x: Scalar, y: Scalar, z: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """The components divided by their length; the zero vector stays zero, with a zero gradient."""
    x, y, z = turning(x, y, z)
    square = x * x + y * y + z * z
    scale = lax.stop_gradient(rsqrt(jnp.where(square > 0, square, 1)))
    return x * scale, y * scale, z * scale


@jax.custom_jvp
@traced_once
def one_loop(*components: Scalar) -> tuple[Scalar, ...]:
    """The components as they are, of one dtype and shape, all computed in the same pass over the points.

    XLA's loops on a CPU have one result each, so that components repeat what they share, or wait for it in memory; only
    a reduction may have several. Hence each becomes the larger of itself and -inf.
    """
    lowest = jnp.asarray(-jnp.inf, components[0].dtype)
    rows = [lax.pad(c[None], lowest, [(0, 1, 0)] + [(0, 0, 0)] * c.ndim) for c in components]

    def larger(a, b):
        return [lax.max(p, q) for p, q in zip(a, b, strict=True)]

    return tuple(lax.reduce(rows, [lowest] * len(rows), larger, [0]))


@one_loop.defjvp
def _one_loop_jvp(primals, tangents):
    return one_loop(*primals), tangents


@widened
def direction(x: Scalar, y: Scalar, z: Scalar) -> Vec3:
    """`unit` as one array (3,): what a sampler ends with."""
    dtype = jnp.result_type(x, y, z)
    return jnp.stack(one_loop(*unit(*(jnp.asarray(c, dtype) for c in (x, y, z)))))


def either(condition: Bool[Array, ""], one: Vec3, other: Vec3) -> Vec3:
    """`where` of vectors, a component at a time: of whole ones under `vmap` it puts the points first, which costs strides."""
    return jnp.stack([jnp.where(condition, x, y) for x, y in zip(one, other, strict=True)])


@widened
def azimuth(x: Scalar, y: Scalar, pole: tuple[Real, Real] = (1.0, 0.0)) -> tuple[Scalar, Scalar]:
    """Cosine and sine of the azimuth of `(x, y)`; `pole` at the origin, where there is none."""
    (cosine, sine), square = _azimuth(x, y), x * x + y * y
    return jnp.where(square > 0, cosine, pole[0]), jnp.where(square > 0, sine, pole[1])


@jax.custom_jvp
def _azimuth(x, y):
    square = x * x + y * y
    scale = 1 / jnp.sqrt(jnp.where(square > 0, square, 1))
    return x * scale, y * scale


@_azimuth.defjvp
def _azimuth_jvp(primals, tangents):
    (x, y), (dx, dy) = primals, tangents
    cosine, sine = _azimuth(x, y)
    square = x * x + y * y
    turn = (cosine * dy - sine * dx) / jnp.sqrt(jnp.where(square > 0, square, 1))
    return (cosine, sine), (-sine * turn, cosine * turn)


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
