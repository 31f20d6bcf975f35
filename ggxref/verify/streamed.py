"""Normalisations by tens of millions of samples (`ggxref verify --thorough`), in float32, streamed in blocks."""

from collections.abc import Callable
from functools import partial

import jax.numpy as jnp
import numpy as np

from ggxref import stable
from ggxref.verify import cases, engine, montecarlo
from ggxref.verify.batch import Batched
from ggxref.verify.statistics import FALSE_ALARM, unlikely_difference

# Samples of each case for one of an ordinary check: 2²⁶ by default.
FACTOR = 1 << 7

check = partial(engine.check, method="monte_carlo", tolerance=FALSE_ALARM, thorough=True)


def over_normals(density: Callable, A: np.ndarray) -> Callable:
    """Integrand over the unit square whose mean is ∫ density(m) dm over all directions, for densities that follow A.

    The square is folded to an octahedron p (|x| + |y| + |z| = 1), carried by Aᵀ and projected to the sphere: dm is
    4 |det A|/‖Aᵀp‖³ du. For D of GGX and the ellipsoid the integrand is bounded whatever A; it needs no sine.
    """
    A = np.asarray(A, np.float32)
    area = np.float32(4 * abs(np.linalg.det(A.astype(float))))

    def integrand(u):
        x, y = 2 * u[0] - 1, 2 * u[1] - 1
        z = 1 - jnp.abs(x) - jnp.abs(y)
        fold = jnp.maximum(-z, 0)
        p = x - jnp.copysign(fold, x), y - jnp.copysign(fold, y), z
        # Written out: a matrix product is neither fused nor float32 on every device.
        q = [A[0, k] * p[0] + A[1, k] * p[1] + A[2, k] * p[2] for k in range(3)]
        *q, scale = stable.one_loop(*q, 1 / jnp.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]))
        return area * density(jnp.stack([c * scale for c in q])) * (scale * scale * scale)

    return integrand


GGX = [(cases.direction(30), np.array([0.3, 0.5])), (cases.direction(89.9, 1.0), np.array([0.005, 0.005]))]
ELLIPSOIDS = [(cases.direction(60, 2.0), cases.SHAPES[4]), (cases.direction(85, -2.5), cases.SHAPES[2])]


def two_thousandths_more(f):
    return Batched(lambda *v: f.function(*v) * 1.002, f.ranks)


def upright(alpha):
    return np.diag([*alpha, 1.0])


@check(
    "heitz2014", "(1)", "∫ (m·n) D dm = 1, GGX, streamed", functions="ndf.ggx", mutant=("1.002 D", two_thousandths_more),
    density=lambda D, i, alpha: lambda m: D(m, alpha) * jnp.maximum(m[2], 0), shapes=GGX, matrix=upright,
)  # fmt: skip
@check(
    "heitz2014", "(5)", "∫ D_wi dm = 1, GGX, streamed", functions="sampling.spherical_cap.pdf",
    mutant=("1.002 D_wi", two_thousandths_more),
    density=lambda pdf, i, alpha: lambda m: pdf(m, i, alpha), shapes=GGX, matrix=upright,
)  # fmt: skip
@check(
    "walter2014", "(33)", "∫ p_h dm = 1, streamed", functions="sampling.lune.pdf", mutant=("1.002 p_h", two_thousandths_more),
    density=lambda pdf, i, A: lambda m: pdf(m, i, A), shapes=ELLIPSOIDS, matrix=lambda A: A,
)  # fmt: skip
@check(
    "tokuyoshi2024", "(43)", "∫ p_bound dm = 1, streamed", functions="sampling.bounded_cap.pdf",
    mutant=("1.002 p_bound", two_thousandths_more),
    density=lambda pdf, i, alpha: lambda m: pdf(m, i, alpha), shapes=GGX, matrix=upright,
)  # fmt: skip
def is_normalised(formula, density, shapes, matrix, stream):
    found = []
    for number, (i, shape) in enumerate(shapes):
        given = (jnp.asarray(x, jnp.float32) for x in (i, shape))
        integrand = over_normals(density(formula.function, *given), matrix(shape))
        found.append(montecarlo.mean(integrand, stream.samples * FACTOR, name=f"{stream.name} {number}", about=1.0))
    return unlikely_difference(np.array([e.mean - 1 for e in found]), np.array([e.error for e in found]))
