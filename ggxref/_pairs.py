"""Numbers as unevaluated sums of two of a dtype, `(value, rest)`, for sums that cancel twice over: A's minors, then what they
are multiplied with. In components, which XLA fuses, where arrays of three would be stored.

A rest has no derivative of its own: the value's is the whole one's. Value and rest have to meet within one fusion: in two,
XLA computes the value twice, once contracted to FMAs and once not, and the rest belongs to one of them. Divisions with more
than one use are what cuts an expression in pieces.
"""

import jax
import jax.numpy as jnp
from jax import Array, lax
from jaxtyping import Bool

from ggxref import stable
from ggxref._errorfree import collected, fast_two_sum, two_product, two_sum
from ggxref._types import Mat3, Real, Scalar

Pair = tuple[Scalar, Scalar]
Triple = tuple[Scalar, Scalar, Scalar]
Pairs = tuple[Pair, Pair, Pair]


@jax.custom_jvp
def dot(a: tuple[Scalar, ...], b: tuple[Scalar, ...]) -> Pair:
    """`a · b`: the rest leaves out only what is below the square of ε."""
    value, errors = collected([two_product(x, y) for x, y in zip(a, b, strict=True)])
    return value, sum(errors, jnp.zeros_like(value))


@dot.defjvp
def _dot_jvp(primals, tangents):
    (a, b), (da, db) = primals, tangents
    value, rest = dot(a, b)
    change = sum((x * dy + dx * y for x, dx, y, dy in zip(a, da, b, db, strict=True)), jnp.zeros_like(value))
    return (value, rest), (change, jnp.zeros_like(rest))


def rounded(pair: Pair) -> Scalar:
    """The sum, in one number."""
    return pair[0] + pair[1]


def total(a: Pair, b: Pair) -> Pair:
    """`a + b`, as the following ones without a derivative of its own."""
    value, rest = two_sum(a[0], b[0])
    return fast_two_sum(value, rest + (a[1] + b[1]))


def less(a: Pair, b: Pair) -> Pair:
    """`a - b`."""
    return total(a, minus(b))


def product(a: Pair, b: Pair) -> Pair:
    """`a b`."""
    value, rest = two_product(a[0], b[0])
    return value, rest + (a[0] * b[1] + a[1] * b[0])


def minus(a: Pair) -> Pair:
    """`-a`."""
    return -a[0], -a[1]


def scaled(a: Pair, factor: Real) -> Pair:
    """`a` times a power of two, or its negative."""
    return a[0] * factor, a[1] * factor


def choice(condition: Bool[Array, ""], a: Pair, b: Pair) -> Pair:
    """`where`."""
    return jnp.where(condition, a[0], b[0]), jnp.where(condition, a[1], b[1])


def rows(A: Mat3) -> tuple[Triple, Triple, Triple]:
    """A matrix in components."""
    (a, b, c), (d, e, f), (g, h, i) = A
    return (a, b, c), (d, e, f), (g, h, i)


def cross(a: tuple[Scalar, ...], b: tuple[Scalar, ...]) -> Pairs:
    """`a × b`."""
    x, y, z = (_evened(*dot((a[j], a[k]), (b[k], -b[j]))) for j, k in ((1, 2), (2, 0), (0, 1)))
    return x, y, z


def cross_of_pairs(a: Pairs, b: Pairs) -> Pairs:
    """`a × b` of two-word vectors: exact also where they are parallel but for half their digits."""

    def component(j, k):
        value, rest = dot((a[j][0], a[k][0]), (b[k][0], -b[j][0]))
        return _evened(
            value, rest + ((a[j][0] * b[k][1] + a[j][1] * b[k][0]) - (a[k][0] * b[j][1] + a[k][1] * b[j][0]))
        )

    return component(1, 2), component(2, 0), component(0, 1)


def dot_of_pairs(a: Pairs, b: Triple) -> Pair:
    """`a · b` of a two-word vector."""
    value, rest = dot(tuple(hi for hi, _ in a), b)
    return _evened(value, rest + (a[0][1] * b[0] + a[1][1] * b[1] + a[2][1] * b[2]))


def _evened(value: Scalar, rest: Scalar) -> Pair:
    """The pair of that sum: where the values cancelled, the rest is as large."""
    total = value + rest
    return total, lax.stop_gradient((value - total) + rest)


