"""What the user types, made into numbers: `--fix NAME=VALUE` and `--pixel DX,DY`."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from ggxref import ellipsoid
from ggxref.errors import InputError
from ggxref.fit import solver


def fixed(words: Sequence[str]) -> dict[str, float]:
    """Parameters to hold. `A=` and nine numbers, row by row, holds the whole shape."""
    held: dict[str, float] = {}
    for word in words:
        name, equals, value = word.partition("=")
        if not equals:
            raise InputError(f"--fix {word!r}; need NAME=VALUE, as in alpha=0.1")
        held |= _shape(_numbers("--fix A", value, 9)) if name == "A" else {name: _numbers(f"--fix {name}", value, 1)[0]}
    return held


def pixel(word: str | None) -> tuple[float, float] | None:
    """The pixel size (dx, dy) in metres, from one number or two."""
    if word is None:
        return None
    numbers = _numbers("--pixel", word, 1 + word.count(","))
    if len(numbers) > 2:
        raise InputError(f"--pixel {word!r}; need one size in metres, or two: dx,dy")
    return numbers[0], numbers[-1]


def _numbers(option: str, text: str, count: int) -> list[float]:
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        raise InputError(f"{option}: got {text!r}; need {count} number{'s' if count > 1 else ''}, separated by commas")
    return numbers


SINGULAR = 1e-12


def _shape(entries: list[float]) -> dict[str, float]:
    """The canonical parameters of a shape matrix."""
    A = np.array(entries).reshape(3, 3)
    singular_values = np.linalg.svd(A, compute_uv=False) if np.isfinite(A).all() else np.zeros(3)
    if not singular_values[-1] > SINGULAR * singular_values[0]:
        raise InputError(f"--fix A: {A.tolist()} is singular; the ellipsoid |A x| = 1 would have no volume")
    with solver.float64():
        (alpha_x, shear, _), (_, alpha_y, _), (e_x, e_y, _) = np.asarray(ellipsoid.canonical(jnp.asarray(A))).tolist()
    return {"alpha_x": alpha_x, "alpha_y": alpha_y, "shear": shear, "mean_x": -e_x, "mean_y": -e_y}
