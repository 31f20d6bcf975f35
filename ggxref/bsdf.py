"""D, G and F put together: BRDF, BTDF [1/sr] and the weights of the samplers, from their values."""

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Bool

from ggxref import geometry, jacobian, stable
from ggxref._types import Real, Scalar, Vec2, Vec3


def _over(numerator, denominator):
    """The quotient, and 0 where the denominator is 0: a direction in the surface, or one that is wholly masked."""
    safe = jnp.where(denominator == 0, 1, denominator)
    return jnp.where(denominator == 0, 0, numerator / safe)


@stable.widened
def brdf(wi: Vec3, wo: Vec3, D: Real, G2: Real, F: Real) -> Scalar:
    r"""$f_r = D\,G_2\,F / (4\,|\omega_i\cdot n||\omega_o\cdot n|)$ [1/sr]; 0 where either lies in the horizon.

    - `wi`, `wo`: unit, (3,), on the same side. `D`, `G2`, `F`: values at their half vector (`geometry.half_reflection`).

    heitz2014 §2.1 (which prints D(ω_ht)); walter2014 (4); dupuy2023 (11).
    """
    return _over(D * G2 * F, 4 * jnp.abs(wi[2]) * jnp.abs(wo[2]))


@stable.widened
def brdf_ggx(wi: Vec3, wo: Vec3, alpha: Vec2, *, add: Callable = stable.evened_sum) -> Scalar:
    r"""$f_r$ of GGX with height-correlated masking, but for F [1/sr]: `brdf` of its D and G2, in one expression of
    $h = \omega_i + \omega_o$, $\frac{1}{2\pi\alpha_x\alpha_y q^2 (z_o\|A\omega_i\| + z_i\|A\omega_o\|)}$ with
    $q = (h_x^2/\alpha_x^2 + h_y^2/\alpha_y^2 + h_z^2)/\|h\|^2$, $A = \mathrm{diag}(\alpha_x, \alpha_y, 1)$.

    - `wi`, `wo`: unit, (3,); 0 unless both are above the horizon. `alpha`: positive, (2,).
    - In float32, $\omega_i + \omega_o$ from 1e-18 max(1, α) (0 where its square is below the range), α from 1e-8.
    - `add`: the form of $\omega_i + \omega_o$. `stable.unit_sum` errs by no more than 16 ulp in all, for half as much time again.
    - F's cosine, $\omega_i\cdot\omega_h$, is $\|h\|/2$.
    - Its gradient is cut to the end of the dtype's range, which it leaves towards the horizon.

    tokuyoshi2024's D and dupuy2023 (13) in walter2014 (4): the heights of G2 and of the denominator cancel, and h is never
    normalised. It errs by no more than 10 ulp beyond what half an ulp of its inputs explains, also where $\omega_o$ is
    nearly $-\omega_i$.
    """
    return _brdf_ggx(add, wi, wo, alpha)


class _Mirrored(NamedTuple):
    h: tuple[Scalar, Scalar, Scalar]  # ωi + ωo
    square: Scalar  # ‖h‖²
    stretched: Scalar  # q times that
    length_i: Scalar
    length_o: Scalar
    between: Scalar
    unseen: Bool[Array, ""]


def _mirrored(add, wi, wo, alpha):
    x, y, z = add(wi, wo)
    square = x * x + y * y + z * z
    stretched = (x / alpha[0]) ** 2 + (y / alpha[1]) ** 2 + z * z
    unseen = (wi[2] <= 0) | (wo[2] <= 0) | (square <= 0) | (stretched <= 0)  # a NaN is not
    # The rule below knows their derivatives: no need of a root that guards its own.
    length_i, length_o = (jnp.sqrt(w[2] ** 2 + ((alpha[0] * w[0]) ** 2 + (alpha[1] * w[1]) ** 2)) for w in (wi, wo))
    between = wo[2] * length_i + wi[2] * length_o
    return _Mirrored((x, y, z), square, stretched, length_i, length_o, between, unseen)


@functools.partial(jax.custom_jvp, nondiff_argnums=(0,))
def _brdf_ggx(add, wi, wo, alpha):
    m = _mirrored(add, wi, wo, alpha)
    # Neither the two squares nor α² times the heights, which both may underflow. Used more than once, a quotient would cut the loop.
    over_q, over_area = m.square / m.stretched, 1 / (2 * math.pi * alpha[0] * alpha[1])
    return jnp.where(m.unseen, 0, over_q * over_q * over_area / m.between)


