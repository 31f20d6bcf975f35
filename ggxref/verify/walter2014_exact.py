"""Walter et al. 2014 in ball arithmetic, at exact inputs: every step from the implicit surface to D, (1)–(20)."""

from functools import partial

from flint import arb

from ggxref.oracle import integrate
from ggxref.oracle.linalg import N, determinant, inverse_transpose, product, transpose
from ggxref.oracle.linalg import negative as minus
from ggxref.verify import identities
from ggxref.verify.identities import (
    ALPHAS,
    BITS,
    SHAPES,
    add,
    apply,
    area,
    cross,
    directions,
    dot,
    exact,
    fronts,
    norm,
    normalise,
    scale,
    tangents,
    unit_derivative,
)

PAPER = "walter2014"
identity = partial(identities.identity, PAPER)
certified = partial(identities.identity, PAPER, method="certified")

SIZE = arb(0.75)
# A rotation with rational entries, columns (2, 1, 2)/3 and its kin.
TURN = ((2, -1, 2), (2, 2, -1), (-1, 2, 2))


def shapes():
    return [exact(A) for A in SHAPES]


def turned(A):
    """Q A with Q orthogonal."""
    Q = exact(TURN)
    return tuple(scale(arb(1) / 3, row) for row in product(Q, A))


def times(c, A):
    return tuple(scale(c, row) for row in A)


def hessian(A):
    """(12): 2 AᵀA."""
    return times(arb(2), product(transpose(A), A))


def adjugate(H):
    """The transposed cofactors, whether |H| is 0 or not."""
    a, b, c = H
    return transpose((cross(b, c), cross(c, a), cross(a, b)))


def quadratic(v, M):
    return dot(v, apply(M, v))


def inverse(M):
    return transpose(inverse_transpose(M))


def points():
    """Points of the ellipsoid ‖A p‖ = C_e, as images of points of the sphere, with the shape."""
    return [(scale(SIZE, apply(inverse(A), s)), A) for A in shapes() for s in directions()]


@certified(
    "(1)", "∫ (m·n) D dm = 1, enclosed", lambda A: integrate.projected_area_ellipsoid(A, BITS),
    mutant=("‖A n‖ lost", lambda f: lambda A: f(A) * norm(apply(exact(A), N))),
)  # fmt: skip
def normals_are_normalised(total):
    for A in SHAPES:
        yield total(A), 1


@identity(
    "(1)", "c A and Q A are the same distribution", "oracle.ndf.ellipsoid",
    mutant=("‖A n‖ lost", lambda f: lambda m, A: f(m, A) * norm(apply(A, N))),
)  # fmt: skip
def normals_are_invariant(D):
    for A in shapes():
        for m in directions():
            yield (D(m, times(arb(-1.5), A)), D(m, turned(A))), (D(m, A), D(m, A))


def diagonal(alpha):
    a, b = exact(alpha)
    return ((a, arb(0), arb(0)), (arb(0), b, arb(0)), N)


@identity(
    "(2)", "A = diag(α_x, α_y, 1) is GGX: D and G1", [
        "oracle.ndf.ellipsoid", "oracle.ndf.ggx", "oracle.masking.g1_ellipsoid", "oracle.masking.g1_ggx"],
    mutant=("axes swapped", lambda f: lambda m, A: f(m, (A[1][1:2] + A[0][1:], A[1][:1] + A[0][:1] + A[1][2:], A[2]))),
)  # fmt: skip
def diagonal_is_ggx(D, D_ggx, g1, g1_ggx):
    for alpha in ALPHAS[1:]:
        for i, m in fronts():
            A = diagonal(alpha)
            yield D(m, A), D_ggx(m, exact(alpha))
            yield g1(i, m, A), g1_ggx(i, m, exact(alpha))


@identity(
    "(3)", "R_x R_y R_z is orthogonal and S R of it has |A| = α_x α_y", "oracle.ellipsoid.shape_matrix",
    mutant=("Sᵀ R: columns stretched", lambda f: lambda a, t: transpose(f(a, t))),
)  # fmt: skip
def shape_matrices(shape_matrix):
    for ax, ay in map(exact, ALPHAS[1:]):
        A = shape_matrix((ax, ay), exact((0.25, -0.5, 1.125)))
        R = (scale(1 / ax, A[0]), scale(1 / ay, A[1]), A[2])
        yield product(transpose(R), R), ((1, 0, 0), (0, 1, 0), (0, 0, 1))
        yield determinant(A), ax * ay


