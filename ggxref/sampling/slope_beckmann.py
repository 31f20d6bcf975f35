"""Visible Beckmann normals through their slopes: heitz2014 algorithm 4, both distribution functions inverted to full precision."""

import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import erfc

from ggxref import _special, stable
from ggxref._matrix import reciprocal_scale
from ggxref._types import Scalar, Vec2, Vec3
from ggxref.sampling._sphere import unturned
from ggxref.sampling._visible import pdf_beckmann as pdf

__all__ = ["pdf", "sample"]

_DENSITY = 2 / math.sqrt(math.pi)


# Gauss–Legendre on [0, 1]: exact to the last bit for the smooth integrand below.
_NODES = {jnp.dtype(d): np.polynomial.legendre.leggauss(n) for d, n in (("float32", 6), ("float64", 10))}


def _near_edge(d, edge):
    r"""$\int_0^1 t\,e^{t d (2 e - t d)}\,dt$: d² times it, the density's integral from its edge, of which it is second order
    there and every difference of end values cancels."""
    nodes, weights = _NODES[d.dtype]
    t = (1 + nodes) / 2
    # As one sum over an array: ten terms are ten pieces to the compiler.
    x = jnp.asarray(t, d.dtype) * d[..., None]
    return jnp.sum(jnp.asarray(t * weights / 2, d.dtype) * jnp.exp(x * ((edge[..., None] - x) + edge[..., None])), -1)


def _root(residual: Callable, lower, upper, start):
    """Zero of an increasing function given with its slope: Newton's steps, halving the bracket where one leaves it."""

    def step(_, state):
        x, lower, upper = state
        value, slope = residual(x)
        lower, upper = jnp.where(value < 0, x, lower), jnp.where(value > 0, x, upper)
        new = x - value / jnp.where(slope > 0, slope, 1)
        inside = (slope > 0) & (new >= lower) & (new <= upper)
        return jnp.where(inside, new, (lower + upper) / 2), lower, upper

    # A loop, not unrolled: the steps of the two roots of two slopes would take the compiler half a minute.
    return jax.lax.fori_loop(0, 14 if start.dtype == jnp.float64 else 10, step, (start, lower, upper))[0]


@jax.custom_jvp
def _quantile(u: Scalar, s: Scalar, c: Scalar) -> Scalar:
    r"""The `a` above which lies the share `u` of the density $\propto \max(0, s a + c) e^{-a^2}$, for `u > 0`: (11) with $a = -\tilde x$.

    The integral is taken from the nearer end, and its logarithm matched: both ends are log-concave, where Newton's
    steps converge from afar. Integrals are of $\frac{2}{\sqrt\pi}(s a + c) e^{f^2-a^2}$ with `f` where the density starts,
    if it starts above 0: that far below the horizon the exponential itself underflows.
    """
    tiny = jnp.finfo(s.dtype).tiny
    s = jnp.maximum(s, tiny)
    edge = jnp.minimum(c / s, 1 / math.sqrt(tiny))  # the density starts at -edge
    floor, gauss_edge = jnp.maximum(-edge, 0), jnp.exp(-jnp.square(jnp.maximum(edge, 0)))
    edge_area = s * _special.gaussian_tails(jnp.abs(edge))[1] * gauss_edge
    total = 2 * jnp.maximum(c, 0) + edge_area

    u = jnp.maximum(u, tiny)
    w, top = jnp.minimum(u, 1 - u), u <= 0.5  # the nearer share
    log_w = jnp.log(w)
    log_target, reach = log_w + jnp.log(total), jnp.sqrt(-log_w)

    def residual(a):
        tail, integral = _special.gaussian_tails(jnp.abs(a))
        height, d = s * a + c, a + edge
        exponent = (floor - a) * (floor + a)
        gauss = jnp.exp(exponent)
        above = s * integral + height * tail  # for a > 0, over gauss
        # From below: for a > 0 it is the rest of the total, of which it is then at least a tenth.
        below = jnp.where(a > 0, total - above * gauss, (height * tail - s * integral) * gauss + edge_area)
        close = jnp.where(top, False, d + jnp.abs(d * edge) < 1)
        d = jnp.where(close, d, 0)
        part = jnp.where(close, _DENSITY * (d * (d * (s * (_near_edge(d, edge) * gauss_edge)))), below)
        part = jnp.maximum(jnp.where(top, above, part), tiny)
        density = _DENSITY * (jnp.where(close, s * d, height) * jnp.where(top, 1, gauss))
        value = jnp.log(part) - log_target
        return jnp.where(top, -exponent - value, value), density / part

    bottom = jnp.maximum(-edge, -reach)
    spread = 1 / (1 + floor)  # the median lies within twice this of the floor
    # The integral starts as gauss_edge s (a + edge)²/√π: from its root on, the steps do not leave the bracket.
    rise = jnp.exp(jnp.minimum((log_target - jnp.log(s * gauss_edge / math.sqrt(math.pi))) / 2, 0.0))
    start = jnp.minimum(jnp.maximum(rise - edge, bottom), (bottom + floor) / 2 + spread / 2)
    furthest = floor + reach
    lower, upper = jnp.where(top, floor, bottom), jnp.where(top, furthest, floor + 2 * spread)
    return _root(residual, lower, upper, jnp.where(top, furthest, start))


