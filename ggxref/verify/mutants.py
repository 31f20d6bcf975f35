"""Wrong formulas put in the library's place, one at a time: the checks have to notice each.

They are what people get wrong: the documents' misprints, α for α², a lost π, Jacobian, η² or |A n|, swapped axes, G1 of
the wrong direction, one α for two, separable for correlated, limits of the wrong sign, a clamp where none belongs.
"""

import importlib
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps

import jax.numpy as jnp

from ggxref.verify import batch
from ggxref.verify.engine import METHODS, Check


@dataclass(frozen=True)
class Mutant:
    """A wrong form of the function of that public name; `through`: the public function that shows it, if no check calls it."""

    target: str
    name: str
    change: Callable
    through: str = ""

    @contextmanager
    def installed(self) -> Iterator[None]:
        """The library with the wrong formula in it, wherever it is called by that module's name."""
        module_name, _, attribute = self.target.rpartition(".")
        module = importlib.import_module(f"ggxref.{module_name}")
        right = getattr(module, attribute)
        setattr(module, attribute, wraps(right)(self.change(right)))
        batch.forget()
        try:
            yield
        finally:
            setattr(module, attribute, right)
            batch.forget()


@dataclass(frozen=True)
class Verdict:
    """What became of a mutant: the check that killed it, if one did, and its error."""

    mutant: Mutant
    killer: Check | None
    error: float
    seconds: float


def suspects(mutant: Mutant, checks: Sequence[Check]) -> list[Check]:
    """The checks that may notice, those of the function itself before all others that call the library.

    Identities go first, being cheap and sharp, and samples last.
    """

    def rank(check):
        own = mutant.target in check.functions or mutant.through in check.functions
        return not own, METHODS.index(check.method), len(check.functions)

    return sorted((c for c in checks if any(_of_library(f) for f in c.functions)), key=rank)


def _of_library(function):
    return isinstance(function, str) and not function.startswith("oracle.")


def hunt(mutant: Mutant, checks: Sequence[Check], samples: int) -> Verdict:
    """Run the suspects on the mutated library until one fails."""
    start = time.perf_counter()
    with mutant.installed():
        for each in suspects(mutant, checks):
            error = each.error(samples)
            if not error <= each.tolerance:
                return Verdict(mutant, each, error, time.perf_counter() - start)
    return Verdict(mutant, None, 0.0, time.perf_counter() - start)


def swap(v):
    return v[::-1]


def mean(alpha):
    """√(α_x α_y) in both places."""
    return jnp.sqrt(alpha * alpha[::-1])


def length(x):
    return jnp.sqrt(x @ x)


def unit(x):
    return x / length(x)


def stretched(wm, alpha):
    return (wm[0] / alpha[0]) ** 2 + (wm[1] / alpha[1]) ** 2 + wm[2] ** 2


