"""Error-free transformations: what rounding took from a sum, a product or a quotient, as a number of its own."""

import functools

import jax
import jax.numpy as jnp
from jax import lax

# Bits of the significand that the high half keeps, so that a product of two halves is exact.
_HIGH = {jnp.dtype("float32"): (jnp.uint32, 0xFFFFF000), jnp.dtype("float64"): (jnp.uint64, 0xFFFFFFFFF8000000)}


# What it decorates is traced once for each dtype and shape, wherever it is used.
traced_once = functools.partial(jax.jit, inline=True)


@traced_once
def _split(a):
    """`a` as the exact sum of a high half and a low half, each short enough for products without rounding.

    The bits are masked, not subtracted as Veltkamp does: the compiler contracts `c - (c - a)` to FMAs.
    """
    integer, mask = _HIGH[a.dtype]
    high = lax.bitcast_convert_type(lax.bitcast_convert_type(a, integer) & integer(mask), a.dtype)
    return high, a - high


@traced_once
def two_product(a, b):
    """`a b`, rounded, and the rest (Dekker 1971)."""
    p = a * b
    (ah, al), (bh, bl) = _split(a), _split(b)
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


@traced_once
def two_sum(a, b):
    """`a + b`, rounded, and the rest (Knuth 1969)."""
    s = a + b
    t = a - s  # not s - a: of (b + 1) - 1 XLA makes b
    return s, (a - (s + t)) + (b + t)


def fast_two_sum(a, b):
    """As `two_sum`, where `a` is the larger one (Dekker 1971)."""
    total = a + b
    return total, (a - total) + b  # as above


@traced_once
def quotient(x, a):
    """`x / a`, rounded, and the rest to within ε²."""
    q = x / a
    p, error = two_product(q, a)
    return q, ((x - p) - error) / a


def collected(products):
    """The rounded sum of `(value, error)` pairs, and everything that it leaves out."""
    (total, error), *others = products
    errors = [error]
    for value, error in others:
        total, lost = two_sum(total, value)
        errors += [error, lost]
    return total, errors
