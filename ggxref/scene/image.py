"""Pictures for people (PNG) and for programs (NumPy float64)."""

import io
from pathlib import Path

import matplotlib
import numpy as np

from ggxref.files import write_atomically


def to_bytes(radiance: np.ndarray, exposure: float = 1.0) -> np.ndarray:
    """Radiance as sRGB's 8 bits, clipped at 1: (h, w) to (h, w), uint8."""
    linear = np.clip(np.asarray(radiance) * exposure, 0, 1)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(encoded * 255).astype(np.uint8)


def png(radiance: np.ndarray, exposure: float = 1.0) -> bytes:
    """A grey PNG of a picture of one band."""
    from PIL import Image  # matplotlib's own reader and writer of pictures

    file = io.BytesIO()
    Image.fromarray(to_bytes(radiance, exposure)).save(file, "png", optimize=True)
    return file.getvalue()


def write(path: Path, radiance: np.ndarray, exposure: float = 1.0) -> None:
    """`path`.png and `path`.npy, each whole or not at all."""
    array = io.BytesIO()
    np.save(array, np.asarray(radiance, np.float64))
    write_atomically(path.with_suffix(".png"), png(radiance, exposure))
    write_atomically(path.with_suffix(".npy"), array.getvalue())


def figure_bytes(figure: "matplotlib.figure.Figure", dpi: int = 100) -> bytes:
    """A matplotlib figure as PNG, quantised to 256 colours, without the date that would make its bytes vary."""
    from PIL import Image

    file = io.BytesIO()
    figure.savefig(file, dpi=dpi, format="png", metadata={"Software": None})
    small = io.BytesIO()
    Image.open(file).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(small, "png", optimize=True)
    return small.getvalue()
