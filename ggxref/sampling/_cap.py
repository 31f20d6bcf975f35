"""The cap's half vector in two words. `_sphere.half_in_cap` takes off what the sum loses along the azimuth; what `A wi`, its
length and the cosine lose, a skewed ellipsoid makes many of.
"""

import jax
import jax.numpy as jnp
from jax import lax

from ggxref import _pairs, _special, stable
from ggxref._canonical import Canonical
from ggxref._errorfree import two_sum
from ggxref._matrix import length, reciprocal_scale
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


def _parts(u, i, cut):
    """i in units of its length N; ρ = ‖(i.x, i.y)‖; by how much more c is away from the axis, without the difference; the sum's height."""
    i, cut = incident(*i), cut / length(*i)
    h = sum_in_cap(u, i, cut, lambda _: (jnp.zeros_like(cut), jnp.zeros_like(cut)))
    rho = jnp.where(jnp.abs(i.z) > 0.5, length(i.x, i.y, 0), stable.sqrt(i.rise * i.fall))
    both = stable.sqrt(h.square) + rho
    both = jnp.where(both * both < jnp.finfo(both.dtype).tiny, 1, both)  # c is i is the pole
    scale = reciprocal_scale(both)  # of the second derivatives both³ is a divisor
    return i.x, i.y, rho, -h.z * (h.climb * scale) / (both * scale), h.z


@half_in_two_words.defjvp
def _half_in_two_words_jvp(primals, tangents):
    r"""Of $h = (\rho_c - \rho)\hat c + \rho(\hat c + \hat\imath)$, of the azimuths' unit vectors: where c is nearly -i, either bracket
    is small, and is known without cancellation, the latter from h.

    A direction does not depend on the length of what it is made of, which is taken as constant.
    """
    (u, azimuth, i, cut), (du, dazimuth, di, dcut) = primals, tangents
    (c, s), i, (dc, ds), di = (tuple(value for value, _ in a) for a in (azimuth, i, dazimuth, di))
    half, size = half_in_two_words(*primals), lax.stop_gradient(length(*i))
    (x, y, rho, more, _), (dx, dy, drho, dmore, dz) = jax.jvp(_parts, (u, i, cut), (du, di, dcut))
    at_pole, over = rho == 0, 1 / jnp.where(rho == 0, 1, rho)
    x, y = x * over, y * over
    turned = x * dy - y * dx
    opposite = ((c + x) ** 2 + (s + y) ** 2 < 0.25) & (jnp.abs(more) < rho)
    changes = []
    for (h, _), a, da, b, db, aside in ((half[0], c, dc, x, dx, -y), (half[1], s, ds, y, dy, x)):
        both = jnp.where(opposite, (h / size - more * a) * over, a + b)
        changes.append(dmore * a + (more + rho) * da + jnp.where(at_pole, drho * a + db, drho * both + turned * aside))
    x, y, z = ((size * d, jnp.zeros_like(d)) for d in (*changes, dz))
    return half, (x, y, z)


def half_vector(u: Vec2, wi: Vec3, A: Canonical, cut: Real, turn: Turn | None) -> Pairs:
    """`half_in_two_words` about `A wi`. `cut`: in the unit of `A wi`."""
    i, scale = shortened(to_sphere(wi, A))
    azimuth = _special.two_word_turn(u[0]) if turn is None else tuple((c, jnp.zeros_like(c)) for c in turn(u[0]))
    x, y, z = one_pass(*half_in_two_words(u, azimuth, i, cut * scale))
    return x, y, z
