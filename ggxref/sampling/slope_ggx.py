"""Visible GGX normals through their slopes: heitz2014 algorithm 4, both distribution functions inverted to full precision."""

import jax
import jax.numpy as jnp

from ggxref import _special, stable
from ggxref._types import Vec2, Vec3
from ggxref.sampling._sphere import incident, unstretch
from ggxref.sampling._visible import pdf_ggx as pdf

__all__ = ["pdf", "sample"]


@stable.widened
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
    sin_psi, cos_psi = _along(u[0], i.z, stable.sqrt(i.x * i.x + i.y * i.y), i.rise, i.fall)
    upper = u[1] > 0.5
    c, s = _special.kepler(jnp.where(upper, 1 - u[1], u[1]))
    along, across = -sin_psi * s, jnp.where(upper, -c, c)
    cos_i, sin_i = stable.azimuth(i.x, i.y)
    return unstretch(cos_i * along - sin_i * across, sin_i * along + cos_i * across, cos_psi * s, alpha)


def _cosine(u, z, rise, fall):
    """cos(ψ + θ)."""
    return stable.sqrt((1 - u) * rise * (fall + u * rise))


@jax.custom_jvp
def _along(u, z, sin_theta, rise, fall):
    """(sin ψ, cos ψ) at θ, of which are given the cosine, the sine, 1 + cos θ and 1 − cos θ."""
    lower = u * rise  # sin(ψ + θ) + cos θ
    sine, cosine = lower - z, _cosine(u, z, rise, fall)
    # cos ψ = cosine cos θ + sine sin θ; where the terms differ in sign, times its conjugate.
    plus, minus = cosine * z, sine * sin_theta
    differ = ((plus > 0) & (minus < 0)) | ((plus < 0) & (minus > 0))
    conjugate = jnp.where(differ, plus - minus, 1)
    return sine * z - cosine * sin_theta, jnp.where(differ, lower * (2 * z - lower) / conjugate, plus + minus)


@_along.defjvp
def _along_jvp(primals, tangents):
    """At fixed u, ψ turns back as θ turns, but for a share of the order of u: the two cancel."""
    (u, z, sin_theta, rise, fall), (du, dz, dsin, _, _) = primals, tangents
    sin_psi, cos_psi = _along(*primals)
    cosine = _cosine(u, z, rise, fall)
    cosine = jnp.where(cosine > 0, cosine, jnp.inf)
    share = 2 * u * (1 - u) * (rise / cosine) / ((1 - u) * sin_theta + cosine)
    turn = (rise / cosine) * du - share * (z * dsin - sin_theta * dz)
    return (sin_psi, cos_psi), (cos_psi * turn, -sin_psi * turn)
