"""Changes of variable, as densities: how much solid angle one side has per unit of the other."""

from flint import arb

from ggxref.oracle.linalg import Matrix, Vector, apply, cosine, determinant, dot, norm, normalise, surds
from ggxref.oracle.precision import exactly, sign


def reflection(wo: Vector, wm: Vector) -> arb:
    """d wm / d wo = 1 / (4 |wo.m|), infinite where they are perpendicular. dupuy2023 (8)."""
    if sign(dot(wo, wm)) == 0:
        return arb.pos_inf()
    return 1 / (4 * abs(cosine(wo, wm)))


def refraction(wi: Vector, wo: Vector, wm: Vector, n_i: arb, n_o: arb) -> arb:
    """d wm / d wo = n_o^2 |wo.m| / (n_i wi.m + n_o wo.m)^2, infinite where the sum is 0. heitz2014 section 2.2."""
    im, om = dot(wi, wm), dot(wo, wm)
    with exactly():
        weighted = n_i * im, dot(wo, wo), n_o * om, dot(wi, wi)
    total = surds(*weighted) / (norm(wi) * norm(wo) * norm(wm))
    if total == 0:
        return arb.pos_inf()
    return n_o**2 * abs(cosine(wo, wm)) / total**2


def slope(wm: Vector) -> arb:
    """d slope / d wm = 1 / z^3, for z > 0; infinite at the horizon. heitz2014 section 5.1."""
    if sign(wm[2]) == 0:
        return arb.pos_inf()
    return 1 / normalise(wm)[2] ** 3


def linear(wm: Vector, M: Matrix) -> arb:
    """|det M| / |M m|^3, of the map m -> M m / |M m|. dupuy2023 (1)."""
    return abs(determinant(M)) / norm(apply(M, normalise(wm))) ** 3
