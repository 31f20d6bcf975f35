"""Changes of variable: the solid angle that a map makes of a unit of solid angle, or of slope area."""

import jax
import jax.numpy as jnp

from ggxref import _pairs, stable
from ggxref._matrix import near_one
from ggxref._types import Mat3, Real, Scalar, Vec3
from ggxref.ellipsoid import determinant


@stable.widened
def reflection(wo: Vec3, wm: Vec3) -> Scalar:
    r"""$\|\partial\omega_h/\partial\omega_o\| = 1/(4|\omega_o \cdot \omega_m|)$: density of `wo` over density of `wm`.

    - `wo`, `wm`: unit, (3,). Infinite where they are perpendicular.

    heitz2014 §2.2, dupuy2023 (8), tokuyoshi2024.
    """
    return 1 / (4 * jnp.abs(stable.cosine(wo, wm)))


@stable.widened
def refraction(wi: Vec3, wo: Vec3, wm: Vec3, n_i: Real, n_o: Real) -> Scalar:
    r"""$\|\partial\omega_h/\partial\omega_o\| = n_o^2|\omega_o\cdot\omega_m| / (n_i\,\omega_i\cdot\omega_m + n_o\,\omega_o\cdot\omega_m)^2$.

    - `wi`, `wo`, `wm`: unit, (3,); `n_i`, `n_o > 0`. Infinite where `wo = -wi` and `n_i = n_o`.

    heitz2014 §2.2 (printed as ∂ω_ht/∂ω_i; the variable is the generated direction ω_o).
    """
    n_i, n_o = jnp.asarray(n_i, wi.dtype), jnp.asarray(n_o, wi.dtype)
    return _spread(stable.cosine(wi, wm), stable.cosine(wo, wm), n_i, n_o, _path(wi, wo, wm, n_i, n_o))


@jax.custom_jvp
def _path(wi, wo, wm, n_i, n_o):
    """The sum that is squared, for exactly unit `wi` and `wo`, in two words: it cancels, for indices nearly equal all the more."""
    i, o = (_pairs.product((n, jnp.zeros_like(n)), _cosine(w, wm)) for n, w in ((n_i, wi), (n_o, wo)))
    return _pairs.rounded(_pairs.total(i, o))


def _cosine(w, wm):
    value, rest = _pairs.dot(tuple(w), tuple(wm))
    return value, rest - value * stable.excess(w)


@_path.defjvp
def _path_jvp(primals, tangents):
    (wi, wo, wm, n_i, n_o), (di, do, dm, dn_i, dn_o) = primals, tangents
    by_i, by_o = n_i * (di @ wm + wi @ dm) + dn_i * (wi @ wm), n_o * (do @ wm + wo @ dm) + dn_o * (wo @ wm)
    return _path(*primals), by_i + by_o


@jax.custom_jvp
def _spread(i, o, n_i, n_o, path):
    straight = path == 0
    return jnp.where(straight, jnp.inf, n_o**2 * jnp.abs(o) / jnp.where(straight, 1, path) ** 2)


@_spread.defjvp
def _spread_jvp(primals, tangents):
    """With the change of `path` in it: by n_o and o the terms of the quotient rule cancel, wherever n_i ω_i·ω_m is small beside n_o ω_o·ω_m."""
    (i, o, n_i, n_o, path), (di, do, dn_i, dn_o, _) = primals, tangents
    value = _spread(*primals)
    path = jnp.where(path == 0, 1, path)
    weight = n_o / path * (n_o / path)  # |o| in place of a division by o
    along = weight * jnp.sign(o) * ((n_i * i - n_o * o) / path)
    rest = 2 * weight * jnp.abs(o) * ((n_i * i / n_o * dn_o - i * dn_i - n_i * di) / path)
    return value, jnp.where(jnp.isinf(value), 0, along * do + rest)


@stable.widened
def slope(wm: Vec3) -> Scalar:
    r"""$\|\partial\tilde m/\partial\omega_m\| = 1/(\omega_m\cdot n)^3$: slope area over solid angle.

    - `wm`: unit, (3,), above the horizon.

    heitz2014 §5.1.
    """
    return 1 / wm[2] ** 3


@stable.widened
def linear(wm: Vec3, M: Mat3) -> Scalar:
    r"""$|\det M| / \|M\omega_m\|^3$: Jacobian of $\omega \mapsto M\omega/\|M\omega\|$, solid angle out over solid angle in.

    - `wm`: unit, (3,); `M`: (3, 3), non-singular.

    dupuy2023 (1), tokuyoshi2024 (18).
    """
    M, _ = near_one(M)
    square = _pairs.rounded(_pairs.square_of_pairs(*_pairs.times(M, tuple(wm))))
    return jnp.abs(determinant(M)) / (square * stable.sqrt(square))  # the root cubed would lose three times its error
