"""Visible normals of V-cavities: heitz2014 algorithm 3. `distribution` is "ggx" or "beckmann"."""

from flint import arb

from ggxref.oracle import ndf
from ggxref.oracle.linalg import Vec3, Vector, cosine, dot, normalise
from ggxref.oracle.precision import at_least_zero, sign
from ggxref.oracle.sampling import normals

_SAMPLE = {"ggx": normals.sample_ggx, "beckmann": normals.sample_beckmann}
_NDF = {"ggx": ndf.ggx, "beckmann": ndf.beckmann}


def _other(m: Vector) -> Vec3:
    return -m[0], -m[1], m[2]


def _swapped(u: arb, across: arb, up: arb) -> bool:
    """u < <i,m'> / (<i,m> + <i,m'>), with i.m = up + across and i.m' = up - across."""
    if sign(up - across) <= 0:
        return False
    if sign(up + across) <= 0:
        return True
    return sign((1 - 2 * u) * up - across) > 0


def sample(u: Vector, wi: Vector, alpha: Vector, *, distribution: str = "ggx") -> Vec3:
    """m of D cos by u[0] and u[1]; its twin (-x, -y, z) if u[2] < <i,m'> / (<i,m> + <i,m'>). wi is above the horizon."""
    if sign(wi[2]) <= 0:
        raise ValueError(f"V-cavities are sampled from above the horizon; wi.z is {wi[2].str(5)}")
    m = _SAMPLE[distribution](u[:2], alpha)
    return _other(m) if _swapped(u[2], wi[0] * m[0] + wi[1] * m[1], wi[2] * m[2]) else m


def pdf(wm: Vector, wi: Vector, alpha: Vector, *, distribution: str = "ggx") -> arb:
    """2 <i,m> / (<i,m> + <i,m'>) z_m D(m) [1/sr]; 0 where wi is not above the horizon. heitz2014 appendix B."""
    if sign(wi[2]) <= 0 or sign(wm[2]) <= 0 or sign(dot(wi, wm)) <= 0:
        return arb(0)
    m = normalise(wm)
    a, b = cosine(wi, wm), at_least_zero(cosine(wi, _other(wm)))
    return 2 * a / (a + b) * m[2] * _NDF[distribution](m, alpha)
