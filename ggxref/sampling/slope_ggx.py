"""Visible GGX normals through their slopes: heitz2014 algorithm 4, both distribution functions inverted to full precision."""

import jax.numpy as jnp

from ggxref import stable
from ggxref._types import Vec2, Vec3
from ggxref.sampling._sphere import incident, unstretch
from ggxref.sampling._visible import pdf_ggx as pdf

__all__ = ["pdf", "sample"]


def sample(u: Vec2, wi: Vec3, alpha: Vec2) -> Vec3:
    r"""Draw the slope along `wi` from its marginal, the slope across from its conditional; rotate and unstretch.

    In the stretched frame with $\omega_i = (\sin\theta, 0, \cos\theta)$ and the slope along written $\tilde x = \tan\psi$, (11) is
    $u_0 = (\sin(\psi+\theta) + \cos\theta)/(1+\cos\theta)$. With $\tilde y = -\sqrt{1+\tilde x^2}\cot(E/2)$, (13) is Kepler's
    equation $E - \sin E = 2\pi u_1$. The slopes themselves, infinite at u = 0, are never formed: the normal is
    $(-\sin\psi\sin\frac E2, \cos\frac E2, \cos\psi\sin\frac E2)$.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), anywhere but straight below. `alpha`: positive, (2,).
    - Returns a micronormal with density `pdf`: unit, (3,), above the horizon for `u[0] > 0` and `u[1] > 0`.

    heitz2014 (10)–(13), algorithm 4 (whose authors' code fitted the second inverse, walter2014 §4.2).
    """
    i = incident(alpha[0] * wi[0], alpha[1] * wi[1], wi[2])
    sin_theta = stable.sqrt(i.x * i.x + i.y * i.y)
    lower = u[0] * i.rise  # sin(ψ + θ) + cos θ
    sine = lower - i.z
    cosine = stable.sqrt((1 - u[0]) * i.rise * (i.fall + lower))
    sin_psi = sine * i.z - cosine * sin_theta
    # cos ψ = cosine cos θ + sine sin θ; where the terms differ in sign, times its conjugate.
    plus, minus = cosine * i.z, sine * sin_theta
    differ = ((plus > 0) & (minus < 0)) | ((plus < 0) & (minus > 0))
    conjugate = jnp.where(differ, plus - minus, 1)
    cos_psi = jnp.where(differ, lower * (2 * i.z - lower) / conjugate, plus + minus)

    upper = u[1] > 0.5
    E = stable.kepler(jnp.where(upper, 1 - u[1], u[1]))
    s, c = jnp.sin(E / 2), jnp.cos(E / 2)
    along, across = -sin_psi * s, jnp.where(upper, -c, c)
    cos_i, sin_i = stable.azimuth(i.x, i.y)
    return unstretch(cos_i * along - sin_i * across, sin_i * along + cos_i * across, cos_psi * s, alpha)
