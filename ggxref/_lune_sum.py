"""The factor of every lune's area, and so of every σ, in two words."""

import jax

from ggxref import _pairs, stable
from ggxref._matrix import length_of_pairs, plain_cross, plain_dot, times
from ggxref._types import Mat3, Scalar


@jax.custom_jvp
def lune_sum(
    au: _pairs.Pairs, av: _pairs.Pairs, A: Mat3, u: tuple[Scalar, ...], v: tuple[Scalar, ...]
) -> tuple[Scalar, Scalar]:
    r"""$T = \|Au\|\|Av\| + Au\cdot Av$, the factor of every lune, and $T/\|Av\|$, each rounded once; exact also where $Au \approx -Av$.

    - `au`, `av`: `A u` and `A v`. Derivatives are by the others.

    There the sum cancels, and $\|Au \times Av\|^2 / (\|Au\|\|Av\| - Au\cdot Av)$ does not, of vectors in two words: rounded, they
    would have lost the angle between them.
    """
    return lune_parts(au, av)[:2]


def lune_parts(au, av):
    """The two of `lune_sum`, then Au × Av, and ‖Au‖ and ‖Av‖ in two words."""
    u_length, v_length = (length_of_pairs(a) for a in (au, av))
    product, n = _pairs.product(u_length, v_length), _pairs.cross_of_pairs(au, av)
    cosine = _pairs.inner(au, av)
    # Down to 110° the sum keeps its digits better.
    obtuse = cosine[0] < -product[0] / 3
    divisor = _pairs.or_one(obtuse, _pairs.less(product, cosine))
    conjugate = _pairs.ratio(_pairs.square_of_pairs(*n), divisor)
    total = _pairs.choice(obtuse, conjugate, _pairs.total(product, cosine))
    ratio = _pairs.ratio(total, v_length)
    return _pairs.rounded(total), _pairs.rounded(ratio), tuple(map(_pairs.rounded, n)), u_length, v_length


def directions(a, b, a_length, b_length, total, n):
    r"""$\hat b$, and $\hat a + \hat b$ as $(T\hat a + n \times \hat a)/(\|a\|\|b\|)$, which keeps its digits where they are nearly opposite."""
    a, b = ([value / norm for value, _ in pair] for pair, norm in ((a, a_length), (b, b_length)))
    product = a_length * b_length
    return b, [(total * c + d) / product for c, d in zip(a, plain_cross(n, a), strict=True)]


@lune_sum.defjvp
def _lune_sum_jvp(primals, tangents):
    r"""With $a = Au$, $b = Av$, $n = a \times b$: by a, of T, $\|b\| h$ with $h = \hat a + \hat b$ (`directions`); by A,
    $h\,(\|b\| u + \|a\| v)^T$, in two words, as it cancels where $u \approx -v$. $T/\|b\|$ keeps, by b, only what is
    perpendicular to it."""
    (au, av, A, u, v), (_, _, dA, du, dv) = primals, tangents
    total, ratio, n, a_length, b_length = lune_parts(au, av)
    s = [_pairs.weighted((x, y), (b_length, a_length)) for x, y in zip(u, v, strict=True)]
    a_length, b_length = map(_pairs.rounded, (a_length, b_length))
    total, ratio, a_length, b_length, *rest = stable.one_loop(total, ratio, a_length, b_length, *n, *s)
    n, s = rest[:3], rest[3:]
    b, h = directions(au, av, a_length, b_length, total, n)
    by_a, by_A = b_length * plain_dot(h, times(A, *du)), plain_dot(h, times(dA, *s))
    db = times(A, *dv)
    across = -plain_dot(plain_cross(n, b), db) / b_length
    by_total = by_a + by_A + across + ratio * plain_dot(b, db)
    return (total, ratio), (by_total, (by_a + by_A + across - ratio * plain_dot(b, times(dA, *v))) / b_length)
