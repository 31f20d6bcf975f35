"""What the scene experiments share: numbers into arrays, a line of results, fireflies, a panel of pictures."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from ggxref.files import write_atomically
from ggxref.scene import image
from ggxref.scene.materials import Rows
from ggxref.scene.render import Picture


def still(*values):
    """One number or a vector, for the renderer."""
    return jnp.asarray(values[0] if len(values) == 1 else values, jnp.float32)


def row(alpha, *, eta=1.5, k=0.0, f0=1.0, A=None) -> Rows:
    """One material's parameters."""
    shape = np.diag([*alpha, 1.0]) if A is None else A
    columns = {"alpha": alpha, "A": shape, "turn": (1.0, 0.0), "eta": eta, "k": k, "f0": f0, "albedo": 0.0}
    arrays = {name: jnp.asarray([column], jnp.float32) for name, column in columns.items()}
    number = jnp.zeros(1, jnp.int32)
    return Rows(**arrays, g2=number, fresnel=number, trigonometry=number, precision=number)


def say(case: str, **numbers) -> None:
    """One line: the case and its numbers."""
    shown = (
        f"{name} {value:.4g}" if isinstance(value, float) else f"{name} {value}" for name, value in numbers.items()
    )
    print(f"{case}: {', '.join(shown)}", flush=True)


def work(picture: Picture) -> float:
    """Variance of a sample times its time [ns]: the time that a given error takes."""
    return float(picture.variance.mean()) * picture.seconds / (picture.samples * picture.mean.size) * 1e9


def fireflies(picture: Picture, truth: Picture) -> int:
    """Pixels brighter than the converged picture by a tenth of its mean and by a half of their own truth."""
    excess = picture.mean - truth.mean
    return int(((excess > 0.1 * truth.mean.mean()) & (excess > 0.5 * truth.mean)).sum())


def error_map(path: Path, found: dict[str, Picture], truth: Picture, title: str) -> None:
    """The pictures, and below each its error in units of the truth's mean."""
    figure = Figure(figsize=(3.2 * len(found), 4.2), layout="constrained")
    figure.suptitle(title, fontsize=9)
    panels = figure.subplots(2, len(found))
    for (name, picture), (above, below) in zip(found.items(), panels.T, strict=True):
        above.imshow(image.to_bytes(picture.mean), cmap="gray", vmin=0, vmax=255)
        above.set_title(f"{name}, {picture.samples} samples a pixel", fontsize=8)
        below.imshow((picture.mean - truth.mean) / truth.mean.mean(), cmap="RdBu", vmin=-0.1, vmax=0.1)
        below.set_title("error, ±10 % of the mean", fontsize=8)
    for panel in panels.flat:
        panel.set_axis_off()
    write_atomically(path, image.figure_bytes(figure))
