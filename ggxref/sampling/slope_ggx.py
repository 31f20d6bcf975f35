"""Visible GGX normals through their slopes: heitz2014 algorithm 4, both distribution functions inverted to full precision."""

import jax
import jax.numpy as jnp
from jax import lax

from ggxref import _kepler, stable
from ggxref._errorfree import two_product, two_sum
from ggxref._matrix import length, reciprocal_scale
from ggxref._pairs import choice, less, minus, one_pass, product, rounded, scaled, square_root, sum_by_squares, total
from ggxref._types import Vec2, Vec3
from ggxref.sampling._ellipsoid import ray, shortened
from ggxref.sampling._sphere import unturned
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
    return stable.direction(*_normal(u, wi, alpha))


@jax.custom_jvp
def _normal(u, wi, alpha):
    """The micronormal, of any length, from two words: for an anisotropic surface the turn to the azimuth of ω_i cancels."""
    i = two_product(alpha[0], wi[0]), two_product(alpha[1], wi[1]), (wi[2], jnp.zeros_like(wi[2]))
    x, y, z = map(rounded, _point(u, shortened(i)[0]))
    return alpha[0] * x, alpha[1] * y, z


@_normal.defjvp
def _normal_jvp(primals, tangents):
    """A direction does not depend on the length of what it is made of, which is taken as constant."""
    values = _normal(*primals)
    plain, change = jax.jvp(_plain_normal, primals, tangents)
    share = lax.stop_gradient(length(*values) / length(*plain))
    return values, tuple(share * d for d in change)


def _plain_normal(u, wi, alpha):
    """`_normal` in one word."""
    x, y, z = alpha[0] * wi[0], alpha[1] * wi[1], wi[2]
    scale = reciprocal_scale(jnp.maximum(jnp.maximum(jnp.abs(x), jnp.abs(y)), jnp.abs(z)))
    x, y, z = stable.turning(x * scale, y * scale, z * scale)
    square = x * x + y * y
    sin_psi, cos_psi, norm_square = _along(u[0], stable.sqrt(square), z, square)
    upper = u[1] > 0.5
    # In a loop of their own: each component that takes them would compute them again.
    c, s = stable.one_loop(*_kepler.kepler(jnp.where(upper, 1 - u[1], u[1])))
    return unturned(-sin_psi * s, norm_square * jnp.where(upper, -c, c), cos_psi * s, wi, alpha)


def _point(u, i):
    """The sphere-space normal, of any length. `i`: along the stretched ω_i, near 1."""
    one, zero = jnp.ones_like(u[0]), jnp.zeros_like(u[0])
    X, Y, S, flat, norm_square, rise, fall = one_pass(*ray(i, (one, zero)))
    sin_psi, cos_psi = one_pass(*_along_in_two_words(u[0], flat, i[2], norm_square, rise, fall))
    upper = u[1] > 0.5
    c, s = one_pass(*_kepler.kepler_pairs(jnp.where(upper, 1 - u[1], u[1])))
    along, across = product(sin_psi, s), product(norm_square, choice(upper, minus(c), c))
    x, y = total(product(X, along), product(Y, across)), less(product(X, across), product(Y, along))
    return minus(x), y, product(S, product(cos_psi, s))


def _along_in_two_words(u, flat, z, norm_square, rise, fall):
    """The first two of `_along`."""
    lower = product((u, jnp.zeros_like(u)), rise)
    cosine = square_root(product(product(two_sum(jnp.ones_like(u), -u), rise), total(fall, lower)))
    cosine, sine, lower = one_pass(cosine, less(lower, z), lower)
    squares = product(norm_square, product(lower, less(scaled(z, 2), lower)))
    cos_psi = sum_by_squares(product(cosine, z), product(sine, flat), squares)
    return less(product(sine, z), product(cosine, flat)), cos_psi


def _parts(u, flat, z, square):
    """‖v‖, ‖v‖ + z, cos(ψ + θ) ‖v‖ and (sin(ψ + θ) + cos θ) ‖v‖."""
    norm = stable.sqrt(square + z * z)
    large, below = norm + jnp.abs(z), z < 0
    small = square / jnp.where(large > 0, large, 1)  # one of norm + z, norm - z cancels
    rise, fall = jnp.where(below, small, large), jnp.where(below, large, small)
    lower = u * rise
    return norm, rise, stable.sqrt((1 - u) * rise * (fall + lower)), lower


@jax.custom_jvp
def _along(u, flat, z, square):
    r"""$(\sin\psi, \cos\psi, 1)$ times $\|v\|^2$ of $v = \|v\|(\sin\theta, 0, \cos\theta)$, of which are given ‖v‖ sin θ, ‖v‖ cos θ
    and the square of the former: each division would round once more."""
    _, _, cosine, lower = _parts(u, flat, z, square)
    sine, length = lower - z, square + z * z
    # cos ψ = cosine cos θ + sine sin θ; where the terms differ in sign, times its conjugate.
    plus, minus = cosine * z, sine * flat
    differ = ((plus > 0) & (minus < 0)) | ((plus < 0) & (minus > 0))
    conjugate = jnp.where(differ, plus - minus, 1)
    cos_psi = jnp.where(differ, length * (lower * (2 * z - lower)) / conjugate, plus + minus)
    return sine * z - cosine * flat, cos_psi, length


@_along.defjvp
def _along_jvp(primals, tangents):
    """At fixed u, ψ turns back as θ turns, but for a share of the order of u: the two cancel. The length is left as it is."""
    (u, flat, z, _), (du, dflat, dz, _) = primals, tangents
    sin_psi, cos_psi, length = _along(*primals)
    norm, rise, cosine, _ = _parts(*primals)
    cosine = jnp.where(cosine > 0, cosine, jnp.inf)
    share = 2 * u * (1 - u) * (rise / cosine) / ((1 - u) * flat + cosine)
    turn = (rise / cosine) * du - share * norm * ((z * dflat - flat * dz) / length)
    return (sin_psi, cos_psi, length), (cos_psi * turn, -sin_psi * turn, jnp.zeros_like(length))
