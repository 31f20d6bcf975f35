"""A height field as a NumPy `.npy` array of metres, (ny, nx); the pixel size comes from the user."""

import io
import warnings
from contextlib import contextmanager
from tokenize import TokenError

import numpy as np

from ggxref.errors import InputError
from ggxref.fit.data import Heights, Source, check_pixel

BROKEN = (
    ValueError,
    KeyError,
    SyntaxError,
    TypeError,
    RecursionError,
    MemoryError,
    EOFError,
    TokenError,
    IndexError,
    OverflowError,
)
"""The header is a Python literal, so that a broken one fails in as many ways as a parser has."""

MAGIC = b"\x93NUMPY"


def recognise(content: bytes) -> bool:
    return content.startswith(MAGIC)


def parse(content: bytes, source: Source, pixel: tuple[float, float] | None) -> Heights:
    if pixel is None:
        raise InputError(f"{source.path}: an .npy file does not say its pixel size; give it, in metres")
    check_pixel(source.path, pixel)
    shape, dtype, start = _header(content, source.path)
    if len(shape) != 2 or min(shape) < 3 or dtype.kind not in "fiu" or dtype.itemsize > 8:
        raise InputError(
            f"{source.path}: an array {shape} of {dtype}; need two dimensions, 3 or more a side, of real numbers"
        )
    # Python's integers do not overflow: no size is too absurd to be compared.
    due = int(shape[0]) * int(shape[1]) * dtype.itemsize
    if due != len(content) - start:
        raise InputError(f"{source.path}: {len(content) - start} bytes of data where {shape} of {dtype} takes {due}")
    with _quiet():
        heights = np.load(io.BytesIO(content), allow_pickle=False).astype(np.float64)
    return Heights(np.where(np.isfinite(heights), heights, np.nan), pixel, source)


@contextmanager
def _quiet():
    """Without NumPy's advice on headers that Python 2 wrote, and on casts of what is no number."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        yield


def _header(content: bytes, path: str) -> tuple[tuple[int, ...], np.dtype, int]:
    stream = io.BytesIO(content)
    try:
        with _quiet():
            version = np.lib.format.read_magic(stream)
            read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[version]
            shape, _, dtype = read(stream)
    except BROKEN as error:
        said = str(error).splitlines()[0] if str(error) else repr(error)
        raise InputError(f"{path}: broken .npy header: {said[:200]}") from error
    return shape, dtype, stream.tell()
