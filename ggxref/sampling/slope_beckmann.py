"""Visible Beckmann normals through their slopes: heitz2014 algorithm 4, both distribution functions inverted to full precision."""

import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import erfc

from ggxref import _special, stable
from ggxref._types import Scalar, Vec2, Vec3
from ggxref.sampling._sphere import incident, unstretch
from ggxref.sampling._visible import pdf_beckmann as pdf

__all__ = ["pdf", "sample"]

_DENSITY = 2 / math.sqrt(math.pi)


def _shares(a, s, c, edge_area):
    r"""The logarithms of $\frac{2}{\sqrt\pi}\int (s a' + c) e^{-a'^2} da'$ over (a, ∞[, for a >= 0, and from the edge −c/s
    to a, for a <= 0; each with the density at a over the integral."""
    tail, tail_integral = _special.gaussian_tails(jnp.abs(a))
    height, tiny = s * a + c, jnp.finfo(a.dtype).tiny
    above = jnp.maximum(s * tail_integral + height * tail, tiny)
    gauss = jnp.exp(-a * a)
    below = jnp.maximum((height * tail - s * tail_integral) * gauss + edge_area, tiny)
    return (jnp.log(above) - a * a, _DENSITY * height / above), (jnp.log(below), _DENSITY * height * gauss / below)


# Gauss–Legendre on [0, 1]: exact to the last bit for the smooth integrand below.
_X, _W = np.polynomial.legendre.leggauss(10)
_NODES, _WEIGHTS = 0.5 + 0.5 * _X, 0.5 * _W


def _near_edge(a, s, edge):
    """The same integral close to the edge, where it is second order and every difference of its end values cancels."""
    d = a + edge
    # As one sum over an array: ten terms are ten pieces to the compiler.
    x = jnp.asarray(_NODES, d.dtype) * d[..., None]
    total = jnp.sum(jnp.asarray(_NODES * _WEIGHTS, d.dtype) * jnp.exp(x * (2 * edge[..., None] - x)), -1)
    logarithm = jnp.log(jnp.maximum(d, jnp.finfo(d.dtype).tiny))
    ratio = jnp.exp(d * (2 * edge - d)) / (total * jnp.where(d > 0, d, 1))
    return 2 * logarithm + jnp.log(_DENSITY * s * total) - edge * edge, ratio


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
    steps converge from afar.
    """
    tiny = jnp.finfo(s.dtype).tiny
    s = jnp.maximum(s, tiny)
    edge = jnp.minimum(c / s, 1 / math.sqrt(tiny))
    floor = jnp.maximum(-edge, 0)  # where the density starts, if it starts above 0
    _, edge_integral = _special.gaussian_tails(jnp.abs(edge))
    edge_area = s * edge_integral * jnp.exp(-edge * edge)
    # Below the horizon the whole density is this one tail; the logarithm outlives its underflow.
    log_total = jnp.where(
        c > 0,
        jnp.log(2 * jnp.maximum(c, 0) + edge_area),
        jnp.log(s * edge_integral) - edge * edge,
    )

    u = jnp.maximum(u, tiny)
    w = jnp.minimum(u, 1 - u)  # the nearer share
    log_target = jnp.log(w) + log_total
    reach = jnp.sqrt(-jnp.log(w))

    top = u <= 0.5

    def residual(a):
        (survival, ratio), (lower, lower_ratio) = _shares(a, s, c, edge_area)
        # From below: for a > 0 it is the rest of the survival, of which it is then at least a tenth.
        part = -jnp.expm1(jnp.minimum(survival - log_total, -tiny))
        part = jnp.maximum(part, tiny)
        upper, upper_ratio = log_total + jnp.log(part), ratio * jnp.exp(survival - log_total) / part
        value, slope = jnp.where(a > 0, upper, lower), jnp.where(a > 0, upper_ratio, lower_ratio)
        close = (a + edge) * (1 + jnp.abs(edge)) < 1
        first, first_ratio = _near_edge(jnp.where(close, a, -edge), s, edge)
        value, slope = jnp.where(close, first, value), jnp.where(close, first_ratio, slope)
        return jnp.where(top, log_target - survival, value - log_target), jnp.where(top, ratio, slope)

    bottom = jnp.maximum(-edge, -reach)
    spread = 1 / (1 + floor)  # the median lies within twice this of the floor
    # The integral starts as s (a + edge)² exp(−edge²)/√π: from its root on, the steps do not leave the bracket.
    rise = jnp.exp(jnp.minimum((log_target + edge * edge - jnp.log(s / math.sqrt(math.pi))) / 2, 0.0))
    start = jnp.minimum(jnp.maximum(rise - edge, bottom), (bottom + floor) / 2 + spread / 2)
    furthest = floor + reach
    lower, upper = jnp.where(top, floor, bottom), jnp.where(top, furthest, floor + 2 * spread)
    return _root(residual, lower, upper, jnp.where(top, furthest, start))


@_quantile.defjvp
def _quantile_jvp(primals, tangents):
    """By the implicit function theorem on survival(a; s, c) = u · total(s, c)."""
    (u, s, c), (du, ds, dc) = primals, tangents
    a = _quantile(u, s, c)
    edge = c / jnp.where(s > 0, s, 1)
    root_pi = math.sqrt(math.pi)
    at_edge_s = jnp.where(s > 0, jnp.exp(-edge * edge) / root_pi, 0)
    at_edge_c = jnp.where(s > 0, erfc(-edge), 2)
    total = s * at_edge_s + c * at_edge_c
    density = _DENSITY * (s * a + c) * jnp.exp(-a * a)
    change = (jnp.exp(-a * a) / root_pi - u * at_edge_s) * ds + (erfc(a) - u * at_edge_c) * dc - total * du
    return a, jnp.where(density > 0, change / jnp.where(density > 0, density, 1), 0)


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
    i = incident(alpha[0] * wi[0], alpha[1] * wi[1], wi[2])
    # Both slopes by one call: the second is the same law at θ = 0.
    sin = jnp.stack([stable.sqrt(i.x * i.x + i.y * i.y), jnp.zeros_like(i.z)])
    cos = jnp.stack([i.z, jnp.ones_like(i.z)])
    along, across = jax.vmap(_quantile)(u, sin, cos)
    horizontal = (u[0] == 0) | (u[1] == 0)
    x = jnp.where(horizontal, (u[0] == 0).astype(along.dtype), along)
    y = jnp.where(horizontal, (u[1] == 0).astype(along.dtype), across)
    cos_i, sin_i = stable.azimuth(i.x, i.y)
    # `along` and `across` are the negated slopes, which are the normal's own components.
    return unstretch(cos_i * x - sin_i * y, sin_i * x + cos_i * y, jnp.where(horizontal, 0, 1).astype(x.dtype), alpha)
