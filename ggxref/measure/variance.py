"""Efficiency of samplers, 1/(variance × time): of the reflected albedo under Smith's height-correlated G2, F = 1."""

from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from ggxref import geometry, masking, ndf
from ggxref.measure import speed
from ggxref.sampling import (
    bounded_cap,
    cross_section,
    ellipsoid_cap,
    lune,
    normals,
    slope_ggx,
    spherical_cap,
    v_cavity,
)

SAMPLES = 1 << 13


@dataclass(frozen=True)
class Sampler:
    """`sample(u, wi, alpha)` with `u` of three numbers, and its density `pdf(wm, wi, alpha)`."""

    sample: Callable
    pdf: Callable


def _diagonal(alpha):
    return jnp.diag(jnp.stack([alpha[0], alpha[1], jnp.ones_like(alpha[0])]))


def _of_two(module) -> Sampler:
    return Sampler(lambda u, wi, alpha: module.sample(u[:2], wi, alpha), module.pdf)


def _of_matrix(module) -> Sampler:
    return Sampler(
        lambda u, wi, alpha: module.sample(u[:2], wi, _diagonal(alpha)),
        lambda wm, wi, alpha: module.pdf(wm, wi, _diagonal(alpha)),
    )


SAMPLERS = {
    "normals": Sampler(
        lambda u, wi, alpha: normals.sample_ggx(u[:2], alpha), lambda wm, wi, alpha: normals.pdf_ggx(wm, alpha)
    ),
    "V-cavity": Sampler(v_cavity.sample, v_cavity.pdf),
    "slope": _of_two(slope_ggx),
    "cross-section": _of_two(cross_section),
    "cap": _of_two(spherical_cap),
    "bounded cap": _of_two(bounded_cap),
    "lune": _of_matrix(lune),
    "ellipsoid cap": _of_matrix(ellipsoid_cap),
}


def _estimate(sampler: Sampler, u, wi, alpha):
    """f cos θo over the density of ω_o: D G2 (ω_i·ω_m)/(z_i p(ω_m)), and 0 where ω_o is below the horizon."""
    wm = sampler.sample(u, wi, alpha)
    wo = geometry.reflect(wi, wm)
    g2 = masking.g2_height_correlated(masking.g1_ggx(wi, wm, alpha), masking.g1_ggx(wo, wm, alpha))
    density = sampler.pdf(wm, wi, alpha)
    value = ndf.ggx(wm, alpha) * g2 * jnp.dot(wi, wm) / (wi[2] * jnp.where(density > 0, density, 1))
    return jnp.where((density > 0) & (wo[2] > 0), value, 0)


def variances(name: str, alphas: np.ndarray, thetas: np.ndarray, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance of the estimate at every (α, θ): two arrays (len(alphas), len(thetas)). float64."""
    sampler = SAMPLERS[name]
    with jax.enable_x64(True):
        u = jnp.asarray(np.random.default_rng(seed).random((SAMPLES, 3)))

        def moments(alpha, theta):
            wi = jnp.stack([jnp.sin(theta), 0 * theta, jnp.cos(theta)])
            values = jax.vmap(lambda u: _estimate(sampler, u, wi, jnp.stack([alpha, alpha])))(u)
            return values.mean(), values.var()

        a, t = (jnp.asarray(g.ravel()) for g in np.meshgrid(alphas, np.radians(thetas), indexing="ij"))
        mean, variance = jax.jit(lambda a, t: jax.lax.map(lambda p: moments(*p), (a, t)))(a, t)
        shape = len(alphas), len(thetas)
        return np.asarray(mean).reshape(shape), np.asarray(variance).reshape(shape)


def times(points: int = 1 << 16, seconds: float = 4.0) -> dict[str, float]:
    """Nanoseconds a sample of each sampler, its density included, the best of turns (float32)."""

    def whole(sampler):
        def both(u, wi, alpha):
            wm = sampler.sample(u, wi, alpha)
            return jnp.concatenate([wm, sampler.pdf(wm, wi, alpha)[None]])

        return both

    _, wi, alpha = speed.inputs(("u", "wi", "alpha"), points)
    u = jnp.asarray(np.random.default_rng(0).random((3, points)), jnp.float32)
    subjects = {name: speed.subject(whole(s), [u, wi, alpha]) for name, s in SAMPLERS.items()}
    return {t.subject: t.best for t in speed.interleaved(subjects, points, seconds=seconds)}
