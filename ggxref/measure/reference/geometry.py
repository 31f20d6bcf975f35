"""Jacobians, directions, and areas and curvature of ellipsoids, as `formulas` has the rest."""

from ggxref.measure.doubledouble import PI, sqrt, where
from ggxref.measure.reference.formulas import (
    apply,
    cofactor,
    det,
    dot,
    half,
    lune_sum,
    norm,
    plus,
    scaled,
    stands_for,
    unit,
)


@stands_for("jacobian.reflection")
def jacobian_reflection(wo, wm):
    return 1.0 / (4.0 * abs(dot(unit(wo), unit(wm))))


@stands_for("jacobian.refraction")
def jacobian_refraction(wi, wo, wm, n_i, n_o):
    wi, wo, wm = unit(wi), unit(wo), unit(wm)
    o = dot(wo, wm)
    total = n_i * dot(wi, wm) + n_o * o
    return n_o * n_o * abs(o) / (total * total)


@stands_for("jacobian.slope")
def jacobian_slope(wm):
    z = unit(wm)[2]
    return 1.0 / (z * z * z)


@stands_for("jacobian.linear")
def jacobian_linear(wm, M):
    stretched = norm(apply(M, unit(wm)))
    return abs(det(M)) / (stretched * stretched * stretched)


@stands_for("ellipsoid.projected_area")
def ellipsoid_projected_area(w, A, size):
    return PI * size * size * norm(apply(A, unit(w))) / abs(det(A))


@stands_for("ellipsoid.lune_area")
def ellipsoid_lune_area(u, v, A, size):
    u, v = apply(A, unit(u)), apply(A, unit(v))
    return PI * size * size * lune_sum(u, v) / (2.0 * abs(det(A)) * norm(v))


@stands_for("geometry.reflect")
def geometry_reflect(w, wm):
    w, wm = unit(w), unit(wm)
    return plus(scaled(2.0 * dot(w, wm), wm), scaled(-1.0, w))


@stands_for("geometry.half_reflection")
def geometry_half_reflection(wi, wo):
    return half(wi, wo)


@stands_for("geometry.refract")
def geometry_refract(w, wm, eta):
    w, wm = unit(w), unit(wm)
    c = dot(w, wm)
    square = 1.0 - eta * eta + (eta * c) * (eta * c)
    along = eta * c - where(c.hi > 0, 1.0, -1.0) * sqrt(square)
    return tuple(where(square.hi < 0, 0.0, x) for x in plus(scaled(along, wm), scaled(-1.0 * eta, w)))


@stands_for("geometry.half_refraction")
def geometry_half_refraction(wi, wo, n_i, n_o):
    h = unit(plus(scaled(n_i, unit(wi)), scaled(n_o, unit(wo))))
    return tuple(where(h[2].hi < 0, -x, x) for x in h)


@stands_for("ellipsoid.gaussian_curvature")
def ellipsoid_gaussian_curvature(wm, A, size):
    stretched = apply(cofactor(A), unit(wm))
    root = dot(stretched, stretched) / (abs(det(A)) * size)
    return root * root
