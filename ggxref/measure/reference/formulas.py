"""The formulas once more, on double-double components: the fast stand-in for the oracle where millions of points are graded.

Every function has the name and the arguments of its public twin. A direction is a tuple of three arrays and is normalised
first, `alpha` is two arrays, `A` is rows of three. Forms are chosen to keep digits, not to be fast; each is compared
with the oracle by `tests/test_measure_reference.py`.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
from flint import arb

from ggxref.measure.doubledouble import DD, PI, exp, log, maximum, minimum, sqrt, where
from ggxref.oracle.precision import working

REFERENCES: dict[str, Callable] = {}


def stands_for(name):
    def register(function):
        REFERENCES[name] = function
        return function

    return register


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def norm(a):
    return sqrt(dot(a, a))


def scaled(c, a):
    return tuple(c * x for x in a)


def plus(a, b):
    return tuple(x + y for x, y in zip(a, b, strict=True))


def unit(a):
    n = norm(a)
    n = where(n.hi > 0, n, 1.0)
    return tuple(x / n for x in a)


def apply(M, a):
    return tuple(dot(row, a) for row in M)


def columns(M):
    return tuple(zip(*M, strict=True))


def cofactor(A):
    a, b, c = A
    return cross(b, c), cross(c, a), cross(a, b)


def det(A):
    return dot(A[0], cross(A[1], A[2]))


def _positive(x):
    return maximum(x, 0.0)


def over(a, b):
    zero = b.hi == 0
    return where(zero, 0.0, a / where(zero, 1.0, b))


# ndf


@stands_for("ndf.ggx")
def ndf_ggx(wm, alpha):
    x, y, z = unit(wm)
    q = (x / alpha[0]) * (x / alpha[0]) + (y / alpha[1]) * (y / alpha[1]) + z * z
    return where(z.hi > 0, 1.0 / (PI * alpha[0] * alpha[1] * q * q), 0.0)


def _tangent_square(wm, alpha):
    x, y, z = wm
    z = where(z.hi > 0, z, 1.0)
    a, b = x / (alpha[0] * z), y / (alpha[1] * z)
    return a * a + b * b


@stands_for("ndf.beckmann")
def ndf_beckmann(wm, alpha):
    z = unit(wm)[2]
    above = z.hi > 0
    square = where(above, z, 1.0) * where(above, z, 1.0)
    exponent = maximum(-_tangent_square(wm, alpha), -700.0)
    seen = above & (exponent.hi > -700)
    return where(seen, exp(exponent) / (PI * alpha[0] * alpha[1] * square * square), 0.0)


@stands_for("ndf.student_t")
def ndf_student_t(wm, alpha, gamma):
    z = unit(wm)[2]
    above = z.hi > 0
    square = where(above, z, 1.0) * where(above, z, 1.0)
    g = gamma - 1.0
    power = exp(-(gamma * log(1.0 + _tangent_square(wm, alpha) / g)))
    return where(above, power / (PI * alpha[0] * alpha[1] * square * square), 0.0)


@stands_for("ndf.ellipsoid")
def ndf_ellipsoid(wm, A):
    wm = unit(wm)
    determinant = det(A)
    stretched = scaled(1.0 / determinant, apply(cofactor(A), wm))
    square = dot(stretched, stretched)
    return where(wm[2].hi > 0, 1.0 / (PI * abs(determinant) * norm(columns(A)[2]) * square * square), 0.0)


# masking


def _flat(w, alpha):
    return (alpha[0] * w[0]) * (alpha[0] * w[0]) + (alpha[1] * w[1]) * (alpha[1] * w[1])


def sigma_ggx(w, alpha):
    square = _flat(w, alpha)
    t = sqrt(square + w[2] * w[2])
    below = w[2].hi < 0
    return where(below, square / where(below, t - w[2], 1.0), t + w[2]) * 0.5


def _up(w):
    return tuple(where(w[2].hi < 0, -x, x) for x in w)


def _front(w, wm):
    return np.sign(dot(w, wm).hi) * np.sign(w[2].hi) > 0


@stands_for("masking.lambda_ggx")
def masking_lambda_ggx(w, alpha):
    w = unit(w)
    square = _flat(w, alpha)
    z = abs(w[2])
    return square / (2.0 * z * (z + sqrt(square + z * z)))


@cache
def _ierfc_coefficients(count=52) -> list[DD]:
    """Chebyshev's of sqrt(pi) (1 + 2 a²) exp(a²) ierfc(a) in t = (a - 3)/(a + 3), by the oracle's arithmetic."""
    with working(400):
        angles = [(arb.pi() * (2 * j + 1)) / (2 * count) for j in range(count)]
        values = []
        for angle in angles:
            a = 3 * (1 + angle.cos()) / (1 - angle.cos())
            square = a * a
            tail = (-square).exp() / arb.pi().sqrt() - a * a.erfc()
            values.append(arb.pi().sqrt() * (1 + 2 * square) * square.exp() * tail)
        sums = [sum((v * (k * x).cos() for v, x in zip(values, angles, strict=True)), arb(0)) for k in range(count)]
        found = []
        for k, total in enumerate(sums):
            c = total * (1 if k == 0 else 2) / count
            hi = float(c.mid())
            found.append(DD(hi, float((c - hi).mid())))
        return found


def gaussian_area(w, alpha):
    """|z| Λ = s ierfc(|z|/s)/2."""
    flat = _flat(w, alpha)
    s = sqrt(flat)
    some = s.hi > 0
    a = abs(w[2]) / where(some, s, 1.0)
    seen = some & (a.hi < 26)  # beyond, it is below 1e-290
    a = where(seen, a, 1.0)
    t = (a - 3.0) / (a + 3.0)
    coefficients = _ierfc_coefficients()
    b, b_next = t * 0.0, t * 0.0
    for c in reversed(coefficients[1:]):  # Clenshaw
        b, b_next = c + 2.0 * t * b - b_next, b
    scaled = (coefficients[0] + t * b - b_next) / (sqrt(PI) * (1.0 + 2.0 * a * a))
    return where(seen, s * scaled * exp(-(a * a)) * 0.5, 0.0)


@stands_for("masking.lambda_beckmann")
def masking_lambda_beckmann(w, alpha):
    w = unit(w)
    return gaussian_area(w, alpha) / abs(w[2])


@stands_for("masking.g1_ggx")
def masking_g1_ggx(w, wm, alpha):
    up = _up(unit(w))
    return where(_front(w, wm), up[2] / sigma_ggx(up, alpha), 0.0)


@stands_for("masking.g1_beckmann")
def masking_g1_beckmann(w, wm, alpha):
    up = _up(unit(w))
    return where(_front(w, wm), over(up[2], up[2] + gaussian_area(up, alpha)), 0.0)


@stands_for("masking.g1_v_cavity")
def masking_g1_v_cavity(w, wm):
    w, wm = unit(w), unit(wm)
    return where(_front(w, wm), minimum(over(2.0 * abs(wm[2] * w[2]), abs(dot(w, wm))), 1.0), 0.0)


def lune_sum(a, b):
    """‖a‖‖b‖ + a·b."""
    product, cosine, normal = norm(a) * norm(b), dot(a, b), cross(a, b)
    below = cosine.hi < 0
    return where(below, dot(normal, normal) / where(below, product - cosine, 1.0), product + cosine)


def _sigma_ellipsoid(w, A):
    n = columns(A)[2]
    Aw = apply(A, w)
    return lune_sum(Aw, n) / (2.0 * dot(n, n))


@stands_for("masking.g1_ellipsoid")
def masking_g1_ellipsoid(w, wm, A):
    up = _up(unit(w))
    return where(_front(w, wm), minimum(over(up[2], _sigma_ellipsoid(up, A)), 1.0), 0.0)


@stands_for("masking.g2_height_correlated")
def masking_g2_height_correlated(g1_i, g1_o):
    return over(g1_i * g1_o, g1_i + g1_o - g1_i * g1_o)


@stands_for("masking.g2_separable")
def masking_g2_separable(g1_i, g1_o):
    return g1_i * g1_o


@stands_for("masking.g2_v_cavity")
def masking_g2_v_cavity(wi, wo, wm):
    a, b = masking_g1_v_cavity(wi, wm), masking_g1_v_cavity(wo, wm)
    return where(wo[2].hi > 0, minimum(a, b), _positive(a + b - 1.0))


# fresnel


@stands_for("fresnel.schlick")
def fresnel_schlick(cos_i, f0):
    c = 1.0 - abs(cos_i)
    return f0 + (1.0 - f0) * (c * c) * (c * c) * c


@stands_for("fresnel.dielectric")
def fresnel_dielectric(cos_i, eta):
    c = abs(cos_i)
    square = 1.0 - eta * eta + (eta * c) * (eta * c)
    ct = sqrt(square)
    s, p = over(eta * c - ct, eta * c + ct), over(c - eta * ct, c + eta * ct)
    value = (s * s + p * p) * 0.5
    gap = (1.0 - eta * eta).hi
    return where(gap == 0, 0.0, where((square.hi <= 0) & (gap < 0), 1.0, value))


@stands_for("fresnel.conductor")
def fresnel_conductor(cos_i, eta, k):
    c = abs(cos_i)
    cc, ss = c * c, (1.0 - c) * (1.0 + c)
    real = eta * eta - k * k - ss
    modulus = sqrt(real * real + 4.0 * (eta * k) * (eta * k))
    # (a + ib)² = real + 2iηk; the smaller of a and b from their product.
    large = sqrt((modulus + abs(real)) * 0.5)
    a = where(real.hi >= 0, large, eta * k / large)
    s = over(modulus + cc - 2.0 * a * c, modulus + cc + 2.0 * a * c)
    mixed, straight = 2.0 * a * c * ss, modulus * cc + ss * ss
    return s * (1.0 + over(straight - mixed, straight + mixed)) * 0.5


def half(wi, wo):
    return unit(plus(unit(wi), unit(wo)))


@stands_for("bsdf.brdf_ggx")
def bsdf_brdf_ggx(wi, wo, alpha):
    wm, z_i, z_o = half(wi, wo), unit(wi)[2], unit(wo)[2]
    seen = (z_i.hi > 0) & (z_o.hi > 0)
    G2 = masking_g2_height_correlated(masking_g1_ggx(wi, wm, alpha), masking_g1_ggx(wo, wm, alpha))
    return where(seen, ndf_ggx(wm, alpha) * G2 / where(seen, 4.0 * z_i * z_o, 1.0), 0.0)


# densities


def _visible(wm, wi, D, sigma):
    cosine = dot(unit(wi), unit(wm))
    return where(cosine.hi > 0, over(cosine * D, sigma), 0.0)


@stands_for("sampling.spherical_cap.pdf")
def sampling_spherical_cap_pdf(wm, wi, alpha):
    return _visible(wm, wi, ndf_ggx(wm, alpha), sigma_ggx(unit(wi), alpha))


@stands_for("sampling.ellipsoid_cap.pdf")
def sampling_ellipsoid_cap_pdf(wm, wi, A):
    return _visible(wm, wi, ndf_ellipsoid(wm, A), _sigma_ellipsoid(unit(wi), A))


@stands_for("sampling.normals.pdf_ggx")
def sampling_normals_pdf_ggx(wm, alpha):
    return ndf_ggx(wm, alpha) * unit(wm)[2]


def _bound_terms(wi, alpha):
    a = minimum(minimum(alpha[0], alpha[1]), 1.0)
    s = 1.0 + sqrt(wi[0] * wi[0] + wi[1] * wi[1])
    denominator = s * s + (a * wi[2]) * (a * wi[2])
    above = wi[2].hi > 0
    k = where(above, (1.0 - a) * (1.0 + a) * s * s / denominator, 1.0)
    return k, where(above, a * a * (s * s + wi[2] * wi[2]) / denominator, 0.0)


@stands_for("sampling.bounded_cap.bound")
def sampling_bounded_cap_bound(wi, alpha):
    return _bound_terms(unit(wi), alpha)[0]
