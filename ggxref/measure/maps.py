"""Maps over two parameters: digits that a form loses, and the error of its gradient, cell by cell."""

from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from ggxref.measure.accuracy import DTYPES, arguments, compiled, errors, exact
from ggxref.measure.doubledouble import DD
from ggxref.measure.regions import Points, rounded, skewed

POINTS = 64  # to a cell: quantiles of so many errors are steady, and a map takes seconds


@dataclass(frozen=True)
class Axis:
    """A parameter of a map: its name with the unit, and its values."""

    label: str
    values: np.ndarray
    logarithmic: bool = True


ALPHA = Axis("α", np.geomspace(1e-4, 10, 26))
THETA = Axis(
    "θ [°]", np.concatenate([np.geomspace(0.01, 10, 8), np.linspace(20, 80, 7), 90 - np.geomspace(8, 1e-3, 9)]), False
)
RATIO = Axis("αx/αy", np.geomspace(1e-3, 1e3, 25))
SKEW = Axis("mean slope |e|", np.geomspace(1e-2, 30, 25))


def _direction(rng, theta):
    phi = rng.uniform(0, 2 * np.pi, theta.shape)
    s = np.sin(theta)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta)])


def _cells(first: Axis, second: Axis) -> tuple[np.ndarray, np.ndarray]:
    a, b = np.meshgrid(first.values, second.values, indexing="ij")
    return np.repeat(a.ravel(), POINTS), np.repeat(b.ravel(), POINTS)


def _arguments(rng, w, alpha, e) -> Points:
    """Both directions at the same inclination but for `wm`, which the density draws about n."""
    n = w.shape[1]
    u = rng.random((2, n))
    phi, r = 2 * np.pi * u[0], np.sqrt(u[1])
    m = np.stack([alpha[0] * r * np.cos(phi), alpha[1] * r * np.sin(phi), np.sqrt(1 - u[1])])
    return {
        "u": rng.random((2, n)),
        "x": rng.random(n),
        "w": w,
        "wi": w,
        "wo": _direction(rng, np.arccos(np.clip(w[2], -1, 1))),
        "wm": m / np.sqrt((m * m).sum(0)),
        "alpha": alpha,
        "A": skewed(alpha, e, np.zeros(n)),
    }


def points(first: Axis, second: Axis, seed: int = 0) -> Points:
    """Arguments for every cell: α × θ, α × αx/αy (at 60°), or skew × θ (at α = 0.3)."""
    rng = np.random.default_rng(seed)
    a, b = _cells(first, second)
    zero = np.zeros((2, a.size))
    if second is RATIO:
        root = np.sqrt(b)
        return _arguments(rng, _direction(rng, np.full(a.size, np.pi / 3)), np.stack([a * root, a / root]), zero)
    w = _direction(rng, np.radians(b))
    if first is SKEW:
        e = _direction(rng, np.full(a.size, np.pi / 2))[:2] * a
        return _arguments(rng, w, np.full((2, a.size), 0.3), e)
    return _arguments(rng, w, np.stack([a, a]), zero)


def digits_lost(
    function: Callable, reference: Callable, first: Axis, second: Axis, dtype: str = "f32"
) -> tuple[np.ndarray, np.ndarray]:
    """log10 of the error that 19 points of 20 in a cell stay below (ULP, or ε/2), and the share of faults (NaN, inf)."""
    args = _drawn(function, first, second, dtype)
    error, graded, _ = errors(compiled(function), reference, args, DTYPES[dtype])
    shape = len(first.values), len(second.values), POINTS
    error = np.where(graded, error, np.nan).reshape(shape)
    fault = np.isinf(error).mean(-1)
    # Half an ulp is what rounding the exact value costs: below that, no digit is lost.
    return np.log10(np.maximum(_quantile(error, 0.95), 0.5)), fault


def _quantile(error, q):
    """Of the graded points; NaN where none is."""
    some = ~np.isnan(error).all(-1)
    filled = np.where(np.isinf(error), 1e30, np.where(some[..., None], error, 0))
    return np.where(some, np.nanquantile(filled, q, axis=-1), np.nan)


def _drawn(function, first, second, dtype):
    drawn = rounded(points(first, second), DTYPES[dtype])
    return [drawn[name] for name in arguments(function)]


def _summed(function):
    """The sum of the components, so that a direction has one gradient too."""
    return lambda *args: jnp.sum(function(*args))


def gradient_error(
    function: Callable, reference: Callable, first: Axis, second: Axis, dtype: str = "f32"
) -> tuple[np.ndarray, np.ndarray]:
    """Relative error of ∂/∂α (norm over both) in each cell, log10 of the median, and the share that is not finite.

    The truth is the central difference of the double-double reference at a relative step of 2⁻³⁰: its own error, h²/6
    of the third derivative and 1e-32/h of rounding, stays below 1e-16.
    """
    names = arguments(function)
    args = _drawn(function, first, second, dtype)
    k = names.index("alpha")
    run = compiled(jax.grad(_summed(function), argnums=k))
    computed = run(*args).astype(np.float64)
    truth = np.stack([_slope(reference, args, k, axis) for axis in range(2)])
    size = np.sqrt((truth**2).sum(0))
    error = np.sqrt(((computed - truth) ** 2).sum(0)) / np.where(size > 0, size, 1)
    shape = len(first.values), len(second.values), POINTS
    fault = (~np.isfinite(computed)).any(0).reshape(shape).mean(-1)
    error = np.where(np.isfinite(error) & (size > 0), error, np.nan).reshape(shape)
    return np.log10(np.maximum(_quantile(error, 0.5), 1e-9)), fault


def _slope(reference, args, k, axis) -> np.ndarray:
    alpha = args[k].astype(np.float64)
    step = np.zeros_like(alpha)
    step[axis] = alpha[axis] * 2.0**-30
    above, below = (_total(exact(reference, [*args[:k], alpha + s * step, *args[k + 1 :]])) for s in (1, -1))
    width = (alpha + step)[axis] - (alpha - step)[axis]
    difference = above - below
    return difference.hi / width


def _total(value: DD) -> DD:
    """The sum of a direction's components; a scalar as it is."""
    if value.hi.ndim == 1:
        return value
    x, y, z = (DD(value.hi[k], value.lo[k]) for k in range(3))
    return x + y + z
