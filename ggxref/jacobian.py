"""Changes of variable: the solid angle that a map makes of a unit of solid angle, or of slope area."""

import jax.numpy as jnp

from ggxref import stable
from ggxref._types import Mat3, Real, Scalar, Vec3
from ggxref.ellipsoid import determinant, length, times_exactly


def reflection(wo: Vec3, wm: Vec3) -> Scalar:
    r"""$\|\partial\omega_h/\partial\omega_o\| = 1/(4|\omega_o \cdot \omega_m|)$: density of `wo` over density of `wm`.

    - `wo`, `wm`: unit, (3,). Infinite where they are perpendicular.

    heitz2014 §2.2, dupuy2023 (8), tokuyoshi2024.
    """
    return 1 / (4 * jnp.abs(stable.cosine(wo, wm)))


def refraction(wi: Vec3, wo: Vec3, wm: Vec3, n_i: Real, n_o: Real) -> Scalar:
    r"""$\|\partial\omega_h/\partial\omega_o\| = n_o^2|\omega_o\cdot\omega_m| / (n_i\,\omega_i\cdot\omega_m + n_o\,\omega_o\cdot\omega_m)^2$.

    - `wi`, `wo`, `wm`: unit, (3,); `n_i`, `n_o > 0`. Infinite where `wo = -wi` and `n_i = n_o`.

    heitz2014 §2.2 (printed as ∂ω_ht/∂ω_i; the variable is the generated direction ω_o).
    """
    i, o = stable.cosine(wi, wm), stable.cosine(wo, wm)
    # A plain sum may be contracted to an FMA, which is not 0 where the two terms are opposite.
    n = jnp.asarray(n_i, wi.dtype), jnp.asarray(n_o, wi.dtype)
    path = stable.dot(n, (i, o))
    straight = path == 0
    return jnp.where(straight, jnp.inf, n_o**2 * jnp.abs(o) / jnp.where(straight, 1, path) ** 2)


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
    image = length(*times_exactly(M, wm))
    return jnp.abs(determinant(M)) / (image * image * image)
