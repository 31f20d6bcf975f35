r"""Normals from $D(\omega_m)(\omega_m\cdot n)$, independent of the view: heitz2014's "previous method" (algorithm 1)."""

import jax.numpy as jnp

from ggxref import _special, ndf, stable
from ggxref._types import Scalar, Turn, Vec2, Vec3
from ggxref.sampling._sphere import unstretch


@stable.widened
def sample_ggx(u: Vec2, alpha: Vec2, *, turn: Turn = _special.cos_sin_turn) -> Vec3:
    r"""$\omega_m \propto (\alpha_x\sqrt{u_1}\cos 2\pi u_0,\ \alpha_y\sqrt{u_1}\sin 2\pi u_0,\ \sqrt{1-u_1})$.

    - `u`: in [0, 1)², (2,). `alpha`: positive, (2,). The result is unit, (3,), above the horizon.
    - `turn`: the form of cos 2πu and sin 2πu.

    heitz2014 algorithm 1 (Walter et al. 2007 (35), without its arctangent, which overflows as u₁ → 1).
    """
    cos_phi, sin_phi = turn(u[0])
    r = stable.sqrt(u[1])
    return unstretch(r * cos_phi, r * sin_phi, stable.sqrt(1 - u[1]), alpha)


@stable.widened
def sample_beckmann(u: Vec2, alpha: Vec2, *, turn: Turn = _special.cos_sin_turn) -> Vec3:
    r"""$\omega_m \propto (\alpha_x r\cos 2\pi u_0,\ \alpha_y r\sin 2\pi u_0,\ 1)$, $r = \sqrt{-\ln(1-u_1)}$.

    - `u`: in [0, 1)², (2,). `alpha`: positive, (2,). The result is unit, (3,), above the horizon.
    - `turn`: the form of cos 2πu and sin 2πu.

    heitz2014 algorithm 1 (Walter et al. 2007 (28)).
    """
    cos_phi, sin_phi = turn(u[0])
    r = stable.sqrt(-_special.log1p(-u[1]))
    return unstretch(r * cos_phi, r * sin_phi, jnp.ones_like(r), alpha)


@stable.widened
def pdf_ggx(wm: Vec3, alpha: Vec2) -> Scalar:
    r"""$D(\omega_m)(\omega_m\cdot n)$ for GGX [1/sr]. `wm`: unit, (3,). heitz2014 §2.2."""
    return ndf.ggx(wm, alpha) * wm[2]


@stable.widened
def pdf_beckmann(wm: Vec3, alpha: Vec2) -> Scalar:
    r"""$D(\omega_m)(\omega_m\cdot n)$ for Beckmann [1/sr]. `wm`: unit, (3,). heitz2014 §2.2."""
    return ndf.beckmann(wm, alpha) * wm[2]
