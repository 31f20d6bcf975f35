"""Heitz & d'Eon 2014 by differentiation: slopes as a change of variables, shape invariance, the operators by Fermat's principle."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ggxref.verify import cases, engine
from ggxref.verify.batch import Batched
from ggxref.verify.charts import dot, gauss
from ggxref.verify.engine import relative, worst
from ggxref.verify.heitz2014 import PAPER, ROUNDING, printed_transmit
from ggxref.verify.heitz2014_slopes import ONE, plane, sees, swapped

check = partial(engine.check, PAPER)

N_I, N_O = 1.1, 1.6


def path(x, wi, wo, n_i, n_o):
    """Optical path from the point wi to the point wo by way of x."""
    return n_i * jnp.linalg.norm(x - wi) + n_o * jnp.linalg.norm(x - wo)


PATH = Batched(path, (1, 1, 1, 0, 0))
ORIGIN = np.zeros(3)


def detour(wi, wo, m, n_i: Any = 1.0, n_o: Any = 1.0):
    """Change of the path's length as the point of incidence moves in the plane of m, and the length of wo less 1."""
    return max(worst(np.cross(PATH.derivative(0)(ORIGIN, wi, wo, n_i, n_o), m)), worst(np.linalg.norm(wo, axis=-1) - 1))


@check(
    "§2.2 reflect", "Fermat: the path by the mirrored direction is stationary, and stays on m's side", "autodiff", "geometry.reflect",
    tolerance=ROUNDING, mutant=("2 lost", lambda f: lambda w, m: dot(w, m)[..., None] * m - w),
    also=["walter2014 (47)", "dupuy2023 (5)", "tokuyoshi2024 (25)", "tokuyoshi2024 (26)"],
)  # fmt: skip
def reflection_is_stationary(reflect):
    w, m = cases.pairs(cases.sphere(60), cases.sphere(61))
    o = reflect(w, m)
    return max(detour(w, o, m), worst(np.minimum(0, dot(w, m) * dot(o, m))))


@check(
    "§2.2 transmit", "Fermat: the optical path by the refracted direction is stationary, and crosses the interface", "autodiff",
    "geometry.refract", tolerance=ROUNDING, mutant=("n for n² under the root", lambda f: printed_transmit),
)  # fmt: skip
def refraction_is_stationary(refract):
    w, m, eta = cases.triples(cases.sphere(40), cases.sphere(41), np.array([0.5, 0.66, 1.5, 2.4]))
    keep = 1 + eta**2 * (dot(w, m) ** 2 - 1) > 1e-3
    w, m, eta = w[keep], m[keep], eta[keep]
    o = refract(w, m, eta)
    return max(detour(w, o, m, eta, 1.0), worst(np.maximum(0, dot(w, m) * dot(o, m))))


@check(
    "§2.2 reflect", "Fermat: on a facet whose normal is the half vector the path from wi to wo is stationary", "autodiff",
    "geometry.half_reflection", tolerance=ROUNDING, indices=(1.0, 1.0), also=["dupuy2023 (6)"],
    mutant=("of wi and -wo", lambda f: lambda i, o: f(i, -o)),
)  # fmt: skip
@check(
    "§2.2 transmit", "Fermat: on a facet whose normal is the half vector the optical path from wi to wo is stationary", "autodiff",
    "geometry.half_refraction", tolerance=1e-11, indices=(N_I, N_O), also=["ours half vectors"],
    mutant=("indices exchanged", lambda f: lambda i, o, a, b: f(i, o, b, a)),
)  # fmt: skip
def half_vector_is_stationary(half, indices):
    """Tolerance of transmission: n_i wi + n_o wo is a tenth of its terms."""
    i, o = cases.pairs(cases.UP, cases.sphere(121))
    h = half(i, o) if indices[0] == indices[1] else half(i, o, *indices)
    return detour(i, o, h, *indices)


def phong(slope, alpha):
    """Phong's distribution as slopes, exponent 2/(α_x α_y) - 2, for differentiation."""
    s = 2 / (alpha[0] * alpha[1]) - 2
    return (s + 2) / (2 * jnp.pi) * (1 + slope @ slope) ** (-(s + 4) / 2)


def ggx(slope, alpha):
    return 1 / (jnp.pi * alpha[0] * alpha[1] * (1 + (slope[0] / alpha[0]) ** 2 + (slope[1] / alpha[1]) ** 2) ** 2)


PHONG = Batched(phong, (1, 1))


def stretch_rate(P22, slope, alpha):
    """Logarithmic change of λ P22(λ x̃; λ α) with λ, for either axis: 0 where P22 is shape-invariant."""
    flow = alpha * P22.derivative(1)(slope, alpha) + slope * P22.derivative(0)(slope, alpha)
    return flow / P22(slope, alpha)[..., None] + 1