@identity(
    "(5)", "G = G1 G1 is symmetric and at most either", ["oracle.masking.g2_separable", "oracle.masking.g1_ellipsoid"],
    mutant=("G1 of ψ twice", lambda f: lambda a, b: a * a),
)  # fmt: skip
def separable(g2, g1):
    for A in shapes():
        for (i, m), o in zip(fronts(), reversed(directions()), strict=False):
            a, b = g1(i, m, A), g1(o, m, A)
            yield g2(a, b), g2(b, a)
            yield (g2(a, b).max(a), g2(a, b).max(b)), (a, b)


@identity(
    "(8)", "f(p) = pᵀAᵀA p - C_e² vanishes on the image A⁻¹s C_e of the unit sphere, and is ‖A p‖² - C_e²",
    lambda p, A: quadratic(p, product(transpose(A), A)) - SIZE**2,
    mutant=("A Aᵀ", lambda f: lambda p, A: f(p, transpose(A))),
)  # fmt: skip
def implicit_surface(f):
    for p, A in points():
        yield f(p, A), 0
        q = add(p, exact((0.25, 0.5, -0.125)))
        yield f(q, A), dot(apply(A, q), apply(A, q)) - SIZE**2


@identity(
    "(9)", "D = dA/dm / A_e⊥(n): the area that ∂p/∂m spans, by (15) p = C_e A⁻¹A⁻ᵀm/‖A⁻ᵀm‖",
    ["oracle.ndf.ellipsoid", "oracle.ellipsoid.projected_area"],
    mutant=("‖A n‖ lost", lambda f: lambda m, A: f(m, A) * norm(apply(A, N))),
)  # fmt: skip
def normals_are_surface_area(D, projected_area):
    for A in shapes():
        B, back = inverse_transpose(A), inverse(A)
        for m in directions():
            moved = [scale(SIZE, apply(back, unit_derivative(apply(B, m), apply(B, t)))) for t in tangents(m)]
            yield D(m, A), area(*moved) / projected_area(N, A, SIZE)


def goldman(p, A):
    """(10) with (11)–(13)."""
    gradient = apply(hessian(A), p)
    return quadratic(gradient, adjugate(hessian(A))) / norm(gradient) ** 4


def curvature(m, A):
    """(20)"""
    return determinant(A) ** 2 * norm(apply(inverse_transpose(A), m)) ** 4 / SIZE**2


def normal_of(p, A):
    """(15)"""
    return normalise(apply(hessian(A), p))


@identity(
    "(10)", "K_g = ∇fᵀ adj(H) ∇f/‖∇f‖⁴ is the Gauss map's ratio: the area that ∂m/∂p spans over ∂p's", goldman,
    mutant=("‖∇f‖²", lambda f: lambda p, A: f(p, A) * norm(apply(hessian(A), p)) ** 2),
)  # fmt: skip
def gauss_map(K):
    for p, A in points():
        H, m = hessian(A), normal_of(p, A)
        steps = tangents(m)
        yield K(p, A), area(*(unit_derivative(apply(H, p), apply(H, t)) for t in steps))


@identity(
    "(11)", "adj(H) = |H| H⁻¹", adjugate, mutant=("not transposed inverse", lambda f: lambda H: times(arb(2), f(H))),
)  # fmt: skip
def adjugate_of_hessian(adj):
    for A in shapes():
        H = hessian(A)
        yield adj(H), times(determinant(H), inverse(H))


def second_difference(f, p, s, t):
    """The mixed second difference of a quadratic is its second derivative, exactly."""
    both, one, other = add(p, s, t), add(p, s), add(p, t)
    return f(both) - f(one) - f(other) + f(p)


AXES = ((arb(1), arb(0), arb(0)), (arb(0), arb(1), arb(0)), (arb(0), arb(0), arb(1)))


