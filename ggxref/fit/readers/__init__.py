"""Readers of measurement files. `read` recognises a format by content, never by extension."""

import hashlib
from collections.abc import Callable
from pathlib import Path

from ggxref.errors import InputError
from ggxref.fit.data import Heights, Reflectance, Source
from ggxref.fit.readers import array, astm, matrix, merl, rgl, table, x3p

LARGEST_FILE = 2**31
"""Bytes. The largest measurement known here, a MERL material, has 33 MB."""

Format = tuple[str, Callable[[bytes], bool], Callable[..., Reflectance | Heights]]

FORMATS: tuple[Format, ...] = (
    ("rgl", rgl.recognise, rgl.parse),
    ("merl", merl.recognise, merl.parse),
    ("x3p", x3p.recognise, x3p.parse),
    ("npy", array.recognise, array.parse),
    ("astm", astm.recognise, astm.parse),
    ("text matrix", matrix.recognise, matrix.parse),
    ("table", table.recognise, table.parse),
)


def read(path: Path | str, *, pixel: tuple[float, float] | None = None) -> Reflectance | Heights:
    """The measurement in the file at `path`.

    - `pixel`: (dx, dy) in metres, for height fields whose format does not say it.
    """
    return parse(_bytes(Path(path)), str(path), pixel)


def parse(content: bytes, path: str, pixel: tuple[float, float] | None = None) -> Reflectance | Heights:
    """The measurement in these bytes, read from `path`."""
    for name, recognise, reader in FORMATS:
        if recognise(content):
            source = Source(path, name, hashlib.sha256(content).hexdigest())
            more = (pixel,) if reader in (array.parse, matrix.parse) else ()
            try:
                return reader(content, source, *more)
            except InputError as error:
                raise InputError(_clipped(str(error))) from error
    names = ", ".join(name for name, _, _ in FORMATS)
    raise InputError(f"{path}: no measurement known here; it starts with {content[:24]!r}; known formats: {names}")


LONGEST_MESSAGE = 1000


def _clipped(message: str) -> str:
    """A name or a number in a broken file, which the message repeats, can be as long as the file."""
    half = LONGEST_MESSAGE // 2
    return message if len(message) <= LONGEST_MESSAGE else f"{message[:half]} … {message[-half:]}"


def _bytes(path: Path) -> bytes:
    try:
        # A pipe or a device could block for ever or never end.
        if not path.is_file():
            raise InputError(f"{path}: {'not a regular file' if path.exists() else 'no such file'}")
        size = path.stat().st_size
        if size == 0:
            raise InputError(f"{path}: the file is empty")
        if size > LARGEST_FILE:
            raise InputError(f"{path}: {size} bytes; at most {LARGEST_FILE} are read")
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
