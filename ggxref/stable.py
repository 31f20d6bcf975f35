"""Numerical primitives that the formulas stand on: each is here because the plain form loses digits.

Every function takes and returns the dtype of its arguments. Where a derivative is infinite (a square root at 0), the
derivative returned is 0, so that a gradient never holds NaN.
"""

import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array, lax
from jaxtyping import Bool, Float

from ggxref._errorfree import collected, traced_once, two_product, two_sum
from ggxref._types import Real, Scalar, Vec3

Components = Float[Array, " n"] | tuple[Float[Array, "..."], ...]


def widened(function: Callable) -> Callable:
    """`function`, computed in float32 where it is given half precision: the square of 1e-4 is 0 in float16.

    The result has the dtype of all arguments together.
    """

    @functools.wraps(function)
    def in_float32(*args, **named):
        numbers = args, {k: x for k, x in named.items() if not (isinstance(x, str) or callable(x))}
        given = jax.tree.leaves(numbers)
        if not any(jnp.issubdtype(d, jnp.floating) and d.itemsize == 2 for d in map(jnp.result_type, given)):
            return function(*args, **named)
        dtype = jnp.result_type(*given)  # of Python's numbers beside arrays, the arrays'
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
def excess(w: Vec3 | tuple[Scalar, Scalar, Scalar]) -> Scalar:
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
def evened_sum(a: Vec3, b: Vec3) -> tuple[Scalar, Scalar, Scalar]:
    """`a + b` for directions of exactly equal length, at a seventh of `unit_sum`'s cost: a sum of two such is perpendicular to
    their difference, and what that product lacks of 0 tells which is longer, to within what half an ulp of either does.
    """
    x, y, z = (p + q for p, q in zip(a, b, strict=True))
    p, q, r = (p - q for p, q in zip(a, b, strict=True))
    longer = (x * p + y * q + z * r) / 4
    return x - longer * p, y - longer * q, z - longer * r


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
    return jnp.sqrt(jnp.where(x < 0, 0, x))  # one instruction, where a `maximum` that passes NaN on is three


@sqrt.defjvp
def _sqrt_jvp(primals, tangents):
    (x,), (dx,) = primals, tangents
    root = sqrt(x)
    # The derivative is written by hand: the two `where` that would stop its NaN cost a third of a sampler's time.
    return root, jnp.where(root <= 0, 0, 0.5 / jnp.where(root <= 0, 1, root)) * dx


def _from_exponent(x: Scalar, power: float, shift: float) -> Scalar:
    """$x^{power}$, `power` -1/2 or -1, to within a tenth: the bits of a number are nearly its logarithm. `shift` centres the error."""
    info = jnp.finfo(x.dtype)
    integer, bias = (jnp.uint32, 127) if info.bits == 32 else (jnp.uint64, 1023)
    bits = lax.bitcast_convert_type(x, integer)
    one = int(((1 - power) * bias - shift) * 2**info.nmant)
    return lax.bitcast_convert_type(integer(one) - (bits if power == -1.0 else bits >> 1), x.dtype)


@jax.custom_jvp
@traced_once
def rsqrt(x: Scalar) -> Scalar:
    r"""$1/\sqrt x$ to within 1 ulp, for positive finite `x` in the normal range; a finite number at 0.

    All products: XLA cuts a loop in two at a root or a quotient that several of its results use. A fitted cubic step leaves
    2.5e-5 of the error, each Newton step squares it.
    """
    root = _from_exponent(x, -0.5, 0.06787109375)
    rest = 1 - x * root * root
    root = root + root * rest * (0.501105 + 0.375732 * rest)
    for _ in range(1 if x.dtype == jnp.float32 else 2):
        root = root + 0.5 * root * (1 - x * root * root)
    return root


@rsqrt.defjvp
def _rsqrt_jvp(primals, tangents):
    (x,), (dx,) = primals, tangents
    root = rsqrt(x)
    return root, -0.5 * root / x * dx


@traced_once
def crude_quotient(a: Scalar, b: Scalar) -> Scalar:
    """`a / b` to within 4e-5 by products, for `b` from 0 to 1e38; 0 where `a` is 0. For a correction, which is small itself."""
    guess = _from_exponent(b, -1.0, 0.1577148)
    rest = 1 - b * guess
    return a * guess * (1 + rest * (0.9973773 + 1.11207204 * rest))


@jax.custom_jvp
@traced_once
def reciprocal(x: Scalar) -> Scalar:
    """`1 / x` to within 1 ulp by products, for `x` from 1e-37 to 1e37."""
    inverse = crude_quotient(jnp.ones_like(x), x)
    for _ in range(1 if x.dtype == jnp.float32 else 2):
        inverse = inverse + inverse * (1 - x * inverse)
    return inverse


@reciprocal.defjvp
def _reciprocal_jvp(primals, tangents):
    inverse = reciprocal(*primals)
    return inverse, -inverse * (inverse * tangents[0])


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


@jax.custom_jvp
def rising(high: Bool[Array, ""], x: Scalar, y: Scalar, z: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """`turning` with z, not the length, as the constant, where `high`: what is added to the vector in proportion to z then is, too."""
    return x, y, z


@rising.defjvp
def _rising_jvp(primals, tangents):
    (high, x, y, z), (_, dx, dy, dz) = primals, tangents
    height = jnp.where(high, z, 1)
    held = lax.stop_gradient(height) / height  # 1, for second derivatives
    share = jnp.where(high, dz / height, 0)
    return rising(*primals), (held * (dx - x * share), held * (dy - y * share), jnp.where(high, 0, dz))


@jax.custom_jvp
def plus_zero_times(value: Scalar, zero: Scalar, x: Scalar) -> Scalar:
    """`value + zero x` for a number that is 0 but for its derivative, at no cost to the value."""
    return value


@plus_zero_times.defjvp
def _plus_zero_times_jvp(primals, tangents):
    (value, zero, x), (dvalue, dzero, dx) = primals, tangents
    return plus_zero_times(value, zero, x), dvalue + (dzero * x + zero * dx)


@widened
def unit(x: Scalar, y: Scalar, z: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """The components divided by their length; the zero vector stays zero, with a zero gradient.

    For lengths whose square the dtype holds, in float32 from 2e-19 to 1.8e19: shorter ones come out with any length up to 7, longer
    ones as NaN. What is normalised here is near 1 by construction, or was scaled before (`_matrix.reciprocal_scale`): to scale
    each would cost every sampler.
    """
    x, y, z = turning(x, y, z)
    square = x * x + y * y + z * z
    scale = lax.stop_gradient(rsqrt(square))
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
