"""Fresnel reflectance of unpolarised light. Only |cos_i| matters."""

from flint import acb, arb

from ggxref.oracle.precision import exactly, sign


def dielectric(cos_i: arb, eta: arb) -> arb:
    """(rs^2 + rp^2) / 2 of Fresnel's equations, eta = n_i / n_o; 1 in total reflection, 0 at eta = 1."""
    c = abs(cos_i)
    if eta == 1:
        return arb(0)
    with exactly():
        square = 1 - eta * eta * (1 - c * c)
    if sign(square) <= 0:
        return arb(1)
    ct = square.sqrt()
    rs, rp = (eta * c - ct) / (eta * c + ct), (c - eta * ct) / (c + eta * ct)
    return (rs**2 + rp**2) / 2


def conductor(cos_i: arb, eta: arb, k: arb) -> arb:
    """(|rs|^2 + |rp|^2) / 2, eta + ik the metal's index over the incident side's; 0 where it is 1.

    q = sqrt(n^2 - sin^2) = n cos_t, in the first quadrant: rs = (c - q) / (c + q), rp = (n^2 c - q) / (n^2 c + q).
    """
    c = abs(cos_i)
    if eta == 1 and k == 0:
        return arb(0)
    with exactly():
        real, imag, sin2 = eta * eta - k * k, 2 * eta * k, 1 - c * c
        shifted = real - sin2
    if shifted == 0 and imag == 0:
        return arb(1)  # the critical angle: q = 0
    n2, q = acb(real, imag), acb(shifted, imag).sqrt()
    rs, rp = (c - q) / (c + q), (n2 * c - q) / (n2 * c + q)
    return (abs(rs) ** 2 + abs(rp) ** 2) / 2


def schlick(cos_i: arb, f0: arb) -> arb:
    """f0 + (1 - f0) (1 - |cos_i|)^5. Schlick 1994."""
    return f0 + (1 - f0) * (1 - abs(cos_i)) ** 5
