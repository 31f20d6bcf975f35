"""Visible Beckmann normals through their slopes: heitz2014 algorithm 4."""

from flint import arb

from ggxref.oracle import masking, ndf
from ggxref.oracle.linalg import ONE, ZERO, Vec3, Vector, cosine, normalise
from ggxref.oracle.precision import Undecided, sign
from ggxref.oracle.roots import increasing_root
from ggxref.oracle.sampling import sphere, stretched_frame


def _quantile(u: arb) -> arb:
    """Of exp(-y^2) / sqrt(pi), u > 0: erf(y) = 2u - 1, solved for the smaller tail."""
    half = sign(2 * u - 1)
    if half == 0:
        return ZERO
    return -(2 * u).erfcinv() if half < 0 else (2 - 2 * u).erfcinv()


def _marginal(x: arb, sin_i: arb, cos_i: arb) -> arb:
    """Integral of (cos_i - sin_i t) exp(-t^2) / sqrt(pi) over t < x: (10), before its normalisation.

    cos_i (1 + erf x) / 2 + sin_i exp(-x^2) / (2 sqrt pi), with erfc(-x) for 1 + erf(x).
    """
    return cos_i * (-x).erfc() / 2 + sin_i * (-x * x).exp() / (2 * arb.pi().sqrt())


def _along(u: arb, sin_i: arb, cos_i: arb) -> arb:
    """The marginal's quantile u > 0: its integral up to the slope is u times that up to cot(theta)."""
    if sin_i == 0:
        return _quantile(u)
    edge = cos_i / sin_i
    target = u * _marginal(edge, sin_i, cos_i)
    if not target > 0:
        raise Undecided(f"the projected area, a ball of {target.str(5)}")
    low = edge.min(ZERO).lower() - 1
    while not _marginal(low, sin_i, cos_i) < target:
        low = 2 * low
    return increasing_root(
        lambda x: _marginal(x, sin_i, cos_i) - target,
        lambda x: (cos_i - sin_i * x) * (-x * x).exp() / arb.pi().sqrt(),
        low,
        edge.upper(),
    )


def sample(u: Vector, wi: Vector, alpha: Vector) -> Vec3:
    """The micronormal of the slopes at the two quantiles.

    As u[0] -> 0 the slope along wi' falls to -infinity and the normal tends to (1, 0, 0) of the local frame; as u[1] -> 0,
    to (0, 1, 0). There is no common limit as both -> 0: by convention the two slopes are then alike, (1, 1, 0).
    """
    (sin_i, cos_i), azimuth = stretched_frame.incident(wi, alpha)
    level = (ONE if u[0] == 0 else ZERO, ONE if u[1] == 0 else ZERO, ZERO)
    if u[0] == 0 or u[1] == 0:
        return stretched_frame.micronormal(level, azimuth, alpha)
    slope = -_along(u[0], sin_i, cos_i), -_quantile(u[1])
    return stretched_frame.micronormal((*slope, ONE), azimuth, alpha)


def pdf(wm: Vector, wi: Vector, alpha: Vector) -> arb:
    """max(0, wi.m) D(m) / sigma(wi) [1/sr]. heitz2014 (5)."""
    if not sphere.front(wm, wi):
        return arb(0)
    return cosine(wi, wm) * ndf.beckmann(wm, alpha) / masking.sigma_beckmann(normalise(wi), alpha)
