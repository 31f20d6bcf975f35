"""The surfaces and directions that the checks share: smooth, rough and anisotropic; normal, oblique, grazing, below."""

import numpy as np

from ggxref.verify.charts import unit

# Smooth to rougher than the unit hemisphere, each anisotropic pair once the other way round so that axes cannot swap.
ALPHAS = np.array([[1e-4, 1e-4], [0.01, 0.01], [0.05, 0.4], [0.5, 0.1], [0.8, 0.8], [1.0, 1.0], [2.0, 0.7]])


def direction(degrees: float | int, azimuth: float | int = 0.7) -> np.ndarray:
    theta = np.radians(degrees)
    return np.array([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)])


UP = np.array([[0.0, 0.0, 1.0], direction(30), direction(60, 2.0), direction(85, -2.5), direction(89.9, 4.0)])
BELOW = np.array([direction(95), direction(120, 3.0)])
ALL = np.concatenate([UP, BELOW])


def rotation(axis: int, angle: float | int) -> np.ndarray:
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    R = np.eye(3)
    R[i, i] = R[j, j] = np.cos(angle)
    R[j, i] = np.sin(angle)
    R[i, j] = -R[j, i]
    return R


def shape(alpha, angles) -> np.ndarray:
    """A = S Rx Ry Rz from the matrices of walter2014 (2), (3)."""
    return np.diag([*alpha, 1.0]) @ rotation(0, angles[0]) @ rotation(1, angles[1]) @ rotation(2, angles[2])


# Skew tilts the ellipsoid off n: only there is ‖A n‖ ≠ 1. The last two are a mirror image of another size, and a
# general matrix.
SHAPES = np.array(
    [
        shape([0.5, 0.1], [0, 0, 0]),
        shape([0.01, 0.02], [0.01, -0.015, 0.4]),
        shape([0.3, 0.6], [0.3, -0.2, 0.9]),
        -3.0 * shape([0.05, 0.4], [-0.1, 0.25, 0.3]),
        np.array([[0.5, 0.1, 0.3], [-0.2, 0.8, 0.1], [0.1, -0.3, 1.4]]),
    ]
)


def pairs(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every element of `first` with every element of `second`."""
    return np.repeat(first, len(second), axis=0), np.concatenate([second] * len(first))


def triples(first: np.ndarray, second: np.ndarray, third: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Every combination of three elements."""
    i, j, k = np.meshgrid(*(np.arange(len(a)) for a in (first, second, third)), indexing="ij")
    return first[i.ravel()], second[j.ravel()], third[k.ravel()]


def sphere(n: int) -> np.ndarray:
    """`n` directions spread evenly over the sphere (Fibonacci's spiral)."""
    k = np.arange(n) + 0.5
    phi = np.pi * (3 - np.sqrt(5)) * k
    z = 1 - 2 * k / n
    return unit(np.stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z], axis=-1))


def hemisphere(n: int) -> np.ndarray:
    """`n` directions above the horizon."""
    return sphere(2 * n)[:n]