@_quantile.defjvp
def _quantile_jvp(primals, tangents):
    """By the implicit function theorem on survival(a; s, c) = u · total(s, c), all times exp(floor²) as in the value."""
    (u, s, c), (du, ds, dc) = primals, tangents
    a = _quantile(u, s, c)
    edge = c / jnp.where(s > 0, s, 1)
    below, floor = edge < 0, jnp.maximum(-edge, 0)
    tail_edge, area_edge = _special.gaussian_tails(jnp.abs(edge))
    gauss_edge = jnp.where(below, 1, jnp.exp(-edge * edge))
    at_edge_s = jnp.where(s > 0, gauss_edge / math.sqrt(math.pi), 0)
    at_edge_c = jnp.where(s > 0, jnp.where(below, tail_edge, erfc(-edge)), 2)
    total = 2 * jnp.maximum(c, 0) + s * area_edge * gauss_edge
    gauss = jnp.exp((floor - a) * (floor + a))
    survival = jnp.where(a > 0, _special.gaussian_tails(jnp.abs(a))[0] * gauss, erfc(a))
    density = _DENSITY * (s * a + c) * gauss
    change = (gauss / math.sqrt(math.pi) - u * at_edge_s) * ds + (survival - u * at_edge_c) * dc - total * du
    return a, jnp.where(density > 0, change / jnp.where(density > 0, density, 1), 0)


@stable.widened
def sample(u: Vec2, wi: Vec3, alpha: Vec2) -> Vec3:
    r"""Draw the slope along `wi` from its marginal, the slope across from its conditional; rotate and unstretch.

    In the stretched frame with $\omega_i = (\sin\theta, 0, \cos\theta)$ the slope along has the density
    $\propto \max(0, \cos\theta - \tilde x\sin\theta)\,e^{-\tilde x^2}$, increasing from $-\infty$ with `u[0]`; the slope across is
    $\mathrm{erf}^{-1}(2u_1 - 1)$, the same law at θ = 0.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), anywhere but straight below. `alpha`: positive, (2,).
    - Returns a micronormal with density `pdf`: unit, (3,), above the horizon; in the horizon where a number is 0, whose
      slope is infinite (both 0: midway between the two).

    heitz2014 (10)–(13), algorithm 4.
    """
    x, y, z = stable.turning(alpha[0] * wi[0], alpha[1] * wi[1], wi[2])
    # The law does not depend on their scale.
    s = stable.sqrt(x * x + y * y)
    scale = reciprocal_scale(jnp.maximum(s, jnp.abs(z)))
    # Both slopes by one call: the second is the same law at θ = 0.
    first = jnp.asarray([1.0, 0.0], s.dtype)
    sin, cos = first * (s * scale), jnp.where(first > 0, z * scale, 1)
    along, across = jax.vmap(_quantile)(u, sin, cos)
    horizontal = (u[0] == 0) | (u[1] == 0)
    along = jnp.where(horizontal, (u[0] == 0).astype(s.dtype), along)
    across = jnp.where(horizontal, (u[1] == 0).astype(s.dtype), across)
    # `along` and `across` are the negated slopes, which are the normal's own components.
    return stable.direction(*unturned(along, across, jnp.where(horizontal, 0, 1).astype(s.dtype), wi, alpha))