@identity(
    "(12)", "H = 2 AᵀA is the second derivative of (8), by exact differences", hessian,
    mutant=("AᵀA", lambda f: lambda A: times(arb(0.5), f(A))),
)  # fmt: skip
def second_derivative(H):
    for p, A in points():
        S = product(transpose(A), A)
        yield H(A), tuple(tuple(second_difference(lambda x, S=S: quadratic(x, S), p, s, t) for t in AXES) for s in AXES)


@identity(
    "(13)", "∇f = 2 AᵀA p = H p is the first derivative of (8), by exact central differences",
    lambda p, A: apply(hessian(A), p), mutant=("A p", lambda f: lambda p, A: apply(A, p)),
)  # fmt: skip
def first_derivative(gradient):
    for p, A in points():
        S = product(transpose(A), A)
        forward = [quadratic(add(p, e), S) - quadratic(add(p, minus(e)), S) for e in AXES]
        yield gradient(p, A), tuple(x / 2 for x in forward)


STEPS = {
    "(14)": ("|H| (Hp)ᵀH⁻¹(Hp)/‖Hp‖⁴", lambda p, m, H, A: determinant(H) * quadratic(apply(H, p), inverse(H)) / norm(apply(H, p)) ** 4),
    "(16)": ("|H| mᵀH⁻¹m/‖Hp‖²", lambda p, m, H, A: determinant(H) * quadratic(m, inverse(H)) / norm(apply(H, p)) ** 2),
    "(18)": ("|H| (mᵀH⁻¹m)²/(2 C_e²)", lambda p, m, H, A: determinant(H) * quadratic(m, inverse(H)) ** 2 / (2 * SIZE**2)),
}  # fmt: skip

for _place, (_form, _step) in STEPS.items():

    @identity(
        _place,
        f"K_g = {_form} is (10)",
        _step,
        mutant=("|H| lost", lambda f: lambda p, m, H, A: f(p, m, H, A) / determinant(H)),
    )
    def curvature_step(step):
        for p, A in points():
            yield step(p, normal_of(p, A), hessian(A), A), goldman(p, A)


@identity(
    "(20)", "K_g = |A|²‖A⁻ᵀm‖⁴/C_e² is (10)", "oracle.ellipsoid.gaussian_curvature",
    mutant=("|A| for |A|²", lambda f: lambda m, A, C: f(m, A, C) / abs(determinant(A))),
)  # fmt: skip
def curvature_by_normal(K):
    for p, A in points():
        yield K(normal_of(p, A), A, SIZE), goldman(p, A)


@identity(
    "(15)", "m = ∇f/‖∇f‖ is perpendicular to the ellipsoid's tangents A⁻¹t", normal_of,
    mutant=("p/‖p‖", lambda f: lambda p, A: normalise(p)),
)  # fmt: skip
@identity(
    "(22)", "m = AᵀA p/‖AᵀA p‖ is perpendicular to the ellipsoid's tangents A⁻¹t",
    lambda p, A: normalise(apply(product(transpose(A), A), p)), mutant=("A Aᵀ", lambda f: lambda p, A: f(p, transpose(A))),
)  # fmt: skip
def normal_is_perpendicular(normal):
    for p, A in points():
        m = normal(p, A)
        yield (dot(m, m), *(dot(m, apply(inverse(A), t)) for t in tangents(normalise(apply(A, p))))), (1, 0, 0)


@identity(
    "(17)", "‖Hp‖² = 2 C_e²/(mᵀH⁻¹m)", lambda m, H: 2 * SIZE**2 / quadratic(m, inverse(H)),
    mutant=("without the 2", lambda f: lambda m, H: f(m, H) / 2),
)  # fmt: skip
def length_of_gradient(square):
    for p, A in points():
        yield square(normal_of(p, A), hessian(A)), norm(apply(hessian(A), p)) ** 2


@identity(
    "(19)", "mᵀH⁻¹m = ‖A⁻ᵀm‖²/2, and |H| = 8|A|²", lambda m, A: norm(apply(inverse_transpose(A), m)) ** 2 / 2,
    mutant=("A⁻¹m", lambda f: lambda m, A: f(m, transpose(A))),
)  # fmt: skip
def inverse_hessian(form):
    for p, A in points():
        m = normal_of(p, A)
        yield form(m, A), quadratic(m, inverse(hessian(A)))
        yield determinant(hessian(A)), 8 * determinant(A) ** 2
