"""Directions: reflection, refraction, half vectors, frames."""

import jax
import jax.numpy as jnp
from jax import lax

from ggxref import _pairs, _squares, stable
from ggxref._types import Mat3, Real, Vec3


@stable.widened
def reflect(w: Vec3, wm: Vec3) -> Vec3:
    r"""Mirror direction of `w` about the micronormal: $\omega_o = 2(\omega \cdot \omega_m)\,\omega_m - \omega$.

    - `w`, `wm`: unit, (3,), any side; the result is unit, (3,), and on the other side of `wm`.

    dupuy2023 (5); heitz2014 §2.2 (which prints |ω_i·ω_m|: the same for the front faces that it samples).
    """
    twice = 2 * stable.dot(w, wm)
    return jnp.stack(stable.one_loop(*(twice * m - x for x, m in zip(w, wm, strict=True))))


@stable.widened
def refract(w: Vec3, wm: Vec3, eta: Real) -> Vec3:
    r"""Direction transmitted through a microfacet:
    $\omega_o = (\eta c - \mathrm{sgn}(c)\sqrt{1 + \eta^2 (c^2 - 1)})\,\omega_m - \eta\,\omega$, $c = \omega \cdot \omega_m$.

    - `w`, `wm`: unit, (3,), any side. `eta = n_i / n_o > 0`, `n_i` on the side of `w`.
    - Total reflection: the zero vector.

    heitz2014 §2.2, which prints n for n² under the root and takes the sign of ω·n; sgn(c) is the same for the microfacets
    that `w` can see, and right for every other.
    """
    c, (value, rest) = stable.cosine(w, wm), _pairs.dot(tuple(w), tuple(wm))
    rest = lax.stop_gradient((value - c) + (rest - c * (stable.excess(w) + stable.excess(wm))))
    square = _squares.refracted_square(c, rest, jnp.asarray(eta, c.dtype))
    root = stable.sqrt(square)
    along = jnp.where(c > 0, eta * c - root, eta * c + root)
    x, y, z = (jnp.where(square < 0, 0, along * m - eta * x) for x, m in zip(w, wm, strict=True))
    return jnp.stack(stable.one_loop(x, y, z))


@stable.widened
def half_reflection(wi: Vec3, wo: Vec3) -> Vec3:
    r"""The micronormal that reflects `wi` to `wo`: $\omega_h = (\omega_i + \omega_o)/\|\omega_i + \omega_o\|$.

    - `wi`, `wo`: unit, (3,). The zero vector where `wi = -wo`, which no mirror joins.

    dupuy2023 (6), walter2014 (4).
    """
    return stable.direction(*stable.unit_sum(wi, wo))


@stable.widened
def half_refraction(wi: Vec3, wo: Vec3, n_i: Real, n_o: Real) -> Vec3:
    r"""The micronormal that refracts `wi` to `wo`, on the upper side:
    $\omega_h = \pm (n_i \omega_i + n_o \omega_o)/\|n_i \omega_i + n_o \omega_o\|$ with $\omega_h \cdot n \ge 0$.

    - `wi`, `wo`: unit, (3,), on opposite sides; `n_i`, `n_o > 0`: indices of refraction on their sides.
    - The zero vector where the sum vanishes (`n_i = n_o` and `wo = -wi`: any microfacet transmits straight on).

    Walter et al. 2007 (16), used by heitz2014 §2.1.
    """
    return _between(wi, wo, jnp.asarray(n_i, wi.dtype), jnp.asarray(n_o, wi.dtype))


def _weighted(wi, wo, n_i, n_o):
    x, y, z = stable.weighted_sum(wi, wo, n_i, n_o)
    side = jnp.where(z < 0, -1, 1).astype(z.dtype)
    return stable.direction(side * x, side * y, side * z)


_between = jax.custom_jvp(_weighted)


@_between.defjvp
def _between_jvp(primals, tangents):
    r"""By the indices $(n_i dn_o - n_o dn_i)\,\omega_h\times(\omega_o\times\omega_i)/\|n_i\omega_i + n_o\omega_o\|^2$: where all
    three are nearly parallel, nothing else is left of it.
    """
    (wi, wo, n_i, n_o), (di, do, dn_i, dn_o) = primals, tangents
    wm, turned = jax.jvp(lambda wi, wo: _weighted(wi, wo, n_i, n_o), (wi, wo), (di, do))
    x, y, z = stable.weighted_sum(wi, wo, n_i, n_o)
    square = x * x + y * y + z * z
    across = jnp.cross(wm, stable.cross(wo, wi)) / jnp.where(square > 0, square, 1)
    return wm, turned + across * (n_i * dn_o - n_o * dn_i)


@stable.widened
def basis(w: Vec3) -> Mat3:
    """Orthonormal frame about `w`: the rows (t, b, w), right-handed, so that `basis(w) @ v` are v's coordinates.

    - `w`: unit, (3,), anywhere on the sphere. The result is continuous but at the equator, z = 0.

    Duff et al. 2017, "Building an orthonormal basis, revisited" (Frisvad's, named by walter2014 §4.1, fails near −z).
    """
    x, y, z = w
    s = jnp.where(jnp.signbit(z), -1, 1).astype(w.dtype)
    a = -1 / (s + z)
    c = x * y * a
    return jnp.stack([jnp.stack([1 + s * x * x * a, s * c, -s * x]), jnp.stack([c, s + y * y * a, -y]), w])
