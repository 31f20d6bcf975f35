"""The frame of heitz2014 algorithm 4: the configuration stretched to alpha = 1, and turned so that wi' = (sin, 0, cos)."""

from flint import arb

from ggxref.oracle.linalg import ONE, ZERO, Vec3, Vector, norm, normalise
from ggxref.oracle.sampling import sphere

Pair = tuple[arb, arb]


def incident(wi: Vector, alpha: Vector) -> tuple[Pair, Pair]:
    """(sin, cos) of the angle of the stretched wi, and (cos, sin) of its azimuth, (1, 0) at normal incidence."""
    x, y, z = sphere.incident(wi, sphere.stretch(alpha))
    s = norm((x, y, ZERO))
    return (s, z), (ONE, ZERO) if s == 0 else (x / s, y / s)


def micronormal(m: Vector, azimuth: Pair, alpha: Vector) -> Vec3:
    """The normal m of that frame turned back and unstretched. Steps 3 to 5, on (-slope, 1) instead of the slope."""
    (x, y, z), (cos, sin), (ax, ay) = m, azimuth, alpha
    return normalise((ax * (cos * x - sin * y), ay * (sin * x + cos * y), z))
