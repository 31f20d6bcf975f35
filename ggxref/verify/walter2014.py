"""Walter et al. 2014, §1 to §3, §5: the ellipsoid NDF, its areas, its masking, its relatives."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from ggxref.verify import cases, engine
from ggxref.verify.batch import Batched
from ggxref.verify.charts import NORMAL, dot, front, integrals, lune, surface, unit
from ggxref.verify.engine import relative, worst

PAPER = "walter2014"
check = partial(engine.check, PAPER)

# As heitz2014's: sums of 1600 terms, exact in these coordinates; measured worst 5e-14.
QUADRATURE = 1e-12
# Pointwise identities through a matrix whose condition number reaches 100.
ROUNDING = 1e-12

ROTATION = cases.rotation(0, 0.4) @ cases.rotation(2, 1.3) @ cases.rotation(1, -0.8)


def norm(v):
    return np.linalg.norm(v, axis=-1)


def times(A, v):
    return np.einsum("...ij,...j->...i", A, v)


def skew_of(A):
    """‖A n‖ for a stack of shapes."""
    return norm(A[..., 2])


@check(
    "(1)", "∫ (m·n) D dm = 1", "quadrature", "ndf.ellipsoid", tolerance=QUADRATURE,
    mutant=("without ‖A n‖", lambda D: lambda m, A: D(m, A) * skew_of(A)),
)  # fmt: skip
def normals_are_normalised(D):
    rules = [lune(NORMAL, NORMAL, A) for A in cases.SHAPES]
    return relative(integrals(lambda m, A: D(m, A) * m[:, 2], rules, cases.SHAPES), 1)


@check(
    "(1)", "c A and Q A are the same distribution; 0 below the horizon", "exact", "ndf.ellipsoid", tolerance=ROUNDING,
    mutant=("without ‖A n‖", lambda D: lambda m, A: D(m, A) * skew_of(A)),
)  # fmt: skip
def normals_are_invariant(D):
    m, A = cases.pairs(cases.sphere(400), cases.SHAPES)
    up = m[:, 2] > 0
    scaled, turned = D(m, -2.5 * A), D(m, ROTATION @ A)
    value = D(m, A)
    return max(relative(scaled[up], value[up]), relative(turned[up], value[up]), worst(value[~up]))


@check(
    "(2)", "A = diag(α_x, α_y, 1) is anisotropic GGX: D, G1, visible normals", "exact",
    ["ndf.ellipsoid", "ndf.ggx", "masking.g1_ellipsoid", "masking.g1_ggx", "sampling.lune.pdf", "sampling.slope_ggx.pdf"],
    tolerance=ROUNDING, mutant=("A transposed and inverted", lambda D: lambda m, A: D(m, np.linalg.inv(A))),
)  # fmt: skip
def diagonal_is_ggx(D, D_ggx, g1, g1_ggx, pdf, pdf_ggx):
    i, m, alpha = cases.triples(cases.UP, cases.hemisphere(200), cases.ALPHAS)
    A = np.zeros((len(alpha), 3, 3))
    A[:, 0, 0], A[:, 1, 1], A[:, 2, 2] = alpha[:, 0], alpha[:, 1], 1
    keep = dot(i, m) > 1e-3
    i, m, alpha, A = i[keep], m[keep], alpha[keep], A[keep]
    return max(
        relative(D(m, A), D_ggx(m, alpha)),
        relative(g1(i, m, A), g1_ggx(i, m, alpha)),
        relative(pdf(m, i, A), pdf_ggx(m, i, alpha)),
    )


@check(
    "(3)", "A = S R_x R_y R_z, RᵀR = I, |A| = α_x α_y; without θ_x, θ_y A n = n", "exact", "ellipsoid.shape_matrix",
    tolerance=1e-14, mutant=("R_z R_y R_x", lambda f: lambda a, t: f(a, -t)),
)  # fmt: skip
def shape_matrices(shape_matrix):
    alpha, angles = cases.pairs(cases.ALPHAS, np.array([[0.3, -0.2, 0.9], [-1.0, 0.4, 2.0], [0.0, 0.0, 0.7]]))
    A = shape_matrix(alpha, angles)
    expected = np.array([cases.shape(a, t) for a, t in zip(alpha, angles, strict=True)])
    R = A / np.stack([alpha[:, 0], alpha[:, 1], np.ones(len(alpha))], axis=-1)[..., None]
    orthogonal = np.swapaxes(R, -1, -2) @ R - np.eye(3)
    upright = times(A[2::3], NORMAL) - NORMAL
    return max(worst(A - expected), worst(orthogonal), worst(np.linalg.det(R) - 1), worst(upright))


@check(
    "(4)", "f_r = D G F/(4|ψ·n||ω·n|) is reciprocal with G = G1 G1 of (5)", "exact",
    ["bsdf.brdf", "ndf.ellipsoid", "masking.g1_ellipsoid", "masking.g2_separable", "fresnel.schlick"],
    tolerance=ROUNDING, mutant=("cos² of one direction", lambda f: lambda i, o, *v: f(i, o, *v) * o[:, 2] / i[:, 2]),
)  # fmt: skip
def brdf_is_reciprocal(brdf, D, g1, g2, fresnel):
    i, o, A = cases.triples(cases.UP, cases.hemisphere(100), cases.SHAPES)
    m = unit(i + o)

    def f(i, o):
        return brdf(i, o, D(m, A), g2(g1(i, m, A), g1(o, m, A)), fresnel(dot(i, m), 0.04))

    return relative(f(i, o), f(o, i))


def visible_area(D):
    """∫ max(0, u·m) D dm for every direction above the horizon and shape."""
    u, A = cases.pairs(cases.ALL, cases.SHAPES)
    rules = [lune(x, NORMAL, y) for x, y in zip(u, A, strict=True)]
    return u, A, integrals(lambda m, u, A: front(u, m) * D(m, A), rules, u, A)


@check(
    "(6)", "G1 = min(1, (u·n) / ∫ ⟨u·m⟩ D dm)", "quadrature", ["masking.g1_ellipsoid", "ndf.ellipsoid"],
    tolerance=QUADRATURE, mutant=("‖A n‖ for ‖A n‖²", lambda g1: lambda u, m, A: g1(u, m, A) / skew_of(A)),
)  # fmt: skip
def masking_is_its_integral(g1, D):
    u, A, area = visible_area(D)
    keep = u[:, 2] > 0
    u, A, area = u[keep], A[keep], area[keep]
    return relative(g1(u, u, A), np.minimum(1, u[:, 2] / area))


@check(
    "(7)", "from below: G1(ω, m) = G1(sgn(ω·n) ω, m)", "exact", "masking.g1_ellipsoid", tolerance=ROUNDING,
    mutant=("the lune of ω itself", lambda g1: lambda w, m, A: unflipped_g1(w, m, A)),
)  # fmt: skip
def masking_from_below(g1):
    w, m, A = cases.triples(cases.sphere(60), cases.hemisphere(60), cases.SHAPES)
    return worst(g1(w, m, A) - g1(w * np.sign(w[:, 2:]), m, A))


def unflipped_g1(w, m, A):
    Aw, An = times(A, w), A[..., 2]
    value = 2 * norm(An) ** 2 * np.abs(w[:, 2]) / (norm(Aw) * norm(An) + dot(Aw, An))
    return np.where(dot(w, m) * w[:, 2] > 0, np.minimum(1, value), 0)


def point_of(m, A, size):
    """The point of the ellipsoid |A p| = C_e whose normal is m: A⁻¹A⁻ᵀm C_e/‖A⁻ᵀm‖."""
    inverse = jnp.linalg.inv(A)
    q = inverse.T @ m
    return inverse @ q * size / jnp.sqrt(q @ q)


def implicit(p, A, size):
    return p @ A.T @ A @ p - size**2


def goldman(m, A, size):
    """(10): ∇fᵀ adj(H) ∇f / ‖∇f‖⁴ with both derivatives of (8) taken by machine."""
    p = point_of(m, A, size)
    gradient, H = jax.grad(implicit)(p, A, size), jax.hessian(implicit)(p, A, size)
    adjugate = jnp.stack([jnp.cross(H[1], H[2]), jnp.cross(H[2], H[0]), jnp.cross(H[0], H[1])], axis=1)
    return gradient @ adjugate @ gradient / (gradient @ gradient) ** 2


RANKS = (1, 2, 0)


@check(
    "(9)", "D = (dA/dm) / A_e⊥(n), by differentiating the point that has the normal m", "autodiff",
    ["ndf.ellipsoid", Batched(point_of, RANKS), "ellipsoid.projected_area"], tolerance=1e-10,
    mutant=("without ‖A n‖", lambda D: lambda m, A: D(m, A) * skew_of(A)),
)  # fmt: skip
def normals_are_surface_area(D, point, projected_area):
    m, A = cases.pairs(cases.hemisphere(100), cases.SHAPES)
    return relative(point.area_ratio(0)(m, A, 1.3) / projected_area(NORMAL, A, 1.3), D(m, A))


@check(
    "(10)", "curvature against Goldman's formula on the derivatives of (8), and against the Gauss map", "autodiff",
    ["ellipsoid.gaussian_curvature", Batched(goldman, RANKS), Batched(point_of, RANKS)], tolerance=1e-10,
    mutant=("‖A⁻ᵀm‖² for its square", lambda K: lambda m, A, C: K(m, A, C) / norm(times(inverse_transpose(A), m)) ** 2),
)  # fmt: skip
def curvature(gaussian_curvature, implicit_curvature, point):
    m, A = cases.pairs(cases.sphere(100), cases.SHAPES)
    K = gaussian_curvature(m, A, 1.3)
    return max(relative(K, implicit_curvature(m, A, 1.3)), relative(K * point.area_ratio(0)(m, A, 1.3), 1))


def inverse_transpose(A):
    return np.swapaxes(np.linalg.inv(A), -1, -2)


def surface_areas(u, v, A):
    """∫ (u·m) dA over the part of the unit ellipsoid with m·u > 0 and m·v > 0."""
    rules = [surface(x, y, B) for x, y, B in zip(u, v, A, strict=True)]
    return integrals(lambda m, u: dot(u, m), rules, u)


@check(
    "(26)", "projected area π C_e² ‖A u‖/|A| against the surface integral (21)", "quadrature",
    "ellipsoid.projected_area", tolerance=QUADRATURE,
    also=["(21)"], mutant=("‖A⁻¹u‖", lambda f: lambda u, A, C: f(u, np.linalg.inv(A), C)),
)  # fmt: skip
def projected_areas(projected_area):
    u, A = cases.pairs(cases.ALL, cases.SHAPES)
    return relative(projected_area(u, A, 1.3), 1.3**2 * surface_areas(u, u, A))


@check(
    "(28)", "lune area π C_e² (‖Au‖‖Av‖ + Au·Av)/(2|A|‖Av‖) against the surface integral (27)", "quadrature",
    "ellipsoid.lune_area", tolerance=QUADRATURE, also=["(27)"], mutant=("u and v exchanged", lambda f: lambda u, v, A, C: f(v, u, A, C)),
)  # fmt: skip
def lune_areas(lune_area):
    u, v, A = cases.triples(cases.ALL, cases.UP[:3], cases.SHAPES)
    return relative(lune_area(u, v, A, 1.3), 1.3**2 * surface_areas(u, v, A))


@check(
    "(29)", "C_e = √(|A|/(π‖A n‖)) gives A_e⊥(n) = 1", "exact", ["ellipsoid.size", "ellipsoid.projected_area"],
    tolerance=1e-14, mutant=("without ‖A n‖", lambda f: lambda A: f(A) * np.sqrt(skew_of(A))),
)  # fmt: skip
def unit_size(size, projected_area):
    return relative(projected_area(NORMAL, cases.SHAPES, size(cases.SHAPES)), 1)


@check(
    "(31)", "A_ℓ⊥(u, n) G1(u) ≤ A_e⊥(n) |u·n|, with equality where G1 < 1", "exact",
    ["masking.g1_ellipsoid", "ellipsoid.lune_area", "ellipsoid.projected_area"], tolerance=ROUNDING,
    mutant=("no minimum with 1", lambda g1: lambda w, m, A: skewed_g1(w, A)),
)  # fmt: skip
def visible_area_fits(g1, lune_area, projected_area):
    """Where the minimum acts G1 is 1, and the visible area is less than the surface's."""
    u, A = cases.pairs(cases.hemisphere(300), cases.SHAPES)
    G, whole = g1(u, u, A), projected_area(NORMAL, A, 1.0) * u[:, 2]
    visible = lune_area(u, NORMAL, A, 1.0) * G
    return max(
        worst(np.maximum(0, visible / whole - 1)), worst((visible / whole - 1)[G < 1]), worst(np.maximum(0, G - 1))
    )


