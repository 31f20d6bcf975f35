"""A height field as a matrix of text: rows of numbers, under a header that may say the size, the pixel and the unit.

The header lines known are `h=650 w=650`, `pixel size=3.7e-007 m` and `height conversion factor (-> m)=6.3e-008`. Without
a header the numbers are heights in metres and the pixel size comes from the user.
"""

import re

import numpy as np

from ggxref.errors import InputError
from ggxref.fit.data import Heights, Source, check_pixel

NUMBER = r"([-+0-9.eEnaif]+)"
SIZE = re.compile(r"^h\s*=\s*(\d+)\s+w\s*=\s*(\d+)\s*$", re.M)
PIXEL = re.compile(rf"^pixel size\s*=\s*{NUMBER}\s*(\S*)\s*$", re.M)
FACTOR = re.compile(rf"^height conversion factor[^=\n]*=\s*{NUMBER}\s*$", re.M)
LARGEST_SIDE = 2**16


def recognise(content: bytes) -> bool:
    """A size line at the start, or rows of more numbers than any table of reflectance has columns."""
    start = content[: 2**16].decode("latin-1")
    if "\0" in start:
        return False
    if SIZE.match(start):
        return True
    row = start.split("\n", 1)[0].replace(",", " ").split()
    return len(row) >= 32 and all(re.fullmatch(NUMBER, word) for word in row[:32])


def parse(content: bytes, source: Source, pixel: tuple[float, float] | None) -> Heights:
    text = content.decode("latin-1")
    header, body = _split(text)
    said = PIXEL.search(header)
    if pixel is None:
        if said is None:
            raise InputError(f"{source.path}: the file does not say its pixel size; give it, in metres")
        if said[2] != "m":
            raise InputError(f"{source.path}: pixel size in {said[2]!r}; need m")
        side = _number(said[1], "pixel size", source.path)
        pixel = side, side
    check_pixel(source.path, pixel)
    factor = FACTOR.search(header)
    scale = _number(factor[1], "height conversion factor", source.path) if factor else 1.0
    if not (np.isfinite(scale) and scale > 0):
        raise InputError(f"{source.path}: height conversion factor = {scale:g}; need a positive number of metres")
    return Heights(_numbers(body, _size(header, body, source.path), source.path) * scale, pixel, source)


def _split(text: str) -> tuple[str, str]:
    """The lines before the first row of plain numbers, and the rest."""
    start = 0
    for line in text.splitlines(keepends=True):
        words = line.replace(",", " ").split()
        if words and re.fullmatch(NUMBER, words[0]) and "=" not in line:
            break
        start += len(line)
    return text[:start], text[start:]


def _size(header: str, body: str, path: str) -> tuple[int, int]:
    said = SIZE.search(header)
    if said:
        ny, nx = int(said[1]), int(said[2])
    else:
        rows = [row for row in body.splitlines() if row.strip()]
        ny, nx = len(rows), len(rows[0].replace(",", " ").split()) if rows else 0
    # A number takes a character and a separator: a size beyond that is refused before memory is taken for it.
    if not (3 <= ny <= LARGEST_SIDE and 3 <= nx <= LARGEST_SIDE) or 2 * ny * nx - 1 > len(body):
        raise InputError(
            f"{path}: a matrix of {ny} x {nx} in {len(body)} characters; "
            f"need 3 to {LARGEST_SIDE} a side, and every number there"
        )
    return ny, nx


def _numbers(body: str, size: tuple[int, int], path: str) -> np.ndarray:
    words = body.replace(",", " ").split()
    if len(words) != size[0] * size[1]:
        raise InputError(f"{path}: {len(words)} numbers where {size[0]} x {size[1]} = {size[0] * size[1]} are due")
    try:
        heights = np.array(words, dtype=np.float64)
    except ValueError as error:
        raise InputError(f"{path}: {error}; need a number at each place of the matrix") from error
    return np.where(np.isfinite(heights), heights, np.nan).reshape(size)


def _number(word: str, what: str, path: str) -> float:
    try:
        return float(word)
    except ValueError as error:
        raise InputError(f"{path}: {what} = {word!r} is no number") from error