def visible_rate(P22_i, stretch) -> Batched:
    """Logarithmic change of λ P22_wi(λ x̃; stretched wi, λ α) with λ, for either axis."""

    def rate(slope, wi, alpha):
        def moved(factors):
            there = P22_i(slope * factors, stretch(wi, 1 / factors), alpha * factors)
            return jnp.log(there * factors[0] * factors[1])

        return jax.jacfwd(moved)(jnp.ones(2))

    return Batched(rate, (1, 1, 1))


for _name in ("ggx", "beckmann"):

    @check(
        "§5.1 P22", f"(m·n) D ‖∂m/∂m̃‖ = P22, by differentiating the normal of a slope, {_name}", "autodiff",
        [f"slopes.{_name}", f"ndf.{_name}", "slopes.to_normal"], tolerance=1e-12, mutant=("axes swapped", swapped),
    )  # fmt: skip
    def slopes_of_normals(P22, D, to_normal):
        slope, alpha = cases.pairs(plane(), cases.ALPHAS)
        m = to_normal(slope * alpha)
        return relative(m[:, 2] * D(m, alpha) * to_normal.area_ratio(0)(slope * alpha), P22(slope * alpha, alpha))

    @check(
        "(6)", f"D_wi ‖∂m/∂m̃‖ = P22_wi, by differentiating the normal of a slope, {_name}", "autodiff",
        [f"slopes.visible_{_name}", f"sampling.slope_{_name}.pdf", "slopes.to_normal"], tolerance=1e-9,
        mutant=("(7) as printed", lambda f: lambda s, i, a: f(-s, i, a)),
    )  # fmt: skip
    def visible_slopes(P22_i, pdf, to_normal):
        """Tolerance: wi·m loses digits near the edge of what wi sees; slopes within 1e-3 of it are left out."""
        slope, i, alpha = cases.triples(plane(), cases.UP, cases.ALPHAS[2:])
        slope = slope * alpha
        keep = sees(i, slope) > 1e-3
        slope, i, alpha = slope[keep], i[keep], alpha[keep]
        return relative(pdf(to_normal(slope), i, alpha) * to_normal.area_ratio(0)(slope), P22_i(slope, i, alpha))

    @check(
        "(8)", f"λ P22(λ x̃; λ α) does not change with λ, by its derivative, {_name}", "autodiff", f"slopes.{_name}",
        tolerance=1e-11, mutant=("Phong's slopes", lambda f: PHONG),
    )  # fmt: skip
    def shape_invariance(P22):
        slope, alpha = cases.pairs(plane(), cases.ALPHAS[2:])
        return worst(stretch_rate(P22, slope * alpha, alpha))

    @check(
        "(9)", f"P22_wi under a stretch of slopes, α and wi does not change, by its derivative, {_name}", "autodiff",
        [f"slopes.visible_{_name}", "slopes.stretch"], tolerance=1e-9, also=["appendix A"],
        mutant=("axes swapped", lambda f: Batched(lambda slope, wi, alpha: f.function(slope, wi, alpha[::-1]), (1, 1, 1))),
    )  # fmt: skip
    def visible_shape_invariance(P22_i, stretch):
        """Tolerance: 1/s of slopes near the edge of what wi sees; those within 1e-2 of it are left out."""
        slope, i, alpha = cases.triples(plane(), cases.UP, cases.ALPHAS[2:])
        slope = slope * alpha
        keep = sees(i, slope) > 1e-2
        slope, i, alpha = slope[keep], i[keep], alpha[keep]
        return worst(visible_rate(P22_i.function, stretch.function)(slope, i, alpha))

    @check(
        "(12)", f"P22_wi over its integral along ỹ is P22 over its own, {_name}", "quadrature",
        [f"slopes.visible_{_name}", f"slopes.{_name}"], tolerance=1e-12,
        mutant=("with y_i ỹ in the projection", lambda f: lambda s, i, a: f(s, i, a) * (1 + 0.1 * i[..., 0] * s[..., 1])),
    )  # fmt: skip
    def conditional_slope(P22_i, P22):
        i = np.stack([cases.direction(d, 0) for d in (10, 45, 70)])[:, None, None]
        t, weight = gauss([-np.pi / 2, np.pi / 2], 200)
        slope = np.stack(np.meshgrid(np.linspace(-3, 0.3, 20), np.tan(t), indexing="ij"), axis=-1)
        weight = weight / np.cos(t) ** 2
        visible, whole = P22_i(slope, i, ONE), P22(slope, ONE)
        return worst(visible / (visible @ weight)[..., None] - whole / (whole @ weight)[..., None])


@check(
    "limitation", "Phong's slopes: λ P22(λ x̃; λ α) changes with λ; reciprocal of the largest rate", "autodiff", PHONG,
    tolerance=0.5, mutant=("GGX, which is shape-invariant", lambda f: Batched(ggx, (1, 1))),
)  # fmt: skip
def phong_is_not_invariant(P22):
    alpha = np.array([0.3, 0.3])
    return 1 / max(1e-300, worst(stretch_rate(P22, plane() * alpha, alpha)))
