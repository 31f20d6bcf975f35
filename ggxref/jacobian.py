"""Changes of variable: the solid angle that a map makes of a unit of solid angle, or of slope area."""

import jax
import jax.numpy as jnp

from ggxref import _pairs, stable
from ggxref._types import Mat3, Real, Scalar, Vec3
from ggxref.ellipsoid import determinant, near_one


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
    return _spread(stable.cosine(wi, wm), stable.cosine(wo, wm), jnp.asarray(n_i, wi.dtype), jnp.asarray(n_o, wi.dtype))


@jax.custom_jvp
def _spread(i, o, n_i, n_o):
    # A plain sum may be contracted to an FMA, which is not 0 where the two terms are opposite.
    path = stable.dot((n_i, n_o), (i, o))
    straight = path == 0
    return jnp.where(straight, jnp.inf, n_o**2 * jnp.abs(o) / jnp.where(straight, 1, path) ** 2)


@_spread.defjvp
def _spread_jvp(primals, tangents):
    """By n_o and o the terms of the quotient rule cancel, wherever n_i ω_i·ω_m is small beside n_o ω_o·ω_m."""
    (i, o, n_i, n_o), (di, do, dn_i, dn_o) = primals, tangents
    path, value = stable.dot((n_i, n_o), (i, o)), _spread(*primals)
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
