"""What the package adds, by quadrature and by differentiation: areas of the canonical shape, mean slope, mean Fresnel, frames."""

from functools import partial

import jax.numpy as jnp
import numpy as np

from ggxref.verify import cases, engine
from ggxref.verify.batch import Batched
from ggxref.verify.charts import NORMAL, front, gauss, integrals, lune, unit
from ggxref.verify.engine import relative, worst
from ggxref.verify.ours import uncorrected_canonical
from ggxref.verify.walter2014 import QUADRATURE, norm, skew_of, times

check = partial(engine.check, "ours")


@check(
    "canonical form", "the visible areas ∫ ⟨u·m⟩ D dm of the canonical shape are those of the lunes of A", "quadrature",
    ["ellipsoid.canonical", "ndf.ellipsoid"], tolerance=QUADRATURE, mutant=("Σ without - e eᵀ", lambda f: uncorrected_canonical),
)  # fmt: skip
def canonical_areas(canonical, D):
    u, k = cases.pairs(cases.UP, np.arange(len(cases.SHAPES)))
    A, B = cases.SHAPES[k], canonical(cases.SHAPES)[k]
    seen = integrals(
        lambda m, u, B: front(u, m) * D(m, B), [lune(x, NORMAL, y) for x, y in zip(u, B, strict=True)], u, B
    )
    Au, An = times(A, u), A[..., 2]
    return relative(seen, (norm(Au) * norm(An) + np.sum(Au * An, axis=-1)) / (2 * skew_of(A) ** 2))


@check(
    "slope parameters", "the mean slope ∫ (-x/z, -y/z) D z dm is `mean`", "quadrature", ["ellipsoid.from_slopes", "ndf.ellipsoid"],
    tolerance=QUADRATURE, mutant=("e = +mean", lambda f: lambda mean, scatter: f(-mean, scatter)),
)  # fmt: skip
def mean_slope(from_slopes, D):
    mean = np.array([[0.2, -0.1], [0.0, 0.0], [-0.5, 0.7]])
    scatter = np.array([[[0.09, 0.02], [0.02, 0.04]], [[0.25, 0.0], [0.0, 0.01]], [[0.6, -0.3], [-0.3, 0.5]]])
    A = from_slopes(mean, scatter)
    rules = [lune(NORMAL, NORMAL, B) for B in A]
    got = [integrals(lambda m, A, k=k: -m[:, k] * D(m, A), rules, A) for k in (0, 1)]
    return worst(np.array(got).T - mean)


def mean_reflectance(n):
    """∫ 2 c F dc of a dielectric of index n > 1 from outside, in closed form (Duderstadt & Hamilton; Egan & Hilgeman)."""
    log, log_ratio = np.log(n), np.log((n - 1) / (n + 1))
    terms = (
        (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2),
        n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3 * log_ratio,
        -2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1)),
        8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * log,
    )
    return 0.5 + sum(terms)


@check(
    "Fresnel", "the mean over a diffuse hemisphere: a dielectric's closed form, a conductor's with k = 0, Schlick's f0 + (1 - f0)/21",
    "quadrature", ["fresnel.dielectric", "fresnel.conductor", "fresnel.schlick"], tolerance=1e-10,
    mutant=("1/η for η", lambda f: lambda c, eta: f(c, 1 / eta)),
)  # fmt: skip
def mean_fresnel(dielectric, conductor, schlick):
    c, weight = gauss([0, 0.01, 0.1, 1], 60)
    errors = []
    for n in (1.2, 1.5, 2.4):
        means = [weight @ (2 * c * F) for F in (dielectric(c, 1 / n), conductor(c, n, 0.0))]
        errors.append(worst(np.array(means) - mean_reflectance(n)))
    return max(*errors, worst(weight @ (2 * c * schlick(c, 0.04)) - (0.04 + 0.96 / 21)))


@check(
    "frames", "as w moves the frame turns: its derivative times its transpose is antisymmetric, and the third row moves with w",
    "autodiff", "geometry.basis", tolerance=1e-12,
    mutant=("rows not normalised", lambda f: Batched(lambda w: f.function(w) * jnp.array([[w[2]], [1.0], [1.0]]), (1,))),
)  # fmt: skip
def frames_turn(basis):
    w = cases.sphere(200)
    along = unit(np.cross(w, [0.3, 0.5, 0.8]))
    rate = np.einsum("nijk,nk->nij", basis.derivative(0)(w), along)
    turn = rate @ np.swapaxes(basis(w), -1, -2)
    return max(worst(turn + np.swapaxes(turn, -1, -2)), worst(rate[:, 2] - along))
