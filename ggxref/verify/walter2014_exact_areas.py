"""Walter et al. 2014 in ball arithmetic, at exact inputs: projected areas, lunes and the masking that follows, (21)–(32)."""

from flint import arb

from ggxref.oracle.linalg import N, determinant, inverse_transpose, product, transpose
from ggxref.oracle.linalg import negative as minus
from ggxref.verify.identities import (
    add,
    apply,
    cross,
    directions,
    dot,
    exact,
    fronts,
    integral,
    norm,
    normalise,
    scale,
    tangents,
)
from ggxref.verify.walter2014_exact import SIZE, certified, identity, inverse, normal_of, points, shapes


def lune_integral(u, v, A):
    """(27) by sphere space, latitude and longitude: dp = ‖Aᵀs‖/|A| ds and m = Aᵀs/‖Aᵀs‖, the latitude's part in closed form."""
    a, b = apply(A, u), apply(A, v)
    angle = arb.atan2(norm(cross(a, b)), dot(a, b))
    along = integral(lambda psi: psi.cos(), angle - arb.pi() / 2, arb.pi() / 2)
    return SIZE**2 * norm(a) / abs(determinant(A)) * along * arb.pi() / 2


@certified(
    "(21)", "the integral over the ellipsoid, A_e⊥(u), enclosed", "oracle.ellipsoid.projected_area",
    mutant=("A⁻¹u", lambda f: lambda u, A, C: f(u, inverse(A), C)),
)  # fmt: skip
def projected_area_integral(projected_area):
    for A in shapes():
        for u in directions():
            yield projected_area(u, A, SIZE), lune_integral(u, u, A)


@certified(
    "(27)", "the integral over the lune, A_ℓ⊥(u, v), also of nearly opposite u and v, enclosed", "oracle.ellipsoid.lune_area",
    also=["ours lune areas"], mutant=("u and v exchanged", lambda f: lambda u, v, A, C: f(v, u, A, C)),
)  # fmt: skip
def lune_area_integral(lune_area):
    for A in shapes():
        for u in directions():
            for v in (N, normalise(add(minus(u), exact((0, 0.0625, 0.0625))))):
                yield lune_area(u, v, A, SIZE), lune_integral(u, v, A)


@certified(
    "§2.3", "π/2 (1 + cos θ) is the integral over the spherical lune of its foreshortening, enclosed", lambda cos: arb.pi() / 2 * (1 + cos),
    mutant=("π/2 (1 + cos²θ)", lambda f: lambda cos: f(cos**2)),
)  # fmt: skip
def spherical_lune(area_):
    sphere = exact(((1, 0, 0), (0, 1, 0), (0, 0, 1)))
    for u in directions():
        for v in (N, minus(N)):
            yield area_(dot(u, v)), lune_integral(u, v, sphere) / SIZE**2


@identity(
    "(23)", "u·m = 0 where (AᵀA u)·p = 0: on the silhouette", lambda A: product(transpose(A), A),
    mutant=("A Aᵀ", lambda f: lambda A: f(transpose(A))),
)  # fmt: skip
def silhouette(plane):
    for A in shapes():
        for u in directions():
            p, q = tangents(normalise(apply(plane(A), u)))
            yield (dot(u, normal_of(p, A)), dot(u, normal_of(q, A))), (0, 0)


@identity(
    "(24)", "p_o = A p has length C_e, and p = A⁻¹p_o", lambda A, p: apply(A, p),
    mutant=("A⁻¹p", lambda f: lambda A, p: apply(inverse(A), p)),
)  # fmt: skip
def sphere_space(image):
    for p, A in points():
        yield norm(image(A, p)), SIZE
        yield apply(inverse(A), image(A, p)), p


@identity(
    "(25)", "(M a) × (M b) = |M| M⁻ᵀ (a × b)", inverse_transpose, mutant=("Mᵀ as printed", lambda f: transpose),
)  # fmt: skip
def cross_product_of_images(cofactor):
    for M in shapes():
        for a in directions():
            b = exact((0.5, -1, 0.25))
            yield cross(apply(M, a), apply(M, b)), scale(determinant(M), apply(cofactor(M), cross(a, b)))


def silhouette_factors(u, A):
    """First line of (26): circle, ratio of areas, and foreshortening."""
    w = apply(product(transpose(A), A), u)
    circle = arb.pi() * SIZE**2
    return circle * norm(w) / (abs(determinant(A)) * norm(apply(inverse_transpose(A), w))) * dot(w, u) / norm(w)


@identity(
    "(26)", "the product of silhouette, ratio of areas and foreshortening is π C_e²‖A u‖/|A|",
    ["oracle.ellipsoid.projected_area", silhouette_factors], mutant=("‖A u‖²", lambda f: lambda u, A, C: f(u, A, C) * norm(apply(A, u))),
)  # fmt: skip
def projected_area_product(projected_area, factors):
    for A in shapes():
        for u in directions():
            yield projected_area(u, A, SIZE), factors(u, A)


