"""The samplers once more, on double-double components."""

import numpy as np

from ggxref.measure.doubledouble import DD, TURN, cos_sin_turn, log, sqrt, where
from ggxref.measure.reference import formulas as f
from ggxref.measure.reference.formulas import stands_for


def _sphere(wi, alpha):
    x, y, z = f.unit(wi)
    return alpha[0] * x, alpha[1] * y, z


def _half_in_cap(u, i, cut):
    """Half vector in sphere space, times the length of `i` (not unit); the cap is {z > cut − i_z} in the same unit."""
    square = i[0] * i[0] + i[1] * i[1]
    t = sqrt(square + i[2] * i[2])
    large = t + abs(i[2])
    small = square / large
    below = i[2].hi < 0
    height, rest = where(below, small, large) - cut, where(below, large, small) + cut
    c, s = cos_sin_turn(u[0])
    depth = u[1] * height
    radius = sqrt(depth * (2.0 * (1.0 - u[1]) * t + u[1] * rest))
    return radius * c + i[0], radius * s + i[1], (1.0 - u[1]) * height + cut


@stands_for("sampling.spherical_cap.sample")
def sampling_spherical_cap_sample(u, wi, alpha):
    x, y, z = _half_in_cap(u, _sphere(wi, alpha), 0.0)
    return f.unit((alpha[0] * x, alpha[1] * y, z))


@stands_for("sampling.bounded_cap.sample")
def sampling_bounded_cap_sample(u, wi, alpha):
    i = _sphere(wi, alpha)
    x, y, z = _half_in_cap(u, i, f._bound_terms(f.unit(wi), alpha)[1] * i[2])
    return f.unit((alpha[0] * x, alpha[1] * y, z))


def _azimuth(i, at_pole):
    """‖(x, y)‖ of `i`, cosine and sine of its azimuth; `at_pole` where there is none."""
    flat = sqrt(i[0] * i[0] + i[1] * i[1])
    pole = flat.hi == 0
    safe = where(pole, 1.0, flat)
    return flat, where(pole, at_pole[0], i[0] / safe), where(pole, at_pole[1], i[1] / safe)


@stands_for("sampling.cross_section.sample")
def sampling_cross_section_sample(u, wi, alpha):
    """dupuy2023 listing 2, in the frame of the stretched ω_i; double-double carries its cancellations."""
    i = f.unit(_sphere(wi, alpha))
    flat, cos_i, sin_i = _azimuth(i, (0.0, -1.0))
    w1 = -sin_i, cos_i, flat * 0.0
    w2 = f.cross(i, w1)
    c, s = cos_sin_turn(u[0])
    r = sqrt(u[1])
    t1, t2 = r * c, r * s
    blend = (1.0 + i[2]) * 0.5
    t2 = (1.0 - blend) * sqrt(1.0 - t1 * t1) + blend * t2
    t3 = sqrt(1.0 - t1 * t1 - t2 * t2)
    x, y, z = f.plus(f.plus(f.scaled(t1, w1), f.scaled(t2, w2)), f.scaled(t3, i))
    return f.unit((alpha[0] * x, alpha[1] * y, f._positive(z)))


@stands_for("sampling.normals.sample_ggx")
def sampling_normals_sample_ggx(u, alpha):
    c, s = cos_sin_turn(u[0])
    r = sqrt(u[1])
    return f.unit((alpha[0] * r * c, alpha[1] * r * s, sqrt(1.0 - u[1])))


@stands_for("sampling.normals.sample_beckmann")
def sampling_normals_sample_beckmann(u, alpha):
    c, s = cos_sin_turn(u[0])
    r = sqrt(-log(1.0 - u[1]))
    return f.unit((alpha[0] * r * c, alpha[1] * r * s, r * 0.0 + 1.0))


def _kepler(v):
    """(cos E/2, sin E/2) with E − sin E = 2πv, 0 < v <= 1/2: a step of Newton from float64 doubles its digits."""
    target = v * TURN
    E = np.cbrt(6 * target.hi)
    for _ in range(60):  # from above, where the left side is convex
        small = E < 0.1
        difference = np.where(small, E**3 / 6 * (1 - E**2 / 20 * (1 - E**2 / 42)), E - np.sin(E))
        E = np.minimum(E - (difference - target.hi) / (2 * np.sin(E / 2) ** 2), np.pi)
    E = DD(E, np.zeros_like(E))
    for _ in range(2):
        c, s = cos_sin_turn(E / TURN * 0.5)
        E = E - (E - 2.0 * s * c - target) / (2.0 * s * s)
    return cos_sin_turn(E / TURN * 0.5)


