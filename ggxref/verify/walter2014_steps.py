"""Walter et al. 2014, §4.1: the equations of the sampling procedure, step by step, as printed (C_e = 1)."""

from functools import partial

import jax.numpy as jnp
import numpy as np

from ggxref.verify import cases, engine, samplers
from ggxref.verify.batch import Batched
from ggxref.verify.charts import NORMAL, dot, unit
from ggxref.verify.engine import relative, worst
from ggxref.verify.statistics import FALSE_ALARM, uniform_square, unlikely_mean
from ggxref.verify.walter2014 import PAPER, norm

check = partial(engine.check, PAPER)

ROUNDING = 1e-12
# The same shapes with |A| > 0, as the procedure assumes.
POSITIVE = [(i, A * np.sign(np.linalg.det(A))) for i, A in samplers.ELLIPSOIDS]


def square_to_disk(u):
    """(34)–(37): concentric map."""
    a, b = 2 * u[0] - 1, 2 * u[1] - 1
    wide = jnp.abs(a) > jnp.abs(b)
    t = jnp.where(wide, b / jnp.where(a == 0, 1, a), a / jnp.where(b == 0, 1, b)) * jnp.pi / 4
    return jnp.stack([jnp.where(wide, a * jnp.cos(t), b * jnp.sin(t)), jnp.where(wide, a * jnp.sin(t), b * jnp.cos(t))])


def compression(psi, A):
    """(38)"""
    a, n = A @ psi, A @ NORMAL
    return 0.5 * (1 + a @ n / (norm(a) * norm(n)))


def crescent(disk, s):
    """(39)–(41)"""
    x, y = disk.T
    x_b = s * x + (1 - s) * np.sqrt(np.maximum(0, 1 - y**2))
    return np.stack([x_b, y, np.sqrt(np.maximum(0, 1 - x_b**2 - y**2))], axis=-1)


def frame(psi, A):
    """(42)–(44), e2 by the first form of (43)."""
    e3 = unit(A @ psi)
    cross = np.cross(A @ psi, A @ NORMAL)
    # At normal incidence any perpendicular will do; this one is the library's.
    e2 = unit(cross) if norm(cross) > 1e-12 else samplers.second_tangent(e3)
    return np.stack([np.cross(e2, e3), e2, e3])


def lune_point(disk, psi, A):
    """(45)"""
    return crescent(disk, compression(psi, A)) @ frame(psi, A)


def micronormal(p, A):
    """(46)"""
    return unit(p @ A)


DISK = Batched(square_to_disk, (1,))


def disk_points(n=2000):
    return DISK(samplers.lattice(n))


@check(
    "(34)", "a = 2ξ₁ - 1 and b = 2ξ₂ - 1 cover the square: the disk's points are uniform", "monte_carlo", DISK,
    tolerance=FALSE_ALARM, mutant=("a = ξ₁", lambda f: lambda u: f(np.c_[(1 + u[:, 0]) / 2, u[:, 1]])),
)  # fmt: skip
@check(
    "(35)", "a = 2ξ₁ - 1 and b = 2ξ₂ - 1 cover the square: the disk's points are uniform, b", "monte_carlo", DISK,
    tolerance=FALSE_ALARM, mutant=("b = ξ₂", lambda f: lambda u: f(np.c_[u[:, 0], (1 + u[:, 1]) / 2])),
)  # fmt: skip
def disk_is_uniform(to_disk, stream):
    x, y = to_disk(stream.uniform(stream.samples, 2)).T
    return uniform_square(np.stack([np.arctan2(y, x) / (2 * np.pi) % 1, x**2 + y**2], axis=-1)[None])


@check(
    "(36)", "the concentric map keeps areas: |∂(x, y)/∂ξ| = π", "autodiff", DISK, tolerance=1e-11,
    also=["(37)"], mutant=("polar radius ξ", lambda f: Batched(lambda u: u[0] * jnp.stack([jnp.cos(6 * u[1]), jnp.sin(6 * u[1])]), (1,))),
)  # fmt: skip
def disk_keeps_area(to_disk):
    return relative(to_disk.area_ratio(0)(samplers.lattice(1000)), np.pi)