@identity(
    "(28)", "(1 + cos θ_ℓ)/2 of (26), and A_ℓ⊥(u, u) = A_e⊥(u)", ["oracle.ellipsoid.lune_area", silhouette_factors],
    mutant=("½ lost", lambda f: lambda u, v, A, C: 2 * f(u, v, A, C)),
)  # fmt: skip
def lune_area_product(lune_area, factors):
    for A in shapes():
        for u in directions():
            cos = dot(apply(A, u), apply(A, N)) / (norm(apply(A, u)) * norm(apply(A, N)))
            yield lune_area(u, N, A, SIZE), (1 + cos) / 2 * factors(u, A)
            yield lune_area(u, u, A, SIZE), factors(u, A)


@identity(
    "(29)", "C_e = √(|A|/(π‖A n‖)) gives A_e⊥(n) = 1, enclosed", ["oracle.ellipsoid.size", "oracle.ellipsoid.projected_area"],
    mutant=("‖A n‖ lost", lambda f: lambda A: f(A) * norm(apply(A, N)).sqrt()),
)  # fmt: skip
def unit_size(size, projected_area):
    for A in shapes():
        yield projected_area(N, A, size(A)), 1


@identity(
    "(30)", "C_e cancels: D and G1 are the same for C_e = 1 and for (29)",
    [lambda m, A, K, area_, size: 1 / (area_(N, A, size) * K(m, A, size)), "oracle.ellipsoid.gaussian_curvature",
     "oracle.ellipsoid.projected_area", "oracle.ellipsoid.lune_area", "oracle.ellipsoid.size"],
    mutant=("C_e = 1 in one factor", lambda f: lambda m, A, K, area_, size: 1 / (area_(N, A, arb(1)) * K(m, A, size))),
)  # fmt: skip
def size_cancels(D, K, area_, lune_area, size):
    for A in shapes():
        for m in directions():
            C = size(A)
            yield D(m, A, K, area_, C), D(m, A, K, area_, arb(1))
            yield lune_area(m, N, A, C) / area_(N, A, C), lune_area(m, N, A, arb(1)) / area_(N, A, arb(1))


@certified(
    "(32)", "G1 = min(1, (u·n)/∫ ⟨u·m⟩ D dm) with the integral of (27), enclosed",
    ["oracle.masking.g1_ellipsoid", "oracle.ellipsoid.projected_area"],
    mutant=("‖A n‖ for ‖A n‖²", lambda f: lambda u, m, A: f(u, m, A) / norm(apply(A, N))),
)  # fmt: skip
def masking_is_its_integral(g1, projected_area):
    for A in shapes():
        for u in directions():
            ratio = projected_area(N, A, SIZE) * u[2] / lune_integral(u, N, A)
            yield g1(u, u, A), ratio.min(arb(1))


@identity(
    "(6)", "G1 of (32) with (26) and (28): 2‖A n‖²|u·n|/(‖A u‖‖A n‖ + A u·A n), at most 1",
    ["oracle.masking.g1_ellipsoid", "oracle.ellipsoid.projected_area", "oracle.ellipsoid.lune_area"],
    mutant=("no minimum", lambda f: lambda u, m, A: unclamped(u, A)),
)  # fmt: skip
def masking_formula(g1, projected_area, lune_area):
    for A in shapes():
        for u in directions():
            ratio = projected_area(N, A, SIZE) * u[2] / lune_area(u, N, A, SIZE)
            yield g1(u, u, A), ratio.min(arb(1))
            yield unclamped(u, A), ratio


def unclamped(u, A):
    a, n = apply(A, u), apply(A, N)
    return 2 * dot(n, n) * abs(u[2]) / (norm(a) * norm(n) + dot(a, n))


@identity(
    "(31)", "A_ℓ⊥(u, n) G1(u) ≤ A_e⊥(n)|u·n|", [
        "oracle.masking.g1_ellipsoid", "oracle.ellipsoid.projected_area", "oracle.ellipsoid.lune_area"],
    mutant=("G1 = 1", lambda f: lambda u, m, A: arb(1)),
)  # fmt: skip
def visible_area_fits(g1, projected_area, lune_area):
    """The larger of the two sides is the surface's."""
    for A in shapes():
        for u in directions():
            whole = projected_area(N, A, SIZE) * u[2]
            yield (lune_area(u, N, A, SIZE) * g1(u, u, A)).max(whole), whole


@identity(
    "(7)", "G1(ω, m) = G1(sgn(ω·n) ω, m), from below with the same m", "oracle.masking.g1_ellipsoid",
    mutant=("the lune of ω itself", lambda f: lambda w, m, A: unclamped(w, A).min(arb(1))),
)  # fmt: skip
def masking_from_below(g1):
    for A in shapes():
        for w, m in fronts():
            yield g1(minus(w), m, A), g1(w, m, A)
