"""Deterministic quadrature over micronormals: nodes and weights with ∫ f dω ≈ Σ weight · f(node).

Each chart is a change of variables that flattens one family of distributions, so that a product of Gauss–Legendre
rules holds full precision at α = 1e-4 as at α = 1, and at grazing incidence. Its Jacobian is exact, so the sum is the
integral of whatever f is given, right or wrong; NumPy alone, nothing of the library.
"""

from collections.abc import Sequence

import numpy as np

NORMAL = np.array([0.0, 0.0, 1.0])


def gauss(edges: Sequence, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss–Legendre nodes and weights, `n` on each interval between neighbouring edges."""
    x, w = np.polynomial.legendre.leggauss(n)
    low, high = np.array(edges[:-1])[:, None], np.array(edges[1:])[:, None]
    return (low + (high - low) * (x + 1) / 2).ravel(), ((high - low) * w / 2).ravel()


def product(first: tuple, second: tuple) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The product rule of two rules: both coordinates and the weight, flat."""
    x, y = np.meshgrid(first[0], second[0], indexing="ij")
    return x.ravel(), y.ravel(), np.outer(first[1], second[1]).ravel()


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def dot(a, b):
    return np.sum(a * b, axis=-1)


def front(a, b):
    """The clamped product ⟨a, b⟩."""
    return np.maximum(dot(a, b), 0)


def diagonal(alpha) -> np.ndarray:
    """The shape matrix of anisotropic GGX, diag(αx, αy, 1)."""
    return np.diag([*alpha, 1.0])


def frame(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, float]:
    """Orthonormal rows (e1, e2, e3) and the angle from u to v: e3 along u, e1 the perpendicular nearest to v."""
    e3, other = unit(u), unit(v)
    cross = np.cross(e3, other)
    sin = np.linalg.norm(cross)
    if sin == 0:
        cross = np.cross(np.eye(3)[np.argmin(np.abs(e3))], e3)  # at n: e1 = -x, e2 = -y, the axes of the slopes
    e2 = unit(cross)
    return np.stack([np.cross(e2, e3), e2, e3]), float(np.arctan2(sin, e3 @ other))


def lune(u: np.ndarray, v: np.ndarray, A: np.ndarray, n: int = 24, breaks: Sequence = ()):
    """Micronormals with m·u > 0 and m·v > 0, by longitude and latitude of A⁻ᵀm about the lune's two corners.

    GGX and ellipsoid densities are polynomials of sines there, whatever their shape. `breaks` are longitudes, counted
    from Au towards Av, where the integrand has a kink. Returns nodes (N, 3) and weights (N,).
    """
    rows, angle = frame(A @ u, A @ v)
    edges = sorted([angle - np.pi / 2, np.pi / 2, *(b for b in breaks if angle - np.pi / 2 < b < np.pi / 2)])
    psi, phi, weight = product(gauss(edges, n), gauss([-np.pi / 2, np.pi / 2], n))
    local = np.stack([np.cos(phi) * np.sin(psi), np.sin(phi), np.cos(phi) * np.cos(psi)], axis=-1)
    return spread(local @ rows, weight * np.cos(phi), A)


def spread(sphere: np.ndarray, weight: np.ndarray, A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes on the unit sphere carried to micronormals m = Aᵀs/‖Aᵀs‖; the solid angle changes by |det A|/‖Aᵀs‖³."""
    m = sphere @ A
    length = np.linalg.norm(m, axis=-1)
    return m / length[:, None], weight * np.abs(np.linalg.det(A)) / length**3


# exp(-x²) is below 1e-18 of its integral beyond this, less than half a unit in the last place of the sum.
_GAUSSIAN_REACH = 6.5


def slopes(x: np.ndarray, y: np.ndarray, weight: np.ndarray, wi: np.ndarray, alpha) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of the slope plane, in units of α and with x̃ along the stretched azimuth of wi, carried to micronormals."""
    cos, sin = azimuth(wi, alpha)
    slope = np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1) * np.asarray(alpha)
    m = unit(np.concatenate([-slope, np.ones((len(x), 1))], axis=-1))
    return m, weight * alpha[0] * alpha[1] * m[:, 2] ** 3


def azimuth(wi: np.ndarray, alpha) -> np.ndarray:
    """Azimuth of (αx x, αy y) as (cos, sin); (1, 0) at normal incidence."""
    flat = np.asarray(alpha) * wi[:2]
    length = np.hypot(*flat)
    return flat / length if length > 0 else np.array([1.0, 0.0])


def cotangent(wi: np.ndarray, alpha) -> float:
    """Steepest slope along the azimuth that the stretched wi sees: z / ‖(αx x, αy y)‖."""
    flat = np.hypot(alpha[0] * wi[0], alpha[1] * wi[1])
    return float(wi[2] / flat) if flat > 0 else np.inf


def gaussian(wi: np.ndarray, alpha, n: int = 48, breaks: Sequence = ()):
    """Micronormals that `wi` sees, by slope, for densities that fall off as Beckmann's: nodes (N, 3), weights (N,)."""
    top = min(cotangent(wi, alpha), _GAUSSIAN_REACH)
    bottom = min(-_GAUSSIAN_REACH, top - _GAUSSIAN_REACH)
    edges = sorted([bottom, top, *(b for b in breaks if bottom < b < top)])
    # Equal steps of h integrate exp(-y²) to exp(-π²/h²): 7e-17 at 33 points.
    across = np.linspace(-_GAUSSIAN_REACH, _GAUSSIAN_REACH, 33)
    x, y, weight = product(gauss(edges, n), (across, np.full(33, across[1] - across[0])))
    return slopes(x, y, weight, wi, alpha)


def student(alpha, gamma: float, n: int = 40):
    """All micronormals, by polar slope, for densities with the tail of Student-t: nodes (N, 3), weights (N,)."""
    t, phi, weight = product(gauss([0, 1], n), gauss([0, 2 * np.pi], n))
    # t is the radial distribution function, 1 - (1 + r²/(γ-1))^(1-γ).
    r = np.sqrt((gamma - 1) * np.expm1(-np.log1p(-t) / (gamma - 1)))
    area = (1 + r**2 / (gamma - 1)) ** gamma / 2  # r dr/dt
    return slopes(r * np.cos(phi), r * np.sin(phi), weight * area, NORMAL, alpha)


def integrals(f, rules: Sequence[tuple[np.ndarray, np.ndarray]], *arguments) -> np.ndarray:
    """∫ f(m, argument, …) dω by one rule a case; `arguments` hold one row a case. All cases go to `f` in one batch."""
    counts = [len(weight) for _, weight in rules]
    rows = [np.repeat(a, counts, axis=0) for a in arguments]
    values = np.concatenate([w for _, w in rules]) * f(np.concatenate([m for m, _ in rules]), *rows)
    return np.array([part.sum() for part in np.split(values, np.cumsum(counts)[:-1])])


def surface(u: np.ndarray, v: np.ndarray, A: np.ndarray, n: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """The ellipsoid {x : |A x| = 1} where m·u > 0 and m·v > 0: micronormals (N, 3) and weights of surface area (N,).

    The area element is the cross product of the tangents of a parameterisation, the normal is the gradient's: no
    identity of the paper is assumed.
    """
    rows, angle = frame(A @ u, A @ v)
    psi, phi, weight = product(gauss([angle - np.pi / 2, np.pi / 2], n), gauss([-np.pi / 2, np.pi / 2], n))
    cos, sin, zero = np.cos(phi), np.sin(phi), 0 * phi
    point = np.stack([cos * np.sin(psi), sin, cos * np.cos(psi)], -1)
    along = np.stack([cos * np.cos(psi), zero, -cos * np.sin(psi)], -1)
    across = np.stack([-sin * np.sin(psi), cos, -sin * np.cos(psi)], -1)
    inverse = np.linalg.inv(A)
    x, along, across = (p @ rows @ inverse.T for p in (point, along, across))
    return unit(x @ (A.T @ A)), weight * np.linalg.norm(np.cross(along, across), axis=-1)