@stands_for("sampling.slope_ggx.sample")
def sampling_slope_ggx_sample(u, wi, alpha):
    """With (sin ψ, cos ψ) at the marginal's quantile and E at the conditional's, as the public twin says."""
    i = f.unit(_sphere(wi, alpha))
    sin_i, cos_phi, sin_phi = _azimuth(i, (1.0, 0.0))
    total = u[0] * (1.0 + i[2]) - i[2]
    rest = sqrt((1.0 - total) * (1.0 + total))
    sin_psi, cos_psi = total * i[2] - rest * sin_i, rest * i[2] + total * sin_i
    upper = u[1].hi > 0.5
    c, s = _kepler(where(upper, 1.0 - u[1], u[1]))
    along, across = -sin_psi * s, where(upper, -c, c)
    x, y = cos_phi * along - sin_phi * across, sin_phi * along + cos_phi * across
    return f.unit((alpha[0] * x, alpha[1] * y, cos_psi * s))


@stands_for("sampling.lune.sample")
def sampling_lune_sample(u, wi, A):
    """walter2014 (34)–(46); not for ωi = n, where the frame is another."""
    a, b = 2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0
    wide = abs(a).hi > abs(b).hi
    r, other = where(wide, a, b), where(wide, b, a)
    c, s = cos_sin_turn(other / (8.0 * where(r.hi == 0, 1.0, r)))
    along, across = r * where(wide, c, s), r * where(wide, s, c)
    e3, pole = f.unit(f.apply(A, wi)), f.unit(f.columns(A)[2])
    e2 = f.unit(f.cross(e3, pole))
    e1 = f.cross(e2, e3)
    share = (1.0 + f.dot(e3, pole)) * 0.5
    moved = share * along + (1.0 - share) * sqrt((1.0 - across) * (1.0 + across))
    lifted = sqrt(1.0 - moved * moved - across * across)
    p = f.plus(f.plus(f.scaled(moved, e1), f.scaled(across, e2)), f.scaled(lifted, e3))
    return f.unit(f.apply(f.columns(A), p))


def _canonical(A):
    """(c00, c10, c11, ex, ey) by the Cholesky factor of S = AᵀA/‖An‖², as design.md defines it."""
    rows = f.columns(A)
    n = f.dot(rows[2], rows[2])
    ex, ey = f.dot(rows[0], rows[2]) / n, f.dot(rows[1], rows[2]) / n
    c00 = sqrt(f.dot(rows[0], rows[0]) / n - ex * ex)
    c10 = (f.dot(rows[0], rows[1]) / n - ex * ey) / c00
    return c00, c10, abs(f.det(A)) / (n * sqrt(n) * c00), ex, ey


def _in_canonical_cap(u, wi, canonical, cut):
    c00, c10, c11, ex, ey = canonical
    x, y, z = wi
    x, y, z = _half_in_cap(u, (c00 * x + c10 * y, c11 * y, ex * x + ey * y + z), cut)
    return f.unit((c00 * x + ex * z, c10 * x + c11 * y + ey * z, z))


@stands_for("sampling.ellipsoid_cap.sample")
def sampling_ellipsoid_cap_sample(u, wi, A):
    return _in_canonical_cap(u, f.unit(wi), _canonical(A), 0.0)


@stands_for("sampling.ellipsoid_bounded.sample")
def sampling_ellipsoid_bounded_sample(u, wi, A):
    """The cap ends at i_z / max Q above the horizon of the reflections: the oracle's Q."""
    wi, canonical = f.unit(wi), _canonical(A)
    c00, c10, c11, ex, ey = canonical
    det, trace = c00 * c11 * c00 * c11, c00 * c00 + c10 * c10 + c11 * c11
    gap = c00 * c00 - c10 * c10 - c11 * c11
    square = det / ((trace + sqrt(gap * gap + 4.0 * c00 * c10 * c00 * c10)) * 0.5)
    lift, skew = ex * ex + ey * ey, sqrt(ex * ex + ey * ey)
    sin_i = sqrt(wi[0] * wi[0] + wi[1] * wi[1])
    mean, b, d = (1.0 + (lift + 1.0) / square) * 0.5, (1.0 + (lift - 1.0) / square) * 0.5, skew / square
    climbs = (-b * wi[2] - d * sin_i).hi > 0
    largest = where(climbs, mean - b * sin_i + d * wi[2], mean + sqrt(b * b + d * d))
    return _in_canonical_cap(u, wi, canonical, where(wi[2].hi > 0, wi[2] / largest, 0.0))


@stands_for("sampling.normals.pdf_beckmann")
def sampling_normals_pdf_beckmann(wm, alpha):
    return f.ndf_beckmann(wm, alpha) * f.unit(wm)[2]


@stands_for("sampling.slope_beckmann.pdf")
def sampling_slope_beckmann_pdf(wm, wi, alpha):
    wi = f.unit(wi)
    return f._visible(wm, wi, f.ndf_beckmann(wm, alpha), f._positive(wi[2]) + f.gaussian_area(wi, alpha))


@stands_for("sampling.v_cavity.pdf")
def sampling_v_cavity_pdf(wm, wi, alpha):
    wm, wi = f.unit(wm), f.unit(wi)
    a, b = (f._positive(f.dot(wi, m)) for m in (wm, (-wm[0], -wm[1], wm[2])))
    return where(wi[2].hi > 0, 2.0 * f.over(a, a + b) * wm[2] * f.ndf_ggx(wm, alpha), 0.0)
