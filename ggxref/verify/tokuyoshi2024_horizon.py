"""The article on Tokuyoshi & Eto 2024: heights of reflections by samples and derivatives, and the mass above the horizon."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from ggxref.verify import cases, engine
from ggxref.verify.batch import Batched
from ggxref.verify.charts import unit
from ggxref.verify.dupuy2023 import warp
from ggxref.verify.engine import relative, worst
from ggxref.verify.heitz2014_bsdf import hemispherical
from ggxref.verify.tokuyoshi2024 import ABOVE, PAPER, literal_k

check = partial(engine.check, PAPER)


def lengths(i, m, alpha):
    """‖(α_x x_i, α_y y_i, z_i)‖ and ‖(x_m/α_x, y_m/α_y, z_m)‖²"""
    one = np.ones(len(m))
    inner = np.linalg.norm(i * np.append(alpha, 1.0)) * one
    return inner, np.sum((m / np.append(alpha, 1.0)) ** 2, axis=-1)


def height_by_normal(i, m, o, alpha):
    """(29)"""
    n, q = lengths(i, m, alpha)
    return 2 * m[:, 2] * (m @ i) / (n * q) - i[2] / n


def height_by_directions(i, m, o, alpha):
    """(30)"""
    h = i + o
    n, q = lengths(i, h, alpha)
    return h[:, 2] * np.sum(h * h, axis=-1) / (n * q) - i[2] / n


@check(
    "(29)", "the formula in wi and wm gives the height that the sampler drew on the cap", "monte_carlo",
    [height_by_normal, "sampling.spherical_cap.sample", "geometry.reflect"], tolerance=1e-8,
    mutant=("‖…‖ for ‖…‖²", lambda f: lambda i, m, o, a: f(i, m, o, np.sqrt(a))),
)  # fmt: skip
@check(
    "(30)", "the formula in wi and wo gives the height that the sampler drew on the cap", "monte_carlo",
    [height_by_directions, "sampling.spherical_cap.sample", "geometry.reflect"], tolerance=1e-8,
    mutant=("‖wi + wo‖ for its square", lambda f: lambda i, m, o, a: f(i, m, unit(i + o) - i, a) / 2),
)  # fmt: skip
def heights_of_samples(formula, sample, reflect, stream):
    """Tolerance: wi + wo is small where the micronormal is nearly perpendicular to wi."""
    errors = []
    for i, alpha in ABOVE:
        u = stream.uniform(stream.samples // 16, 2)
        m = sample(u, i, alpha)
        low = warp(i, alpha)[2]
        drawn = (1 - u[:, 1]) * (1 + low) - low
        errors.append(worst(formula(i, m, reflect(i, m), alpha) - drawn))
    return max(errors)


def on_horizon(phi):
    return jnp.stack([jnp.cos(phi), jnp.sin(phi), 0 * phi])


def mirrored_height(phi, wi, alpha):
    """o'_z of the direction at azimuth phi on the horizon: stretch, half vector, mirror."""
    a = jnp.append(alpha, 1)
    inner, m = wi * a, (wi + on_horizon(phi)) / a
    inner, m = inner / jnp.linalg.norm(inner), m / jnp.linalg.norm(m)
    return 2 * (inner @ m) * m[2] - inner[2]


def squared_distance(phi, wi, alpha):
    """(34)"""
    return (wi[0] + jnp.cos(phi)) ** 2 + (wi[1] + jnp.sin(phi)) ** 2


def anisotropic_height(phi, wi, alpha):
    """(31)"""
    x, y, z = wi[0] + jnp.cos(phi), wi[1] + jnp.sin(phi), wi[2]
    ratio = (x**2 + y**2 + z**2) / ((x / alpha[0]) ** 2 + (y / alpha[1]) ** 2 + z**2)
    return (ratio - 1) * z / jnp.linalg.norm(wi * jnp.append(alpha, 1))


def isotropic_height(phi, wi, alpha, r=squared_distance):
    """(32)"""
    d, a, z = r(phi, wi, alpha), alpha[0], wi[2]
    return (a**2 * (d + z**2) / (d + a**2 * z**2) - 1) * z / jnp.linalg.norm(wi * jnp.append(alpha, 1))


RANKS = (0, 1, 1)
AZIMUTHS = np.linspace(-np.pi, np.pi, 40)
EVEN = np.repeat(np.array([[0.05], [0.5], [0.9]]), 2, axis=1)
TILTED = cases.UP[1:4]


def azimuths(alphas):
    return cases.triples(AZIMUTHS, TILTED, alphas)


def turned(f):
    """The function of wi turned by half a turn."""
    return Batched(lambda phi, wi, alpha: f.function(phi, wi * jnp.array([-1.0, -1.0, 1.0]), alpha), RANKS)


@check(
    "(31)", "along the horizon the formula and its derivative are those of the mirrored direction", "autodiff",
    Batched(anisotropic_height, RANKS), tolerance=1e-9, alphas=cases.ALPHAS[2:], mutant=("of -wi", turned),
)  # fmt: skip
@check(
    "(32)", "along the horizon the isotropic formula and its derivative are those of the mirrored direction", "autodiff",
    Batched(isotropic_height, RANKS), tolerance=1e-9, alphas=EVEN, mutant=("of -wi", turned), also=["(34)"],
)  # fmt: skip
def heights_on_horizon(formula, alphas):
    """Tolerance: at α = 0.05 both terms are a hundred times their difference."""
    mirrored, at = Batched(mirrored_height, RANKS), azimuths(alphas)
    return max(worst(formula(*at) - mirrored(*at)), worst(formula.derivative(0)(*at) - mirrored.derivative(0)(*at)))


