"""Where functions are measured: seeded points of each region, as float64 components (rows first, points last).

A region gives every argument that a public function may ask for, by the argument's name.
"""

from collections.abc import Callable

import numpy as np

Points = dict[str, np.ndarray]


def _log_uniform(rng, low, high, *shape):
    return np.exp(rng.uniform(np.log(low), np.log(high), shape))


def _unit(v):
    return v / np.sqrt((v * v).sum(0))


def _at_height(rng, z):
    phi = rng.uniform(0, 2 * np.pi, z.shape)
    s = np.sqrt((1 - z) * (1 + z))
    return np.stack([s * np.cos(phi), s * np.sin(phi), z])


def _at_sine(rng, s):
    phi = rng.uniform(0, 2 * np.pi, s.shape)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.sqrt((1 - s) * (1 + s))])


def _lobe(rng, alpha):
    n = alpha.shape[1]
    phi, u = rng.uniform(0, 2 * np.pi, n), rng.random(n)
    r = np.sqrt(u)
    return _unit(np.stack([alpha[0] * r * np.cos(phi), alpha[1] * r * np.sin(phi), np.sqrt(1 - u)]))


def _reflected(w, m):
    return 2 * (w * m).sum(0) * m - w


def skewed(alpha: np.ndarray, e: np.ndarray, shear: np.ndarray) -> np.ndarray:
    """Canonical shape matrices [[αx, shear αx, 0], [0, αy, 0], [ex, ey, 1]]: (3, 3, n)."""
    zero, one = np.zeros_like(alpha[0]), np.ones_like(alpha[0])
    rows = [alpha[0], shear * alpha[0], zero, zero, alpha[1], zero, e[0], e[1], one]
    return np.stack(rows).reshape(3, 3, -1)


def _complete(rng, wi, wm, alpha, e=None) -> Points:
    """All arguments from a pair of directions and a roughness; `wo` mirrors `wi` where that stays above the horizon."""
    n = alpha.shape[1]
    wo = _reflected(wi, wm)
    wo = np.where(wo[2] > 1e-6, wo, _at_height(rng, rng.uniform(0.01, 1, n)))
    A = skewed(alpha, rng.normal(size=(2, n)) * 0.3 if e is None else e, rng.normal(size=n) * 0.3)
    eta = _log_uniform(rng, 0.3, 3, n)
    cosine = np.clip((wi * wm).sum(0), -1, 1)
    return {
        "u": rng.random((2, n)),
        "w": wi,
        "wi": wi,
        "wo": wo,
        "wm": wm,
        "slope": -wm[:2] / np.where(wm[2] > 0, wm[2], 1),
        "v": wm,
        "alpha": alpha,
        "A": A,
        "M": A,
        "size": _log_uniform(rng, 0.1, 10, n),
        "gamma": rng.uniform(1.2, 20, n),
        "cos_i": cosine,
        "eta": eta,
        "k": _log_uniform(rng, 0.1, 8, n),
        "f0": rng.random(n),
        "n_i": eta,
        "n_o": np.ones(n),
        "g1_i": rng.random(n),
        "g1_o": rng.random(n),
        "x": rng.random(n),
    }


def _upper(rng, n):
    return _at_height(rng, rng.uniform(0.15, 1, n))


def typical(rng, n) -> Points:
    """θ below 80°, α log-uniform in [0.05, 1], any micronormal of the upper side."""
    return _complete(rng, _upper(rng, n), _upper(rng, n), _log_uniform(rng, 0.05, 1, 2, n))


def lobe(rng, n) -> Points:
    """The micronormals that a renderer draws: from D cos, α in [0.001, 1]."""
    alpha = _log_uniform(rng, 1e-3, 1, 2, n)
    return _complete(rng, _upper(rng, n), _lobe(rng, alpha), alpha)


def grazing(rng, n) -> Points:
    """z of both directions log-uniform from 1e-6 (89.99994°) to 0.1."""
    wi, wm = (_at_height(rng, _log_uniform(rng, 1e-6, 0.1, n)) for _ in range(2))
    return _complete(rng, wi, wm, _log_uniform(rng, 0.01, 2, 2, n))


