"""Statistical tests whose false alarms are counted: one probability per check, corrected for the tests inside it."""

import numpy as np
from scipy import stats

# A check's error is -log10 of its probability; above this a sampler that follows its law is rejected once in a million
# runs of the check, so once in 10^4 runs of a hundred such checks.
FALSE_ALARM = 6.0

# 256 cells hold 256 samples each at the default 2^16: far beyond the five that the χ² approximation wants.
CELLS = 16
_SMALLEST = 1e-300


def kolmogorov_smirnov(v: np.ndarray) -> float:
    """Probability that `n` uniform numbers stray as far from their distribution function (asymptotic law)."""
    v = np.sort(v)
    n = len(v)
    steps = np.arange(n)
    distance = max(np.max((steps + 1) / n - v), np.max(v - steps / n))
    return float(stats.kstwobign.sf(np.sqrt(n) * distance))


def chi_square(v: np.ndarray) -> float:
    """Probability that points (n, 2), uniform on the unit square, spread as unevenly over a grid of cells."""
    counts, _, _ = np.histogram2d(v[:, 0], v[:, 1], bins=CELLS, range=[[0, 1], [0, 1]])
    expected = len(v) / CELLS**2
    return float(stats.chi2.sf(np.sum((counts - expected) ** 2) / expected, CELLS**2 - 1))


def unlikeliness(probabilities) -> float:
    """-log10 of the smallest probability after Bonferroni's correction for their number; 300 where it underflows."""
    p = np.asarray(probabilities, float)
    if not np.all(np.isfinite(p)):
        return np.inf
    return float(-np.log10(max(_SMALLEST, p.min() * p.size))) if p.min() * p.size < 1 else 0.0


def uniform_square(v: np.ndarray) -> float:
    """Unlikeliness of points (cases, n, 2) under the uniform law of the unit square: both marginals and the cells."""
    if not np.all((v >= 0) & (v <= 1)):
        return np.inf
    return unlikeliness([[kolmogorov_smirnov(c[:, 0]), kolmogorov_smirnov(c[:, 1]), chi_square(c)] for c in v])


def same_law(first, second) -> float:
    """Unlikeliness of two lists of points (n, 2), a case each, under common laws: both coordinates' two-sample distance."""
    pairs = [(a[:, k], b[:, k]) for a, b in zip(first, second, strict=True) for k in (0, 1)]
    return unlikeliness([_two_samples(a, b) for a, b in pairs])


def _two_samples(a, b):
    """Smirnov's test by its asymptotic law."""
    a, b = np.sort(a), np.sort(b)
    both = np.concatenate([a, b])
    distance = np.abs(np.searchsorted(a, both, "right") / len(a) - np.searchsorted(b, both, "right") / len(b)).max()
    return stats.kstwobign.sf(distance * np.sqrt(len(a) * len(b) / (len(a) + len(b))))


def unlikely_mean(values: np.ndarray, expected: np.ndarray) -> float:
    """Unlikeliness of the means of values (cases, n) about `expected` (cases,), by the central limit theorem."""
    # Values that are all alike have no spread: their mean then has to be exact to rounding.
    error = np.maximum(1e-12, values.std(axis=-1) / np.sqrt(values.shape[-1]))
    return unlikely_difference(values.mean(axis=-1) - expected, error)


def unlikely_difference(difference: np.ndarray, error: np.ndarray) -> float:
    """Unlikeliness of normal deviates with mean 0 and that standard error."""
    return unlikeliness(2 * stats.norm.sf(np.abs(difference) / error))