@_brdf_ggx.defjvp
def _brdf_ggx_jvp(add, primals, tangents):
    """Each partial derivative as the value times a quotient: near the horizon the value's square is beyond the dtype's range.

    Where the derivative is, too, it is the end of the range, so that no sum of derivatives is inf − inf.
    """
    (wi, wo, alpha), (di, do, dalpha) = primals, tangents
    m = _mirrored(add, wi, wo, alpha)
    value = _brdf_ggx(add, *primals)
    square, stretched, between = (jnp.where(m.unseen, 1, x) for x in (m.square, m.stretched, m.between))
    q, end = stretched / square, float(jnp.finfo(value.dtype).max) / 64
    _, dh = jax.jvp(add, (wi, wo), (di, do))
    factors, none = (alpha[0], alpha[1], jnp.ones_like(value)), jnp.zeros_like(value)
    terms = []
    for c, dc, a, da in zip(m.h, dh, factors, (*dalpha, none), strict=True):
        p = c / a
        terms.append((-4 * (value / q) * ((p / a - q * c) / square), dc))
        terms.append((value / a * (4 * (p * p / stretched) - 1), da))
    for w, dw, z, own, other in ((wi, di, wo[2], m.length_i, m.length_o), (wo, do, wi[2], m.length_o, m.length_i)):
        part = -value * (z / between) / jnp.where(own > 0, own, 1)
        for c, dc, a, da in zip(w, dw, factors, (*dalpha, none), strict=True):
            terms += [(part * (a * a * c), dc), (part * (a * c * c), da)]
        terms.append((-value * (other / between), dw[2]))
    change = sum((jnp.clip(by, -end, end) * d for by, d in terms), jnp.zeros_like(value))
    return value, jnp.where(m.unseen, 0, change)


@stable.widened
def btdf(wi: Vec3, wo: Vec3, n_i: Real, n_o: Real, D: Real, G2: Real, F: Real) -> Scalar:
    r"""$f_t = \frac{|\omega_i\cdot\omega_h||\omega_o\cdot\omega_h|}{|\omega_i\cdot n||\omega_o\cdot n|}
    \frac{n_o^2 (1-F) G_2 D}{(n_i\,\omega_i\cdot\omega_h + n_o\,\omega_o\cdot\omega_h)^2}$ [1/sr].

    - `wi`, `wo`: unit, (3,), on opposite sides; `n_i`, `n_o > 0`: indices of refraction on their sides.
    - `D`, `G2`, `F`: values at their half vector (`geometry.half_refraction`); F is the reflectance.
    - Infinite where `n_i = n_o` and `wo = -wi`; 0 where either direction lies in the horizon.

    heitz2014 §2.1.
    """
    wm = geometry.half_refraction(wi, wo, n_i, n_o)
    spread = jacobian.refraction(wi, wo, wm, n_i, n_o)
    straight = jnp.isinf(spread)  # no half vector: 0 times infinity
    transmitted = jnp.abs(stable.cosine(wi, wm)) * jnp.where(straight, 1, spread) * (1 - F) * G2 * D
    transmitted = jnp.where(straight, jnp.inf, transmitted)
    return _over(transmitted, jnp.abs(wi[2]) * jnp.abs(wo[2]))


@stable.widened
def weight_normals(wi: Vec3, wm: Vec3, G2: Real) -> Scalar:
    r"""Weight of a sample from $D(\omega_m\cdot n)$: $|\omega_i\cdot\omega_m| G_2 / (|\omega_i\cdot n||\omega_m\cdot n|)$; F is in the choice.

    - `wi`, `wm`: unit, (3,). In [0, 2] for V-cavities, in [0, ∞[ for Smith's G2.

    heitz2014 §2.2, algorithm 1 (table 2 leaves out |ω_i·n|).
    """
    z = jnp.abs(wi[2]) * jnp.abs(wm[2])
    share = stable.over_heights(tuple(wi), tuple(wm), stable.cosine(wi, wm))
    return jnp.where(z == 0, 0, jnp.abs(share) * G2)


@stable.widened
def weight_visible(g1_i: Real, g2: Real, F: Real) -> Scalar:
    r"""Weight of a sample from the visible normals: $F\,G_2/G_1(\omega_i)$ in [0, 1]; 0 where $G_1 = 0$.

    - `F`: 1 where reflection and transmission are chosen by Fresnel's term, F where only reflection is followed.

    heitz2014 algorithm 2 (F = 1); walter2014 (50)–(52); dupuy2023 (19), (20).
    """
    return _over(F * g2, g1_i)