def skewed_g1(w, A):
    Aw, An = times(A, w), A[..., 2]
    return 2 * norm(An) ** 2 * w[:, 2] / (norm(Aw) * norm(An) + dot(Aw, An))


@check(
    "(32)", "G1 = min(1, A_e⊥(n)|u·n| / A_ℓ⊥(u, n)) χ₊(u·m)", "exact",
    ["masking.g1_ellipsoid", "ellipsoid.lune_area", "ellipsoid.projected_area"], tolerance=ROUNDING,
    mutant=("without χ₊", lambda g1: lambda w, m, A: np.minimum(1, skewed_g1(w, A))),
)  # fmt: skip
def masking_is_ratio_of_areas(g1, lune_area, projected_area):
    u, m, A = cases.triples(cases.UP, cases.hemisphere(100), cases.SHAPES)
    ratio = projected_area(NORMAL, A, 0.7) * u[:, 2] / lune_area(u, NORMAL, A, 0.7)
    return worst(g1(u, m, A) - np.where(dot(u, m) > 0, np.minimum(1, ratio), 0))


@check(
    "§5.1", "the half ellipsoid's average normal is AᵀA n", "quadrature", ["ellipsoid.mean_normal", "ndf.ellipsoid"],
    tolerance=QUADRATURE, mutant=("A Aᵀ n", lambda f: lambda A: f(np.swapaxes(A, -1, -2))),
)  # fmt: skip
def average_normal(mean_normal, D):
    total = np.stack(
        [
            integrals(
                lambda m, A, k=k: m[:, k] * D(m, A), [lune(NORMAL, NORMAL, A) for A in cases.SHAPES], cases.SHAPES
            )
            for k in range(3)
        ],
        axis=-1,
    )
    return worst(mean_normal(cases.SHAPES) - unit(total))


@check(
    "§5.2", "S = AᵀA: the SGGX density over ‖A n‖ is D, and √(uᵀSu)/‖A n‖ its projected area", "exact",
    ["ellipsoid.sggx", "ndf.ellipsoid", "ellipsoid.projected_area"], tolerance=1e-11,
    mutant=("A Aᵀ", lambda f: lambda A: f(np.swapaxes(A, -1, -2))),
)  # fmt: skip
def sggx_relation(sggx, D, projected_area):
    u, m, A = cases.triples(cases.ALL, cases.hemisphere(60), cases.SHAPES)
    S = sggx(A)
    microflakes = 1 / (np.pi * np.sqrt(np.linalg.det(S)) * dot(m, np.linalg.solve(S, m[..., None])[..., 0]) ** 2)
    shadow = np.sqrt(dot(u, times(S, u)))
    area = projected_area(u, A, 1.0) / projected_area(NORMAL, A, 1.0)
    return max(relative(D(m, A), microflakes / skew_of(A)), relative(area, shadow / skew_of(A)))
