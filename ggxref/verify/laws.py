"""Exact distribution functions of micronormals: each law maps the samples of one density to the uniform unit square.

The map is Rosenblatt's, (F(x), F(y | x)), in the coordinates where the density is flattest; so a test of uniformity
keeps its power at α = 0.005 and at 89.9°. Written from the densities, in NumPy; it shares nothing with the samplers.
Micronormals are (n, 3), results (n, 2).
"""

import numpy as np
from scipy.special import erf

from ggxref.verify import charts


def _slopes(wm, wi, alpha):
    """Slopes in units of α, x̃ along the stretched azimuth of wi."""
    x, y = -wm[:, 0] / wm[:, 2] / alpha[0], -wm[:, 1] / wm[:, 2] / alpha[1]
    cos, sin = charts.azimuth(wi, alpha)
    return cos * x + sin * y, cos * y - sin * x


def _stretched(wi, alpha):
    """(sin, cos) of the stretched incidence."""
    x, y, z = charts.unit(charts.diagonal(alpha) @ wi)
    return np.hypot(x, y), z


def _latitude(sin):
    """Distribution function of cos² φ over the half circle, from sin φ."""
    return 0.5 + (np.arcsin(sin) + sin * np.sqrt((1 - sin) * (1 + sin))) / np.pi


def ellipsoid_visible(wm: np.ndarray, wi: np.ndarray, A: np.ndarray) -> np.ndarray:
    """max(0, wi·m) D(m; A): longitude and latitude of A⁻ᵀm in the lune that wi sees."""
    rows, angle = charts.frame(A @ wi, A[:, 2])
    x, y, z = rows @ charts.unit(wm @ np.linalg.inv(A)).T
    longitude = np.sin(np.arctan2(x, z))
    return np.stack([(longitude + np.cos(angle)) / (1 + np.cos(angle)), _latitude(np.clip(y, -1, 1))], axis=-1)


def ggx_visible(wm: np.ndarray, wi: np.ndarray, alpha) -> np.ndarray:
    """max(0, wi·m) D(m) of GGX."""
    return ellipsoid_visible(wm, wi, charts.diagonal(alpha))


def beckmann_visible(wm: np.ndarray, wi: np.ndarray, alpha) -> np.ndarray:
    """max(0, wi·m) D(m) of Beckmann: x̃ has density (cos - sin x̃) exp(-x̃²), and ỹ is Gaussian."""
    x, y = _slopes(wm, wi, alpha)
    sin, cos = _stretched(wi, alpha)

    def below(slope):
        return cos * (1 + erf(slope)) / 2 + sin * np.exp(-(slope**2)) / (2 * np.sqrt(np.pi))

    return np.stack([below(x) / below(charts.cotangent(wi, alpha)), (1 + erf(y)) / 2], axis=-1)


def ggx_normals(wm: np.ndarray, alpha) -> np.ndarray:
    """z D(m) of GGX: azimuth and sin² of the stretched normal."""
    x, y = _slopes(wm, charts.NORMAL, alpha)
    square = x**2 + y**2
    return np.stack([np.arctan2(-y, -x) / (2 * np.pi) % 1, square / (1 + square)], axis=-1)


def beckmann_normals(wm: np.ndarray, alpha) -> np.ndarray:
    """z D(m) of Beckmann."""
    x, y = _slopes(wm, charts.NORMAL, alpha)
    return np.stack([np.arctan2(-y, -x) / (2 * np.pi) % 1, -np.expm1(-(x**2 + y**2))], axis=-1)


def v_cavity(wm: np.ndarray, wi: np.ndarray, alpha, distribution: str) -> np.ndarray:
    """2 ⟨wi,m⟩/(⟨wi,m⟩ + ⟨wi,m'⟩) z D(m): twice z D where only m is seen, (1 - x̃ tan θ) z D where both are."""
    x, y = _slopes(wm, wi, alpha)
    sin, cos = _stretched(wi, alpha)
    edge = charts.cotangent(wi, alpha)
    if distribution == "ggx":
        whole, moment = (lambda s: (1 + s / np.hypot(1, s)) / 2), (lambda s: -0.5 / np.hypot(1, s))
        across = _latitude(y / np.sqrt(1 + x**2 + y**2))
    else:
        whole, moment = (lambda s: (1 + erf(s)) / 2), (lambda s: -np.exp(-(s**2)) / (2 * np.sqrt(np.pi)))
        across = (1 + erf(y)) / 2
    if np.isinf(edge):
        return np.stack([whole(x), across], axis=-1)
    both = 2 * whole(-edge) + whole(x) - whole(-edge) - sin / cos * (moment(x) - moment(-edge))
    return np.stack([np.where(x < -edge, 2 * whole(x), both), across], axis=-1)


def reflected_cap(wm: np.ndarray, wi: np.ndarray, A: np.ndarray, low: float) -> np.ndarray:
    """Micronormals whose reflection in sphere space is uniform on the cap z' > low about A n: its azimuth and height."""
    rows, _ = charts.frame(A[:, 2], charts.NORMAL)
    i, m = rows @ charts.unit(A @ wi), charts.unit(wm @ np.linalg.inv(A)) @ rows.T
    o = 2 * (m @ i)[:, None] * m - i
    return np.stack([np.arctan2(o[:, 1], o[:, 0]) / (2 * np.pi) % 1, (o[:, 2] - low) / (1 - low)], axis=-1)
