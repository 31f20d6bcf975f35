"""The half vector of a direction and a point of its cap, with its digits also where the two nearly cancel."""

import jax.numpy as jnp
from jax import lax

from ggxref import _special, stable
from ggxref._types import Real, Scalar, Turn, Vec2


def rise_and_fall(x: Scalar, y: Scalar, z: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """‖(x, y, z)‖, and what it exceeds -z and z by, neither a difference of equals: their product is x² + y²."""
    flat = x * x + y * y
    norm = stable.sqrt(flat + z * z)
    large = norm + jnp.abs(z)
    small = flat / jnp.where(large > 0, large, 1)
    below = z < 0
    return norm, jnp.where(below, small, large), jnp.where(below, large, small)


def half_in_cap(
    u: Vec2, x: Scalar, y: Scalar, z: Scalar, cut: Real, turn: Turn = _special.cos_sin_turn
) -> tuple[Scalar, Scalar, Scalar]:
    r"""`i + c` (not normalised) with `i = (x, y, z)` of any length and `c`, as long, uniform on the cap `{c.z > cut - z}`.

    As `_sphere.half_in_cap`, which is faster. Where `c` is nearly $-i$, at the rim of the cap of a rough surface, that one
    subtracts what is almost equal. Here the components along and across the azimuth of `i` are, with r and ρ the horizontal
    lengths of `i` and `c` and Δ the angle between them, $(r - \rho) + \rho\,(1 + \cos\Delta)$ and $\rho\sin\Delta$, where
    $r^2 - \rho^2 = h_z (h_z - 2z)$ and $1 + \cos\Delta = \sin^2\Delta/(1 - \cos\Delta)$.
    """
    length = stable.sqrt(x * x + y * y + z * z)
    cut = cut * (
        lax.stop_gradient(length) / jnp.where(length > 0, length, 1)
    )  # in units of the length, as that is held
    x, y, z = stable.turning(x, y, z)
    flat = x * x + y * y
    r = stable.sqrt(flat)
    norm, rise, fall = rise_and_fall(x, y, z)
    height, rest = rise - cut, fall + cut
    half_z = (1 - u[1]) * height + cut
    rho = stable.sqrt(u[1] * height * (2 * (1 - u[1]) * norm + u[1] * rest))
    cos_phi, sin_phi = turn(u[0])
    half_x, half_y = rho * cos_phi + x, rho * sin_phi + y

    opposite = half_x * half_x + half_y * half_y < flat / 4
    # Every quotient once: what XLA would share between pieces, it stores.
    r, total = jnp.where(opposite, r, 1), r + rho
    low = opposite & (half_z < total)
    gap = jnp.where(low, half_z * (half_z - 2 * z) / jnp.where(low, total, 1), r - rho)
    sine, cosine = x * sin_phi - y * cos_phi, x * cos_phi + y * sin_phi  # r sin Δ, r cos Δ
    from_right = jnp.where(opposite, r - cosine, 1)
    along, across = gap + rho * (sine / r) * (sine / from_right), rho * (sine / r)
    turned_x, turned_y = (along * x - across * y) / r, (along * y + across * x) / r
    half = jnp.where(opposite, turned_x, half_x), jnp.where(opposite, turned_y, half_y), half_z
    return stable.one_loop(*half)
