"""The cap's half vector in two words. `_sphere.half_in_cap` takes off what the sum loses along the azimuth; what `A wi`, its
length and the cosine lose, a skewed ellipsoid makes many of.
"""

import jax
import jax.numpy as jnp
from jax import lax

from ggxref import _pairs, _special
from ggxref._canonical import Canonical
from ggxref._errorfree import two_sum
from ggxref._matrix import length
from ggxref._pairs import Pair, Pairs, less, one_pass, product, square_root, total
from ggxref._types import Real, Scalar, Turn, Vec2, Vec3
from ggxref.sampling._ellipsoid import poles, shortened, to_sphere
from ggxref.sampling._sphere import incident, sum_in_cap

Azimuth = tuple[Pair, Pair]


@jax.custom_jvp
def half_in_two_words(u: Vec2, azimuth: Azimuth, i: Pairs, cut: Scalar) -> Pairs:
    """`_sphere.sum_in_cap` in units of i's length, whose largest component is near 1.

    - `azimuth`: (cos 2πu₀, sin 2πu₀). `cut`: in the unit of `i`.
    """
    x, y, z = i
    zero = jnp.zeros_like(cut)
    _, rise, fall = poles(_pairs.square_of_pairs(x, y), z)
    cap, fall = one_pass(less(rise, (cut, zero)), fall)
    depth = product((u[1], zero), cap)
    up = total(product(two_sum(jnp.ones_like(u[1]), -u[1]), cap), (cut, zero))
    sine, up = one_pass(square_root(product(depth, total(fall, up))), up)
    c, s = azimuth
    return total(product(sine, c), x), total(product(sine, s), y), up


def _plain(u, azimuth, i, cut):
    h = sum_in_cap(u, incident(*i), cut / length(*i), lambda _: azimuth)
    return h.x, h.y, h.z


@half_in_two_words.defjvp
def _half_in_two_words_jvp(primals, tangents):
    """A direction does not depend on the length of what it is made of, which is taken as constant."""
    (u, azimuth, i, cut), (du, dazimuth, di, dcut) = primals, tangents
    azimuth, i, dazimuth, di = (tuple(value for value, _ in a) for a in (azimuth, i, dazimuth, di))
    size = lax.stop_gradient(length(*i))
    _, change = jax.jvp(_plain, (u, azimuth, i, cut), (du, dazimuth, di, dcut))
    x, y, z = ((size * d, jnp.zeros_like(d)) for d in change)
    return half_in_two_words(*primals), (x, y, z)


def half_vector(u: Vec2, wi: Vec3, A: Canonical, cut: Real, turn: Turn | None) -> Pairs:
    """`half_in_two_words` about `A wi`. `cut`: in the unit of `A wi`."""
    i, scale = shortened(to_sphere(wi, A))
    azimuth = _special.two_word_turn(u[0]) if turn is None else tuple((c, jnp.zeros_like(c)) for c in turn(u[0]))
    x, y, z = one_pass(*half_in_two_words(u, azimuth, i, cut * scale))
    return x, y, z