def near_normal(rng, n) -> Points:
    """Sines of both directions log-uniform from 1e-7 to 0.1."""
    wi, wm = (_at_sine(rng, _log_uniform(rng, 1e-7, 0.1, n)) for _ in range(2))
    return _complete(rng, wi, wm, _log_uniform(rng, 1e-3, 1, 2, n))


def perpendicular(rng, n) -> Points:
    """|ω_i·ω_m| log-uniform from 1e-9 to 1e-2, of either sign."""
    wm = _upper(rng, n)
    side = _unit(np.cross(wm, rng.normal(size=(3, n)), axis=0))
    wi = _unit(side + rng.choice([-1, 1], n) * _log_uniform(rng, 1e-9, 1e-2, n) * wm)
    wi = np.where(wi[2] < 0, _reflected(-wi, wm), wi)
    return _complete(rng, np.where(wi[2] < 0, -wi, wi), wm, _log_uniform(rng, 0.05, 1, 2, n))


def anisotropic(rng, n) -> Points:
    """One α from 1e-4 to 1e-2, the other from 0.1 to 2."""
    alpha = np.stack([_log_uniform(rng, 1e-4, 1e-2, n), _log_uniform(rng, 0.1, 2, n)])
    alpha = np.where(rng.random(n) < 0.5, alpha, alpha[::-1])
    return _complete(rng, _upper(rng, n), _lobe(rng, alpha), alpha)


def skew(rng, n) -> Points:
    """Mean slopes |e| from 0.1 to 10; `wm` near the skewed peak."""
    alpha, e = _log_uniform(rng, 0.02, 1, 2, n), rng.normal(size=(2, n))
    e = e / np.hypot(*e) * _log_uniform(rng, 0.1, 10, n)
    x, y, z = _lobe(rng, alpha)
    return _complete(rng, _upper(rng, n), _unit(np.stack([x + e[0] * z, y + e[1] * z, z])), alpha, e)


def smooth(rng, n) -> Points:
    """α from 1e-4 to 1e-2; micronormals in the lobe."""
    alpha = _log_uniform(rng, 1e-4, 1e-2, 2, n)
    return _complete(rng, _upper(rng, n), _lobe(rng, alpha), alpha)


def rough(rng, n) -> Points:
    """α from 1 to 10."""
    alpha = _log_uniform(rng, 1, 10, 2, n)
    return _complete(rng, _upper(rng, n), _lobe(rng, alpha), alpha)


def ordinals(rng, n) -> Points:
    """Uniform over exponents: the components x, y of the directions and α span many binades."""
    wi, wm = (_unit(np.stack([*_log_uniform(rng, 1e-8, 1, 2, n), _log_uniform(rng, 1e-6, 1, n)])) for _ in range(2))
    return _complete(rng, wi, wm, _log_uniform(rng, 1e-4, 10, 2, n)) | {"u": _ordinal_unit(rng, n)}


def _ordinal_unit(rng, n):
    """Numbers of [0, 1) crowded at both ends."""
    u = _log_uniform(rng, 1e-7, 1, 2, n)
    return np.where(rng.random((2, n)) < 0.5, u, 1 - u)


REGIONS: dict[str, Callable[[np.random.Generator, int], Points]] = {
    f.__name__: f
    for f in (typical, lobe, grazing, near_normal, perpendicular, anisotropic, skew, smooth, rough, ordinals)
}
DIRECTIONS = ("w", "wi", "wo", "wm", "v")


def rounded(points: Points, dtype) -> Points:
    """Points in `dtype`, directions within half an ulp of unit ones; a uniform number that rounds up to 1 becomes 1/2."""
    long = {name: _unit(value.astype(np.longdouble)) for name, value in points.items() if name in DIRECTIONS}
    with np.errstate(over="ignore"):  # float16 ends at 65504
        cast = {name: value.astype(dtype) for name, value in (points | long).items()}
    if "u" in cast:
        cast["u"] = np.where(cast["u"] < 1, cast["u"], np.asarray(0.5, dtype))
    return cast