@check(
    "(37)", "the concentric map takes squares about the centre to circles: x² + y² = max(a², b²)", "exact", DISK,
    tolerance=ROUNDING, also=["(36)"], mutant=("sine and cosine exchanged in y", lambda f: lambda u: f(u)[:, ::-1] * [1, 0] + f(u) * [0, 1]),
)  # fmt: skip
def disk_circles(to_disk):
    u = samplers.lattice(1000)
    return worst(np.sum(to_disk(u) ** 2, axis=-1) - np.max((2 * u - 1) ** 2, axis=-1))


@check(
    "(38)", "s = A_ℓ⊥(ψ, n)/A_e⊥(ψ)", "exact", [compression, "ellipsoid.lune_area", "ellipsoid.projected_area"],
    tolerance=ROUNDING, mutant=("cos² of half the sine", lambda f: lambda i, A: f(i, A) ** 2),
)  # fmt: skip
def compression_is_ratio_of_areas(s, lune_area, projected_area):
    ratios = [lune_area(i, NORMAL, A, 1.0) / projected_area(i, A, 1.0) for i, A in POSITIVE]
    return worst(np.array([s(i, A) for i, A in POSITIVE]) - ratios)


def moved(disk, s):
    """x_b and y_b of (39), (40)."""
    return crescent(disk, s)[:, :2]


@check(
    "(39)", "the crescent has s times the disk's area and lies between its two arcs", "exact", moved, tolerance=1e-9,
    mutant=("moved by s", lambda f: lambda d, s: f(d, s) + [[2 * s - 1, 0]] * np.sqrt(1 - d[:, 1:] ** 2)),
)  # fmt: skip
@check(
    "(40)", "y_b = y_a: the skew slides rows of the disk along themselves", "exact", moved, tolerance=1e-9,
    mutant=("y compressed too", lambda f: lambda d, s: f(d, s) * [1, s]),
)  # fmt: skip
def compressed_disk(move):
    """Ends of a row: x = -√(1-y²) goes to (1 - 2s)√(1-y²), the lune's terminator; x = +√(1-y²) stays."""
    y = np.linspace(-0.99, 0.99, 41)
    half = np.sqrt(1 - y**2)
    errors = []
    for s in (0.1, 0.5, 0.9):
        left, right = move(np.stack([-half, y], -1), s), move(np.stack([half, y], -1), s)
        errors += [worst(left - np.stack([(1 - 2 * s) * half, y], -1)), worst(right - np.stack([half, y], -1))]
        h = 1e-4
        x = np.zeros_like(y)
        width = (move(np.stack([x + h, y], -1), s) - move(np.stack([x - h, y], -1), s))[:, 0] / (2 * h)
        errors.append(worst(width - s))
    return max(errors)


@check(
    "(41)", "the point lies on the unit sphere, in front", "exact", crescent, tolerance=ROUNDING,
    mutant=("z_a of the disk's own point", lambda f: lambda d, s: np.c_[f(d, s)[:, :2], np.sqrt(1 - np.sum(d**2, -1))]),
)  # fmt: skip
def point_on_sphere(points):
    disk = disk_points()
    p = np.concatenate([points(disk, s) for s in (0.1, 0.5, 0.9)])
    return max(worst(norm(p) - 1), worst(np.minimum(0, p[:, 2])))


@check(
    "(42)", "e3 is along A ψ, the rows are orthonormal", "exact", frame, tolerance=ROUNDING,
    mutant=("A⁻ᵀψ", lambda f: lambda i, A: f(unit(np.linalg.inv(A.T @ A) @ i), A)),
)  # fmt: skip
@check(
    "(44)", "e1 = e2 × e3 is the perpendicular of e3 nearest to A n", "exact", frame, tolerance=ROUNDING,
    mutant=("e3 × e2", lambda f: lambda i, A: f(i, A) * [[-1], [1], [1]]),
)  # fmt: skip
def frame_is_aligned(rows):
    errors = []
    for i, A in POSITIVE[1:]:
        e, pole = rows(i, A), unit(A @ NORMAL)
        e3 = unit(A @ i)
        errors += [worst(e @ e.T - np.eye(3)), worst(e[2] - e3), worst(e[0] - unit(pole - (pole @ e3) * e3))]
    return max(errors)


@check(
    "(43)", "A ψ × A n is along A⁻ᵀ(ψ × n), for |A| > 0", "exact", lambda i, A: unit(np.linalg.solve(A.T, np.cross(i, NORMAL))),
    tolerance=ROUNDING, mutant=("Aᵀ(ψ × n)", lambda f: lambda i, A: unit(A.T @ np.cross(i, NORMAL))),
)  # fmt: skip
def second_axis(by_inverse):
    return max(worst(by_inverse(i, A) - frame(i, A)[1]) for i, A in POSITIVE[1:])


