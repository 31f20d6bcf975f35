"""Walter et al. 2014, §1 to §4 by differentiation: curvature, normals and areas of the ellipsoid from its surface alone."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from ggxref.verify import cases, engine, samplers
from ggxref.verify.batch import Batched
from ggxref.verify.charts import NORMAL, dot, unit
from ggxref.verify.engine import relative, worst
from ggxref.verify.walter2014 import PAPER, RANKS, implicit, norm, point_of, times

check = partial(engine.check, PAPER)

# Through AᵀA, whose condition number reaches 10⁴, and its inverse.
TOLERANCE = 1e-9
SIZE = 1.3

POINT = Batched(point_of, RANKS)
GRADIENT = Batched(jax.grad(implicit), RANKS)
HESSIAN = Batched(jax.hessian(implicit), RANKS)


def surface():
    """Shapes, micronormals, points of the ellipsoid, and there by machine: ∇f, its second derivatives, the curvature dm/dA."""
    m, A = cases.pairs(cases.sphere(60), cases.SHAPES)
    p = POINT(m, A, SIZE)
    return m, A, p, GRADIENT(p, A, SIZE), HESSIAN(p, A, SIZE), 1 / POINT.area_ratio(0)(m, A, SIZE)


def transposed(A):
    return np.swapaxes(A, -1, -2)


def normal_matrix(A):
    """AᵀA"""
    return transposed(A) @ A


def quadratic(v, M):
    return dot(v, times(M, v))


def hessian(A):
    """(12)"""
    return 2 * normal_matrix(A)


@check(
    "(8)", "f stays 0 where the point that has the normal m moves: its derivative there vanishes", "autodiff",
    Batched(point_of, RANKS), tolerance=TOLERANCE, mutant=("A⁻¹m", lambda f: lambda m, A, C: norm(times(A, m))[:, None] * f(m, A, C)),
)  # fmt: skip
def surface_is_implicit(point):
    m, A = cases.pairs(cases.sphere(60), cases.SHAPES)
    p = point(m, A, SIZE)
    along = np.einsum("ni,nij->nj", GRADIENT(p, A, SIZE), POINT.derivative(0)(m, A, SIZE))
    return max(worst(norm(times(A, p)) / SIZE - 1), worst(along))


def adjugate(H):
    """(11): |H| H⁻¹"""
    return np.linalg.det(H)[..., None, None] * np.linalg.inv(H)


DETERMINANT = Batched(jax.grad(jnp.linalg.det), (2,))


@check(
    "(11)", "adj(H) is the transposed derivative of the determinant (Jacobi)", "autodiff", adjugate, tolerance=TOLERANCE,
    mutant=("H⁻¹", lambda f: lambda H: np.linalg.inv(H)),
)  # fmt: skip
def adjugate_of_hessian(adj):
    H = hessian(cases.SHAPES)
    expected = transposed(DETERMINANT(H))
    return max(worst(a - e) / worst(e) for a, e in zip(adj(H), expected, strict=True))


@check(
    "(25)", "(M a) × (M b) = |M| M⁻ᵀ (a × b), with |M| M⁻ᵀ as the derivative of the determinant", "autodiff",
    lambda M: np.linalg.det(M)[:, None, None] * np.linalg.inv(transposed(M)), tolerance=TOLERANCE,
    mutant=("Mᵀ, as printed", lambda f: lambda M: np.linalg.det(M)[:, None, None] * transposed(M)),
)  # fmt: skip
def cross_product_of_images(cofactor):
    a, M = cases.pairs(cases.sphere(30), cases.SHAPES)
    b = a[:, [1, 2, 0]]
    images = np.cross(times(M, a), times(M, b))
    return max(worst(DETERMINANT(M) - cofactor(M)), worst(images - times(cofactor(M), np.cross(a, b))))


# Each step of the derivation with what it stands for, by machine: (m, p, A) to the form; ∇f, second derivatives and
# curvature to the value.
STEPS = {
    "(12)": ("H = 2 AᵀA is the second derivative of (8)", lambda m, p, A: hessian(A), lambda g, H, K: H),
    "(13)": ("∇f = 2 AᵀA p is the derivative of (8)", lambda m, p, A: times(hessian(A), p), lambda g, H, K: g),
    "(14)": (
        "|H| (Hp)ᵀH⁻¹(Hp)/‖Hp‖⁴ is the Gauss map's dm/dA",
        lambda m, p, A: _step(A, p) * quadratic(times(hessian(A), p), np.linalg.inv(hessian(A))) / norm(times(hessian(A), p)) ** 2,
        lambda g, H, K: K,
    ),
    "(15)": ("m is ∇f/‖∇f‖", lambda m, p, A: m, lambda g, H, K: unit(g)),
    "(16)": (
        "|H| mᵀH⁻¹m/‖Hp‖² is the Gauss map's dm/dA",
        lambda m, p, A: _step(A, p) * quadratic(m, np.linalg.inv(hessian(A))), lambda g, H, K: K,
    ),
    "(17)": (
        "2 C_e²/(mᵀH⁻¹m) is ‖∇f‖²", lambda m, p, A: 2 * SIZE**2 / quadratic(m, np.linalg.inv(hessian(A))),
        lambda g, H, K: dot(g, g),
    ),
    "(18)": (
        "|H| (mᵀH⁻¹m)²/(2 C_e²) is the Gauss map's dm/dA",
        lambda m, p, A: np.linalg.det(hessian(A)) * quadratic(m, np.linalg.inv(hessian(A))) ** 2 / (2 * SIZE**2),
        lambda g, H, K: K,
    ),
    "(22)": (
        "m = AᵀA p/‖AᵀA p‖ is ∇f/‖∇f‖", lambda m, p, A: unit(times(normal_matrix(A), p)), lambda g, H, K: unit(g),
    ),
}  # fmt: skip


def _step(A, p):
    """|H|/‖Hp‖²"""
    return np.linalg.det(hessian(A)) / norm(times(hessian(A), p)) ** 2


for _place, (_statement, _form, _expected) in STEPS.items():

    @check(
        _place, _statement, "autodiff", _form, tolerance=TOLERANCE, expected=_expected,
        mutant=("A Aᵀ for AᵀA", lambda f: lambda m, p, A: f(unit(m[:, [1, 0, 2]]), p, transposed(A))),
    )  # fmt: skip
    def step(form, expected):
        m, A, p, gradient, H, K = surface()
        got, value = form(m, p, A), expected(gradient, H, K)
        return worst(
            (got - value) / np.max(np.abs(value).reshape(len(value), -1), axis=-1).reshape(-1, *[1] * (value.ndim - 1))
        )


@check(
    "(19)", "‖A⁻ᵀm‖²/2 is mᵀH⁻¹m, and 8|A|² is |H|, with the second derivative by machine", "autodiff",
    lambda m, A: norm(times(np.linalg.inv(transposed(A)), m)) ** 2 / 2, tolerance=TOLERANCE,
    mutant=("A⁻¹m", lambda f: lambda m, A: f(m, transposed(A))),
)  # fmt: skip
def inverse_hessian(form):
    m, A, _, _, H, _ = surface()
    determinant = relative(np.linalg.det(H), 8 * np.linalg.det(A) ** 2)
    return max(determinant, relative(form(m, A), quadratic(m, np.linalg.inv(H))))


@check(
    "(20)", "|A|²‖A⁻ᵀm‖⁴/C_e² is the Gauss map's dm/dA", "autodiff", "ellipsoid.gaussian_curvature", tolerance=TOLERANCE,
    mutant=("|A| for |A|²", lambda f: lambda m, A, C: f(m, A, C) / np.abs(np.linalg.det(A))),
)  # fmt: skip
def curvature_by_normal(gaussian_curvature):
    m, A, *_, K = surface()
    return relative(gaussian_curvature(m, A, SIZE), K)


@check(
    "(23)", "∇f is perpendicular to u where (AᵀA u)·p = 0", "autodiff", normal_matrix, tolerance=TOLERANCE,
    mutant=("A Aᵀ", lambda f: lambda A: f(transposed(A))),
)  # fmt: skip
def silhouette(plane):
    u, A = cases.pairs(cases.ALL, cases.SHAPES)
    p = np.cross(times(plane(A), u), [0.3, 0.5, 0.8])
    p = SIZE * p / norm(times(A, p))[:, None]
    return worst(dot(u, unit(GRADIENT(p, A, SIZE))))


@check(
    "(24)", "with p_o = A p, ∇f = Aᵀ ∇(‖p_o‖² - C_e²): the image is the sphere, point by point", "autodiff",
    lambda A, p: times(A, p), tolerance=TOLERANCE, mutant=("Aᵀp", lambda f: lambda A, p: f(transposed(A), p)),
)  # fmt: skip
def sphere_space(image):
    _, A, p, gradient, *_ = surface()
    return max(worst(norm(image(A, p)) / SIZE - 1), worst(gradient - times(transposed(A), 2 * image(A, p))))


@check(
    "(30)", "C_e cancels: the logarithmic derivatives of K_g, of A_e⊥ and of A_ℓ⊥ with C_e are -2, 2 and 2", "autodiff",
    ["ellipsoid.gaussian_curvature", "ellipsoid.projected_area", "ellipsoid.lune_area"], tolerance=1e-12,
    mutant=("C_e for C_e²", lambda f: Batched(lambda m, A, C: f.function(m, A, C) * C, RANKS)),
)  # fmt: skip
def size_cancels(curvature, projected_area, lune_area):
    u, A = cases.pairs(cases.UP, cases.SHAPES)
    rates = [
        curvature.derivative(2)(u, A, SIZE) / curvature(u, A, SIZE) + 2 / SIZE,
        projected_area.derivative(2)(u, A, SIZE) / projected_area(u, A, SIZE) - 2 / SIZE,
        lune_area.derivative(3)(u, NORMAL, A, SIZE) / lune_area(u, NORMAL, A, SIZE) - 2 / SIZE,
    ]
    return max(map(worst, rates))


# The rate at which a rotation about an axis moves a vector: ω × v.
TURNS = -np.cross(np.eye(3)[:, None], np.eye(3)[None])


@check(
    "(3)", "∂A/∂θ turns about x before R_y R_z and about z after R_x R_y, by differentiating the angles", "autodiff",
    "ellipsoid.shape_matrix", tolerance=1e-12,
    mutant=("S after R", lambda f: Batched(lambda a, t: f.function(a, t).T, (1, 1))),
)  # fmt: skip
def turns(shape_matrix):
    """∂A/∂θ_x = S J_x S⁻¹A and ∂A/∂θ_z = A J_z."""
    alpha, angles = cases.pairs(cases.ALPHAS[2:], np.array([[0.3, -0.2, 0.9], [-1.0, 0.4, 2.0]]))
    A, rate = shape_matrix(alpha, angles), shape_matrix.derivative(1)(alpha, angles)
    S = np.eye(3) * np.c_[alpha, np.ones(len(alpha))][:, None]
    first = S @ TURNS[0] @ np.linalg.inv(S) @ A
    return max(worst(rate[..., 0] - first), worst(rate[..., 2] - A @ TURNS[2]))


@check(
    "(48)", "p_o ‖∂ω/∂m‖ ‖∂m/∂ξ‖ = 1: the density of the map ξ → ω, by differentiating both steps", "autodiff",
    ["sampling.lune.pdf", "sampling.lune.sample", "jacobian.reflection", "geometry.reflect"], tolerance=1e-7,
    shapes=samplers.ELLIPSOIDS, mutant=("Jacobian lost", lambda p: lambda m, i, A: p(m, i, A) * 4 * dot(i, m)),
)  # fmt: skip
@engine.check(
    "dupuy2023", "(20)", "PDF ‖∂ω/∂m‖ ‖∂m/∂u‖ = 1: the density of the map u → ω, by differentiating both steps", "autodiff",
    ["sampling.spherical_cap.pdf", "sampling.spherical_cap.sample", "jacobian.reflection", "geometry.reflect"], tolerance=1e-7,
    shapes=samplers.VISIBLE, mutant=("Jacobian lost", lambda p: lambda m, i, a: p(m, i, a) * 4 * dot(i, m)),
)  # fmt: skip
def density_of_reflections(pdf, sample, jacobian, reflect, shapes):
    """Tolerance: the mirror's derivative loses digits where wi·m is small."""
    u, i, shape = samplers.on_lattice(shapes, 300)
    m = sample(u, i, shape)
    density = pdf(m, i, shape) * jacobian(reflect(i, m), m)
    return relative(density * reflect.area_ratio(1)(i, m) * sample.area_ratio(0)(u, i, shape), 1)