MUTANTS = [
    # D
    Mutant("ndf.hemisphere", "1/(2π)", lambda f: lambda wm: f(wm) / 2),
    Mutant("ndf.hemisphere", "without χ⁺", lambda f: lambda wm: 1 / jnp.pi + 0 * wm[2]),
    Mutant("ndf.ggx", "π lost", lambda f: lambda wm, alpha: f(wm, alpha) * jnp.pi),
    Mutant("ndf.ggx", "α² for α", lambda f: lambda wm, alpha: f(wm, alpha**2)),
    Mutant("ndf.ggx", "axes swapped", lambda f: lambda wm, alpha: f(wm, swap(alpha))),
    Mutant("ndf.ggx", "√(α_x α_y) for both", lambda f: lambda wm, alpha: f(wm, mean(alpha))),
    Mutant("ndf.ggx", "square lost", lambda f: lambda wm, alpha: f(wm, alpha) * stretched(wm, alpha)),
    Mutant("ndf.ggx", "cos included", lambda f: lambda wm, alpha: f(wm, alpha) * wm[2]),
    Mutant("ndf.ggx", "without χ⁺", lambda f: lambda wm, alpha: f(wm.at[2].set(jnp.abs(wm[2])), alpha)),
    Mutant("ndf.ggx", "α clamped to 0.05", lambda f: lambda wm, alpha: f(wm, jnp.maximum(alpha, 0.05))),
    Mutant("ndf.beckmann", "cos² for cos⁴", lambda f: lambda wm, alpha: f(wm, alpha) * wm[2] ** 2),
    Mutant("ndf.beckmann", "axes swapped", lambda f: lambda wm, alpha: f(wm, swap(alpha))),
    Mutant("ndf.beckmann", "√2 α for α", lambda f: lambda wm, alpha: f(wm, alpha * 2**0.5)),
    Mutant("ndf.student_t", "γ for γ - 1", lambda f: lambda wm, alpha, gamma: f(wm, alpha, gamma + 1)),
    Mutant("ndf.student_t", "(γ-1)^γ lost", lambda f: lambda wm, alpha, gamma: f(wm, alpha, gamma) / (gamma - 1) ** gamma),
    Mutant("ndf.ellipsoid", "‖A n‖ lost", lambda f: lambda wm, A: f(wm, A) * length(A[:, 2])),
    Mutant("ndf.ellipsoid", "A⁻¹ for A⁻ᵀ", lambda f: lambda wm, A: f(wm, A.T) * length(A[2]) / length(A[:, 2])),
    Mutant("ndf.ellipsoid", "|A|² for |A|", lambda f: lambda wm, A: f(wm, A) / jnp.abs(jnp.linalg.det(A))),
    # slopes
    Mutant("slopes.ggx", "α_x α_y lost", lambda f: lambda slope, alpha: f(slope, alpha) * alpha[0] * alpha[1]),
    Mutant("slopes.beckmann", "axes swapped", lambda f: lambda slope, alpha: f(slope, swap(alpha))),
    Mutant("slopes.ellipsoid", "mean slope of the wrong sign", lambda f: lambda slope, A: f(-slope, A)),
    Mutant("slopes.student_t", "γ = 2", lambda f: lambda slope, alpha, gamma: f(slope, alpha, 2.0)),
    Mutant("slopes.visible_ggx", "(7) as printed", lambda f: lambda slope, wi, alpha: f(-slope, wi, alpha)),
    Mutant("slopes.visible_beckmann", "(7) as printed", lambda f: lambda slope, wi, alpha: f(-slope, wi, alpha)),
    Mutant("slopes.from_normal", "sign lost", lambda f: lambda wm: -f(wm)),
    Mutant("slopes.to_normal", "not normalised", lambda f: lambda slope: f(slope) / f(slope)[2]),
    Mutant("slopes.stretch", "divided", lambda f: lambda w, factors: f(w, 1 / factors)),
    Mutant("_seen.area_ggx", "|z| for z", lambda f: lambda w, alpha, k: f((w[0], w[1], jnp.abs(w[2])), alpha, k), "sampling.slope_ggx.pdf"),
    Mutant("slopes.sigma_beckmann", "axes swapped", lambda f: lambda w, alpha: f(w, swap(alpha)), "sampling.slope_beckmann.pdf"),
    # masking
    Mutant("masking.lambda_ggx", "without the half", lambda f: lambda w, alpha: 2 * f(w, alpha)),
    Mutant("masking.lambda_ggx", "axes swapped", lambda f: lambda w, alpha: f(w, swap(alpha))),
    Mutant("masking.lambda_beckmann", "GGX's", lambda f: lambda w, alpha: f(w, alpha * 1.1)),
    Mutant("masking.g1_ggx", "√(α_x α_y) for both", lambda f: lambda w, wm, alpha: f(w, wm, mean(alpha))),
    Mutant("masking.g1_ggx", "χ⁺ lost", lambda f: lambda w, wm, alpha: f(w, w, alpha)),
    Mutant("masking.g1_ggx", "of the micronormal", lambda f: lambda w, wm, alpha: f(wm, w, alpha)),
    Mutant("masking.g1_ggx", "α/2 (Disney's remapping)", lambda f: lambda w, wm, alpha: f(w, wm, alpha / 2)),
    Mutant("masking.g1_beckmann", "axes swapped", lambda f: lambda w, wm, alpha: f(w, wm, swap(alpha))),
    Mutant("masking.g1_beckmann", "rational fit's 1.6 limit", lambda f: lambda w, wm, alpha: _rational_g1(f, w, wm, alpha)),
    Mutant("masking.g1_v_cavity", "minimum lost", lambda f: lambda w, wm: 2 * wm[2] * w[2] / jnp.abs(w @ wm)),
    Mutant("masking.g1_v_cavity", "2 lost", lambda f: lambda w, wm: jnp.minimum(f(w, wm), wm[2] * w[2] / jnp.abs(w @ wm))),
    Mutant("masking.g1_ellipsoid", "‖A n‖ for ‖A n‖²", lambda f: lambda w, wm, A: f(w, wm, A) / length(A[:, 2])),
    Mutant("masking.g1_ellipsoid", "minimum lost", lambda f: lambda w, wm, A: _g1_without_minimum(f, w, wm, A)),
    Mutant("masking.g2_separable", "minimum", lambda f: lambda g1_i, g1_o: jnp.minimum(g1_i, g1_o)),
    Mutant("masking.g2_height_correlated", "separable", lambda f: lambda g1_i, g1_o: g1_i * g1_o),
    Mutant("masking.g2_height_correlated", "minimum", lambda f: lambda g1_i, g1_o: jnp.minimum(g1_i, g1_o)),
    Mutant("masking.g2_v_cavity", "reflection's branch for both", lambda f: lambda wi, wo, wm: f(wi, jnp.sign(wo[2]) * wo, wm)),
    # Fresnel
    Mutant("fresnel.dielectric", "1/η for η", lambda f: lambda cos_i, eta: f(cos_i, 1 / eta)),
    Mutant("fresnel.dielectric", "one polarisation", lambda f: lambda cos_i, eta: f(cos_i, eta) ** 1.1),
    Mutant("fresnel.conductor", "k of the wrong power", lambda f: lambda cos_i, eta, k: f(cos_i, eta, k**2)),
    Mutant("fresnel.schlick", "power 4", lambda f: lambda cos_i, f0: f0 + (1 - f0) * (1 - jnp.abs(cos_i)) ** 4),
    # geometry
    Mutant("geometry.reflect", "as tokuyoshi2024 (25) prints", lambda f: lambda w, wm: 2 * (w @ wm) * wm[2] - w),
    Mutant("geometry.refract", "n for n² under the root", lambda f: lambda w, wm, eta: _printed_refract(w, wm, eta)),
    Mutant("geometry.half_reflection", "not normalised", lambda f: lambda wi, wo: wi + wo),
    Mutant("geometry.half_refraction", "indices swapped", lambda f: lambda wi, wo, n_i, n_o: f(wi, wo, n_o, n_i)),
    Mutant("geometry.basis", "normal incidence's special case of an ε", lambda f: lambda w: f(w) * jnp.array([[1.0], [-1.0], [1.0]])),
    Mutant("jacobian.reflection", "1/2 for 1/4", lambda f: lambda wo, wm: 2 * f(wo, wm)),
    Mutant("jacobian.refraction", "n_o² lost", lambda f: lambda wi, wo, wm, n_i, n_o: f(wi, wo, wm, n_i, n_o) / n_o**2),
    Mutant("jacobian.refraction", "of wi", lambda f: lambda wi, wo, wm, n_i, n_o: f(wo, wi, wm, n_o, n_i)),
    Mutant("jacobian.slope", "cos⁴", lambda f: lambda wm: f(wm) / wm[2]),
    Mutant("jacobian.linear", "‖Mm‖² for ‖Mm‖³", lambda f: lambda wm, M: f(wm, M) * length(M @ wm)),
    # the ellipsoid's areas
    Mutant("ellipsoid.shape_matrix", "R_z R_y R_x", lambda f: lambda alpha, angles: f(alpha, -angles)),
    Mutant("ellipsoid.canonical", "upper Cholesky factor", lambda f: lambda A: f(A[:, jnp.array([1, 0, 2])])),
    Mutant("ellipsoid.from_slopes", "e = +mean", lambda f: lambda mean, scatter: f(-mean, scatter)),
    Mutant("ellipsoid.sggx", "A Aᵀ", lambda f: lambda A: f(A.T)),
    Mutant("ellipsoid.size", "π lost", lambda f: lambda A: f(A) * jnp.pi**0.5),
    Mutant("ellipsoid.gaussian_curvature", "‖A⁻ᵀm‖²", lambda f: lambda wm, A, size: jnp.sqrt(f(wm, A, size)) / size),
    Mutant("ellipsoid.projected_area", "A⁻¹ for A", lambda f: lambda w, A, size: f(w, jnp.linalg.inv(A), size)),
    Mutant("ellipsoid.lune_area", "u and v swapped", lambda f: lambda u, v, A, size: f(v, u, A, size)),
    Mutant("ellipsoid.lune_area", "½ lost", lambda f: lambda u, v, A, size: 2 * f(u, v, A, size)),
    Mutant("ellipsoid.mean_normal", "n", lambda f: lambda A: jnp.array([0.0, 0.0, 1.0])),
    # samplers and their densities
    Mutant("sampling.normals.sample_ggx", "√α for α", lambda f: lambda u, alpha: f(u, jnp.sqrt(alpha))),
    Mutant("sampling.normals.pdf_ggx", "cos lost", lambda f: lambda wm, alpha: f(wm, alpha) / wm[2]),
    Mutant("sampling.normals.sample_beckmann", "log u for log(1 - u), halved", lambda f: lambda u, alpha: f(u * 0.99, alpha)),
    Mutant("sampling.slope_ggx.sample", "not rotated back", lambda f: lambda u, wi, alpha: f(u, wi * jnp.array([1.0, -1.0, 1.0]), alpha)),
    Mutant("sampling.slope_ggx.pdf", "G1 lost", lambda f: lambda wm, wi, alpha: f(wm, wi, alpha) * wi[2]),
    Mutant("sampling.slope_beckmann.sample", "u of the slope across reused", lambda f: lambda u, wi, alpha: f(u[jnp.array([0, 0])], wi, alpha)),
    Mutant("sampling.v_cavity.sample", "swap test reversed", lambda f: _reversed_swap(f)),
    Mutant("sampling.cross_section.sample", "disk radius not √u", lambda f: lambda u, wi, alpha: f(u.at[1].set(u[1] ** 2), wi, alpha)),
    Mutant("sampling.spherical_cap.sample", "line 8 as printed", lambda f: lambda u, wi, alpha: unit(wi * jnp.append(alpha, 1.0)) + 0 * u[0]),
    Mutant("sampling.spherical_cap.cap_pdf", "limit of the wrong sign", lambda f: lambda wo, wi: jnp.where(wo[2] > wi[2], f(wi, wi), 0.0)),
    Mutant("sampling.bounded_cap.bound", "larger α", lambda f: lambda wi, alpha: f(wi, jnp.full(2, alpha.max()))),
    Mutant("sampling.bounded_cap.bound", "without the minimum with 1", lambda f: lambda wi, alpha: _k_without_one(wi, alpha)),
    Mutant("sampling.bounded_cap.pdf", "not 0 outside the cap", lambda f: lambda wm, wi, alpha: _p_bound_everywhere(f, wm, wi, alpha)),
    Mutant("sampling.lune.sample", "unit of the ellipsoid's point, A⁻¹ p_c", lambda f: lambda u, wi, A: f(u, wi, A[:, jnp.array([1, 0, 2])])),
    Mutant("sampling.ellipsoid_cap.sample", "A not canonical", lambda f: lambda u, wi, A: f(u, wi, A.T)),
    Mutant("sampling.ellipsoid_bounded.bound", "of the horizon's own azimuth only", lambda f: lambda wi, A: f(wi, A) + 0.02),
    # put together
    Mutant("bsdf.brdf", "2 for 4", lambda f: lambda wi, wo, D, G2, F: 2 * f(wi, wo, D, G2, F)),
    Mutant("bsdf.brdf", "cos θ_o lost", lambda f: lambda wi, wo, D, G2, F: f(wi, wo, D, G2, F) * jnp.abs(wo[2])),
    Mutant("bsdf.brdf_ggx", "cos θ_o lost", lambda f: lambda wi, wo, alpha: f(wi, wo, alpha) * wo[2]),
    Mutant("bsdf.btdf", "n_o² lost", lambda f: lambda wi, wo, n_i, n_o, D, G2, F: f(wi, wo, n_i, n_o, D, G2, F) / n_o**2),
    Mutant("bsdf.btdf", "F for 1 - F", lambda f: lambda wi, wo, n_i, n_o, D, G2, F: f(wi, wo, n_i, n_o, D, G2, 1 - F)),
    Mutant("bsdf.weight_normals", "table 2 as printed", lambda f: lambda wi, wm, G2: f(wi, wm, G2) * jnp.abs(wi[2])),
    Mutant("bsdf.weight_visible", "F lost", lambda f: lambda g1_i, g2, F: f(g1_i, g2, 1.0)),
]  # fmt: skip