@check(
    "(45)", "p_c lies on the spherical lune: p_c·A ψ > 0, p_c·A n > 0, unit", "exact", lune_point, tolerance=ROUNDING,
    mutant=("e1 and e2 exchanged", lambda f: lambda d, i, A: crescent(d, compression(i, A)) @ frame(i, A)[[1, 0, 2]]),
)  # fmt: skip
def point_on_lune(point):
    errors = []
    for i, A in POSITIVE:
        p = point(disk_points(), i, A)
        errors += [
            worst(norm(p) - 1),
            worst(np.minimum(0, p @ unit(A @ i))),
            worst(np.minimum(0, p @ unit(A @ NORMAL))),
        ]
    return max(errors)


@check(
    "(46)", "the procedure (34)–(46), as printed, draws the samples of sampling.lune", "exact",
    [micronormal, "sampling.lune.sample"], tolerance=1e-9,
    mutant=("normal of A p_c", lambda f: lambda p, A: f(p @ A.T, A)),
)  # fmt: skip
def procedure(normal, sample):
    """Tolerance: 1 - x² - y² of (41) cancels at the rim."""
    u = samplers.lattice(1000)
    return max(worst(normal(lune_point(DISK(u), i, A), A) - sample(u, i, A)) for i, A in POSITIVE)


@check(
    "(47)", "ω = 2(ψ·m)m - ψ mirrors ψ: unit, and m is the half vector of both", "exact",
    ["geometry.reflect", "sampling.lune.sample"], tolerance=ROUNDING,
    mutant=("- ψ lost", lambda f: lambda w, m: f(w, m) + w),
)  # fmt: skip
def reflected(reflect, sample):
    errors = []
    for i, A in POSITIVE:
        m = sample(samplers.lattice(500), i, A)
        m = m[m @ i > 1e-3]
        o = reflect(np.broadcast_to(i, m.shape), m)
        errors += [worst(norm(o) - 1), worst(unit(i + o) - m)]
    return max(errors)


@check(
    "(49)", "the mean of the weight f_r |ω·n|/p_o is the albedo ∫ f_r |ω·n| dω", "monte_carlo",
    ["sampling.lune.pdf", "sampling.lune.sample", "bsdf.brdf", "ndf.ellipsoid", "masking.g1_ellipsoid", "jacobian.reflection"],
    tolerance=FALSE_ALARM, also=["(4)"], mutant=("p_h for p_o: Jacobian lost", lambda p: lambda m, i, A: p(m, i, A) * 4 * dot(i, m)),
)  # fmt: skip
def mean_weight(pdf, sample, brdf, D, g1, jacobian, stream):
    from ggxref.verify.heitz2014_bsdf import hemispherical

    A, i = cases.SHAPES[4], cases.UP[1:3]

    def f(i, o):
        m = unit(i + o)
        return brdf(i, o, D(m, A), g1(i, m, A) * g1(o, m, A), 1.0) * np.abs(o[:, 2])

    values = []
    for psi in i:
        m = sample(stream.uniform(stream.samples, 2), psi, A)
        o = 2 * dot(psi, m)[:, None] * m - psi
        weight = f(np.broadcast_to(psi, o.shape), o) / (pdf(m, psi, A) * jacobian(o, m))
        values.append(np.where(o[:, 2] > 0, weight, 0))
    return unlikely_mean(np.array(values), hemispherical(f, i))


@check(
    "§2.3", "the spherical lune's projected area π/2 (1 + cos θ) is a half disk and a half ellipse", "quadrature",
    lambda cos: np.pi / 2 * (1 + cos), tolerance=1e-12, mutant=("π/2 (1 + cos²θ)", lambda f: lambda cos: f(cos**2)),
)  # fmt: skip
def silhouette_area(area):
    """Row by row of (39): from (1 - 2s)√(1-y²) to √(1-y²), with y = sin t."""
    t, weight = np.polynomial.legendre.leggauss(40)
    y = np.pi / 2 * t
    errors = []
    for cos in (-0.7, 0.0, 0.6, 1.0):
        s = (1 + cos) / 2
        errors.append(np.pi / 2 * np.sum(weight * 2 * s * np.cos(y) ** 2) - area(cos))
    return worst(errors)
