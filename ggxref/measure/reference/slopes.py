"""Densities of slopes, as `formulas` has those of normals."""

from ggxref.measure.doubledouble import PI, exp, log, maximum, where
from ggxref.measure.reference.formulas import (
    apply,
    cofactor,
    columns,
    det,
    dot,
    gaussian_area,
    norm,
    over,
    sigma_ggx,
    stands_for,
    unit,
)


def _square(slope, alpha):
    x, y = slope[0] / alpha[0], slope[1] / alpha[1]
    return x * x + y * y


@stands_for("slopes.ggx")
def slopes_ggx(slope, alpha):
    q = 1.0 + _square(slope, alpha)
    return 1.0 / (PI * alpha[0] * alpha[1] * q * q)


@stands_for("slopes.beckmann")
def slopes_beckmann(slope, alpha):
    exponent = maximum(-_square(slope, alpha), -700.0)
    return where(exponent.hi > -700, exp(exponent) / (PI * alpha[0] * alpha[1]), 0.0)


@stands_for("slopes.student_t")
def slopes_student_t(slope, alpha, gamma):
    return exp(-(gamma * log(1.0 + _square(slope, alpha) / (gamma - 1.0)))) / (PI * alpha[0] * alpha[1])


@stands_for("slopes.ellipsoid")
def slopes_ellipsoid(slope, A):
    stretched = apply(cofactor(A), (-slope[0], -slope[1], 1.0 + 0.0 * slope[0]))
    square, d = dot(stretched, stretched), abs(det(A))
    return d * d * d / (PI * norm(columns(A)[2]) * square * square)


def _seen(slope, wi, sigma, density):
    wi = unit(wi)
    facing = wi[2] - wi[0] * slope[0] - wi[1] * slope[1]
    return where(facing.hi > 0, over(facing, sigma) * density, 0.0)


@stands_for("slopes.visible_ggx")
def slopes_visible_ggx(slope, wi, alpha):
    return _seen(slope, wi, sigma_ggx(unit(wi), alpha), slopes_ggx(slope, alpha))


@stands_for("slopes.visible_beckmann")
def slopes_visible_beckmann(slope, wi, alpha):
    w = unit(wi)
    return _seen(slope, wi, maximum(w[2], 0.0) + gaussian_area(w, alpha), slopes_beckmann(slope, alpha))