@check(
    "(33)", "o'_z falls where r rises along the horizon, for α < 1: their derivatives have opposite signs", "autodiff",
    Batched(squared_distance, RANKS), tolerance=1e-12, mutant=("distance from wi, not -wi", turned),
)  # fmt: skip
def distance_lowers_height(r):
    at = azimuths(EVEN)
    return worst(np.maximum(0, r.derivative(0)(*at) * Batched(mirrored_height, RANKS).derivative(0)(*at)))


def furthest(i, alpha):
    """(35): s"""
    return 1 + np.hypot(i[:, 0], i[:, 1])


def least_height(i, alpha):
    """(37)"""
    s, a, z = furthest(i, alpha), alpha[:, 0], i[:, 2]
    return (a**2 - 1) * s**2 / (s**2 + a**2 * z**2) * warp(i, alpha)[:, 2]


def own(i, alpha):
    return np.arctan2(i[:, 1], i[:, 0]), i, alpha


def extremum(f, sign):
    """How far f is from an extremum at wi's own azimuth: its derivative there, and a second one of the wrong sign."""
    at = own(*cases.pairs(TILTED, EVEN))
    second = Batched(jax.grad(jax.grad(f)), RANKS)(*at)
    return max(worst(Batched(jax.grad(f), RANKS)(*at)), worst(np.maximum(0, sign * second)))


@check(
    "(35)", "s² is r where its derivative is 0 and its second derivative negative", "autodiff", furthest, tolerance=1e-12,
    mutant=("1 + z_i", lambda f: lambda i, a: 1 + i[:, 2]), also=["(36)"],
)  # fmt: skip
def largest_distance(s):
    at = own(*cases.pairs(TILTED, EVEN))
    return max(extremum(squared_distance, 1), worst(s(*at[1:]) ** 2 - Batched(squared_distance, RANKS)(*at)))


@check(
    "(37)", "the formula is o'_z where its derivative is 0 and its second derivative positive", "autodiff", least_height,
    tolerance=1e-12, mutant=("s for s²", lambda f: lambda i, a: f(i * [[0.5, 0.5, 1]], a)),
)  # fmt: skip
@check(
    "(38)", "-k z'_i is o'_z where its derivative is 0 and its second derivative positive", "autodiff",
    "sampling.bounded_cap.bound", tolerance=1e-12, as_height=lambda k, i, a: -k * warp(i, a)[:, 2],
    mutant=("k = 1", lambda f: lambda i, a: 1.0),
)  # fmt: skip
def smallest_height(value, as_height=lambda h, i, a: h):
    at = own(*cases.pairs(TILTED, EVEN))
    low = as_height(value(*at[1:]), *at[1:])
    return max(extremum(mirrored_height, -1), worst(low - Batched(mirrored_height, RANKS)(*at)))


@check(
    "(39)", "no sample of D_vis that reflects above the horizon lies below -k z'_i", "monte_carlo",
    ["sampling.bounded_cap.bound", "sampling.spherical_cap.sample", "geometry.reflect"], tolerance=1e-12,
    mutant=("larger α for smaller", lambda f: lambda i, a: literal_k(i, a.max(axis=-1, keepdims=True))),
)  # fmt: skip
def support_is_kept(bound, sample, reflect, stream):
    """The height on the cap is the one that the second number draws; the horizon itself, where rounding decides, is left out."""
    lost = [0.0]
    for i, alpha in ABOVE:
        u = stream.uniform(stream.samples // 4, 2)
        z = warp(i, alpha)[2]
        height = (1 - u[:, 1]) * (1 + z) - z
        above = reflect(i, sample(u, i, alpha))[:, 2] > 1e-9
        lost.append(float(np.max(-bound(i, alpha) * z - height[above])))
    return max(lost)


def whole_cap_share(i, alpha):
    z = warp(i, alpha)[..., 2]
    return (1 + literal_k(i, alpha) * z) / (1 + z)


@check(
    "limitation", "p_bound has (1 + z'_i)/(1 + k z'_i) times the mass of D_vis above the horizon, at most 1", "quadrature",
    ["sampling.bounded_cap.pdf", "sampling.spherical_cap.pdf", "jacobian.reflection", "sampling.bounded_cap.bound"],
    tolerance=1e-3, mutant=("D_vis: k = 1", lambda f: lambda m, i, a: f(m, i, a) * whole_cap_share(i, a)),
)  # fmt: skip
def mass_above_horizon(bounded, visible, jacobian, bound):
    """Tolerance of a mass at most 1: the rule over directions, where the lobe leans on the horizon."""
    errors = []
    for alpha in np.array([[0.3, 0.5], [1.0, 1.0], [2.0, 0.7]]):
        i = cases.UP[:4]
        k, z = bound(i, alpha), warp(i, np.broadcast_to(alpha, (4, 2)))[:, 2]

        def mass(pdf, i=i, alpha=alpha):
            def density(i, o):
                m = unit(i + o)
                return pdf(m, i, np.broadcast_to(alpha, (len(m), 2))) * jacobian(o, m)

            return hemispherical(density, i)

        above = mass(bounded)
        errors += [relative(above, mass(visible) * (1 + z) / (1 + k * z)), worst(np.maximum(0, above - 1))]
    return max(errors)