def _rational_g1(f, w, wm, alpha):
    """G1 of Beckmann as Walter et al. 2007 fit it."""
    a = w[2] / jnp.sqrt((alpha[0] * w[0]) ** 2 + (alpha[1] * w[1]) ** 2)
    fit = (3.535 * a + 2.181 * a * a) / (1 + 2.276 * a + 2.577 * a * a)
    return jnp.where(f(w, wm, alpha) > 0, jnp.where(a < 1.6, fit, 1.0), 0.0)


def _g1_without_minimum(f, w, wm, A):
    Aw, An = A @ w, A[:, 2]
    value = 2 * (An @ An) * w[2] / (length(Aw) * length(An) + Aw @ An)
    return jnp.where(f(w, wm, A) > 0, value, 0.0)


def _printed_refract(w, wm, eta):
    c = w @ wm
    return (eta * c - jnp.sign(w[2]) * jnp.sqrt(jnp.maximum(0, 1 + eta * (c**2 - 1)))) * wm - eta * w


def _k_without_one(wi, alpha):
    a, s = alpha.min(), 1 + jnp.sqrt(wi[0] ** 2 + wi[1] ** 2)
    return jnp.where(wi[2] > 0, (1 - a**2) * s**2 / (s**2 + (a * wi[2]) ** 2), 1.0)


def _p_bound_everywhere(f, wm, wi, alpha):
    """The article's closed form, wherever wm is in front."""
    a, s = jnp.minimum(1.0, alpha.min()), 1 + jnp.sqrt(wi[0] ** 2 + wi[1] ** 2)
    k = jnp.where(wi[2] > 0, (1 - a**2) * s**2 / (s**2 + (a * wi[2]) ** 2), 1.0)
    D = 1 / (jnp.pi * alpha[0] * alpha[1] * stretched(wm, alpha) ** 2)
    return 2 * D * jnp.maximum(0.0, wi @ wm) / (k * wi[2] + length(wi * jnp.append(alpha, 1.0)))


def _reversed_swap(f):
    """The wall is chosen by the share that it does not show."""

    def sample(u, wi, alpha, *, distribution="ggx"):
        return f(u, wi * jnp.array([-1.0, -1.0, 1.0]), alpha, distribution=distribution)

    return sample