def inner(a: Pairs, b: Pairs) -> Pair:
    """`a · b` of two such."""
    value, rest = dot_of_pairs(a, (b[0][0], b[1][0], b[2][0]))
    return value, rest + (a[0][0] * b[0][1] + a[1][0] * b[1][1] + a[2][0] * b[2][1])


def weighted(weights: tuple[Scalar, ...], pairs: tuple[Pair, ...]) -> Scalar:
    """The sum of the pairs, each times its weight, rounded once."""
    value, rest = dot(weights, tuple(value for value, _ in pairs))
    return value + (rest + sum(w * low for w, (_, low) in zip(weights, pairs, strict=True)))


def times(A: Mat3, w: Triple) -> Pairs:
    """`A w`."""
    x, y, z = (dot(row, w) for row in rows(A))
    return x, y, z


def cofactor(A: Mat3) -> tuple[Pairs, Pairs, Pairs]:
    r"""The rows of $\det(A)\,A^{-T}$."""
    a, b, c = rows(A)
    return cross(b, c), cross(c, a), cross(a, b)


def determinant(A: Mat3) -> Pair:
    r"""$\det A$."""
    a, b, c = rows(A)
    return dot_of_pairs(cross(b, c), a)


@jax.custom_jvp
def tangent_square(x: Scalar, y: Scalar, z: Scalar, ax: Scalar, ay: Scalar) -> Pair:
    r"""$(x^2/\alpha_x^2 + y^2/\alpha_y^2)/z^2$, `z > 0`: an exponent, whose error is one of its exponential times as large."""
    zero, z_square = jnp.zeros_like(z), dot((z,), (z,))
    p, q = (ratio((c, zero), (a, zero)) for c, a in ((x, ax), (y, ay)))
    return ratio(square_of_pairs(p, q), z_square)


@tangent_square.defjvp
def _tangent_square_jvp(primals, tangents):
    (x, y, z, ax, ay), (dx, dy, dz, dax, day) = primals, tangents
    value, rest = tangent_square(*primals)
    p, q = x / (ax * z), y / (ay * z)
    change = 2 * (p * (dx / ax - p * (z / ax) * dax) + q * (dy / ay - q * (z / ay) * day)) / z - 2 * value * (dz / z)
    return (value, rest), (change, jnp.zeros_like(rest))


def square_of_pairs(*a: Pair) -> Pair:
    """The sum of their squares."""
    values = tuple(value for value, _ in a)
    square, rest = dot(values, values)
    return square, rest + 2 * sum((value * rest for value, rest in a), jnp.zeros_like(square))


def over(a: Pair, b: Pair, inverse: Scalar) -> Pair:
    """The quotient, with `inverse` for 1/b: products alone, which leave a loop whole."""
    value = a[0] * inverse
    product, error = two_product(value, b[0])
    return value, (((a[0] - product) - error) + (a[1] - value * b[1])) * inverse


def root(a: Pair, inverse: Scalar) -> Pair:
    """The square root, with `inverse` for its inverse."""
    value = a[0] * inverse
    product, error = two_product(value, value)
    return value, (((a[0] - product) - error) + a[1]) * (inverse / 2)


def ratio(a: Pair, b: Pair) -> Pair:
    """`a / b`, `b` from 1e-37 to 1e37."""
    return over(a, b, stable.reciprocal(b[0]))


def square_root(a: Pair) -> Pair:
    """The square root; 0 for what rounding made negative."""
    zero = jnp.zeros_like(a[0])
    a = choice(a[0] <= 0, (zero, zero), a)  # not of NaN
    return root(a, stable.rsqrt(a[0]))


def or_one(condition: Bool[Array, ""], a: Pair) -> Pair:
    """A divisor, near 1 where there is none."""
    return jnp.where(condition, a[0], 1), a[1]


def sum_by_squares(a: Pair, b: Pair, squares: Pair) -> Pair:
    """`a + b`, where it would cancel as the quotient of `squares`, which is a² − b², by `a - b`."""
    differ = ((a[0] > 0) & (b[0] < 0)) | ((a[0] < 0) & (b[0] > 0))
    return choice(differ, ratio(squares, or_one(differ, less(a, b))), total(a, b))


def one_pass(*pairs: Pair) -> tuple[Pair, ...]:
    """`stable.one_loop` of pairs. XLA does not vectorise a whole sampler in two words as one loop, nor one of 16 results."""
    flat = stable.one_loop(*(word for pair in pairs for word in pair))
    return tuple(zip(flat[::2], flat[1::2], strict=True))
