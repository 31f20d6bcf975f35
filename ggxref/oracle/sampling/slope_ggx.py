"""Visible GGX normals through their slopes: heitz2014 algorithm 4.

In the stretched frame with wi' = (sin, 0, cos) of the angle theta, slopes are written as angles: the slope along wi' is
tan beta, the slope across it tan psi / cos beta.
"""

from flint import arb

from ggxref.oracle.linalg import Vec3, Vector
from ggxref.oracle.precision import root, sign
from ggxref.oracle.roots import increasing_root
from ggxref.oracle.sampling import cross_section, stretched_frame

pdf = cross_section.pdf


def _along(u: arb, sin_i: arb, cos_i: arb) -> tuple[arb, arb]:
    """(sin beta, cos beta) at the marginal's quantile u.

    (10) gives C2-(tan beta) = (cos_i + sin(beta + theta)) / (1 + cos_i), beta + theta in [theta - 90, 90] degrees. At u = 0
    the slope is -infinite.
    """
    if u == 0:
        return arb(-1), arb(0)
    total = u * (1 + cos_i) - cos_i  # sin(beta + theta)
    rest = root(1 - total**2)
    return total * cos_i - rest * sin_i, rest * cos_i + total * sin_i


def _across(u: arb) -> tuple[arb, arb]:
    """(sin psi, cos psi) at the conditional's quantile u: psi + sin psi cos psi = pi (u - 1/2).

    Solved for delta = 90 degrees - |psi|: delta - sin delta cos delta = pi min(u, 1 - u). At u = 0 the slope is -infinite.
    """
    half = sign(2 * u - 1)
    if half == 0:
        return arb(0), arb(1)
    if u == 0:
        return arb(-1), arb(0)
    area = arb.pi() * (u if half < 0 else 1 - u)
    delta = increasing_root(
        lambda x: x - (2 * x).sin() / 2 - area, lambda x: 2 * x.sin() ** 2, arb(0), arb.pi().upper() / 2
    )
    return half * delta.cos(), delta.sin()


def sample(u: Vector, wi: Vector, alpha: Vector) -> Vec3:
    """The micronormal of the slopes at the two quantiles.

    In the local frame it is (-sin beta cos psi, -sin psi, cos beta cos psi), which also holds the limits: (cos psi,
    -sin psi, 0) as u[0] -> 0, and (0, 1, 0) as u[1] -> 0 whatever u[0] is.
    """
    (sin_i, cos_i), azimuth = stretched_frame.incident(wi, alpha)
    (sin_b, cos_b), (sin_p, cos_p) = _along(u[0], sin_i, cos_i), _across(u[1])
    return stretched_frame.micronormal((-sin_b * cos_p, -sin_p, cos_b * cos_p), azimuth, alpha)
