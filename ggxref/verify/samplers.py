"""Checks that every sampler shares: it follows its law, and its density is the Jacobian of its map."""

import numpy as np

from ggxref.verify import cases
from ggxref.verify.engine import Stream, relative
from ggxref.verify.statistics import uniform_square

# Where visible normals are hardest to test: a sharp lobe, at normal incidence and grazing; strong anisotropy; α > 1;
# and from below the horizon, where only the steepest micronormals are seen.
VISIBLE = [
    (cases.direction(0), np.array([0.01, 0.01])),
    (cases.direction(89.9, 1.0), np.array([0.005, 0.005])),
    (cases.direction(85, -2.5), np.array([0.05, 0.4])),
    (cases.direction(60, 2.0), np.array([0.8, 0.8])),
    (cases.direction(30), np.array([2.0, 0.7])),
    (cases.direction(110, 4.0), np.array([0.5, 0.3])),
]
ABOVE = VISIBLE[:-1]
ELLIPSOIDS = [
    (cases.direction(0), cases.SHAPES[2]),
    (cases.direction(89.9, 1.0), cases.SHAPES[1]),
    (cases.direction(85, -2.5), cases.SHAPES[3]),
    (cases.direction(60, 2.0), cases.SHAPES[4]),
    (cases.direction(110, 4.0), cases.SHAPES[0]),
]
NORMALS = [(alpha,) for alpha in cases.ALPHAS[1:]]


def follows(sample, *, law, cases, stream: Stream, numbers: int = 2, thin: int = 1, **policy) -> float:
    """Unlikeliness of the samples under the exact law, which maps them to the uniform unit square.

    `thin` divides the number of samples, for samplers that cost more.
    """
    n = stream.samples // thin
    v = [law(sample(stream.uniform(n, numbers), *case, **policy), *case, **policy) for case in cases]
    return uniform_square(np.array(v))


def second_tangent(w: np.ndarray) -> np.ndarray:
    """Second row of the frame of Duff et al. 2017, which the library's lune sampler takes at normal incidence."""
    s = np.copysign(1, w[2])
    a = -1 / (s + w[2])
    return np.array([w[0] * w[1] * a, s + w[1] ** 2 * a, -w[1]])


def lattice(n: int) -> np.ndarray:
    """`n` points spread evenly over the open unit square (the R2 sequence)."""
    k = np.arange(1, n + 1)[:, None]
    return (0.5 + k * np.array([0.7548776662466927, 0.5698402909980532])) % 1


def on_lattice(cases, n: int) -> list[np.ndarray]:
    """u, wi, and the shape for `n` points in every case, as one batch."""
    u = lattice(n)
    rows = [np.broadcast_to(np.asarray(x), (n, *np.shape(x))) for case in cases for x in case]
    per_case = len(cases[0])
    return [np.concatenate([u] * len(cases)), *(np.concatenate(rows[k::per_case]) for k in range(per_case))]


def density_is_jacobian(pdf, sample, *, cases) -> float:
    """|∂m/∂u| pdf(m) = 1 at m = sample(u): the density of the map, by differentiating the map itself."""
    u, wi, shape = on_lattice(cases, 512)
    return relative(pdf(sample(u, wi, shape), wi, shape) * sample.area_ratio(0)(u, wi, shape), 1)
