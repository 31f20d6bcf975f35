"""x3p (ISO 25178-72): a zip of `main.xml`, with sizes and increments in metres, and a binary matrix of heights."""

import io
import zipfile
import zlib
from xml.parsers import expat

import numpy as np

from ggxref.errors import InputError
from ggxref.fit.data import Heights, Source, check_pixel

TYPES = {"D": np.dtype("<f8"), "F": np.dtype("<f4"), "L": np.dtype("<i4"), "I": np.dtype("<i2")}
MISSING = 1e299
"""Some writers mark a missing height with ±1e300 where the standard has NaN."""
LARGEST_XML = 2**24
LARGEST_DATA = 2**31
LARGEST_RATIO = 1100
"""Deflate expands at most 1032-fold; more is not a zip's own doing."""

BROKEN = (zipfile.BadZipFile, RuntimeError, NotImplementedError, zlib.error, EOFError, OSError, ValueError)


def recognise(content: bytes) -> bool:
    return content.startswith((b"PK\x03\x04", b"PK\x05\x06"))


def parse(content: bytes, source: Source) -> Heights:
    path = source.path
    try:
        archive = zipfile.ZipFile(io.BytesIO(content))
    except BROKEN as error:
        raise InputError(f"{path}: a broken or truncated zip: {str(error)[:200]}") from error
    with archive:
        main = _find(archive, "main.xml", path)
        fields = _fields(_read(archive, main, LARGEST_XML, path), path)
        nx, ny, pixel, dtype, scale = _layout(fields, path)
        folder = main.filename.removesuffix("main.xml")
        link = fields.get("Record3/DataLink/PointDataLink")
        if link is None:
            raise InputError(f"{path}: main.xml has no PointDataLink; heights inside main.xml are not read")
        member = _find(archive, folder + link, path)
        due = nx * ny * dtype.itemsize
        if member.file_size != due:
            raise InputError(f"{path}: {link} has {member.file_size} bytes where {nx} x {ny} of {dtype} takes {due}")
        stored = np.frombuffer(_read(archive, member, LARGEST_DATA, path), dtype)
    heights = stored.astype(np.float64).reshape(ny, nx) * scale
    return Heights(np.where(np.abs(heights) < MISSING, heights, np.nan), pixel, source)


def _find(archive: zipfile.ZipFile, name: str, path: str) -> zipfile.ZipInfo:
    """The member of that name; for `main.xml` in any folder but the one where macOS hides its own files."""
    for member in archive.infolist():
        plain = not member.filename.startswith("__MACOSX/")
        if member.filename == name or (name == "main.xml" and plain and member.filename.endswith("/main.xml")):
            return member
    raise InputError(f"{path}: a zip without {name}; no x3p file")


def _read(archive: zipfile.ZipFile, member: zipfile.ZipInfo, largest: int, path: str) -> bytes:
    """The member's bytes; its stated size is checked before any is unpacked, and never exceeded."""
    size = member.file_size
    if size > largest or size > LARGEST_RATIO * max(member.compress_size, 1):
        raise InputError(
            f"{path}: {member.filename} claims {size} bytes, packed in {member.compress_size}; too large to be true"
        )
    try:
        with archive.open(member) as stream:
            data = stream.read(size + 1)
    except BROKEN as error:
        raise InputError(f"{path}: {member.filename} cannot be unpacked: {str(error)[:200]}") from error
    if len(data) != size:
        raise InputError(f"{path}: {member.filename} unpacks to {len(data)} bytes, not the {size} it claims")
    return data


def _fields(xml: bytes, path: str) -> dict[str, str]:
    """Text of each element by its path below the root, without namespaces.

    A document type is refused: entities are where XML's bombs and its file reading are.
    """
    parser = expat.ParserCreate(namespace_separator=" ")
    stack: list[str] = []
    fields: dict[str, str] = {}

    def doctype(*_):
        raise InputError(f"{path}: main.xml declares a document type; refused, as entities can expand without end")

    def text(data):
        key = "/".join(stack[1:])
        fields[key] = fields.get(key, "") + data

    parser.StartDoctypeDeclHandler = doctype
    parser.StartElementHandler = lambda name, _: stack.append(name.rpartition(" ")[2])
    parser.EndElementHandler = lambda _: stack.pop()
    parser.CharacterDataHandler = text
    parser.buffer_text = True
    try:
        parser.Parse(xml, True)
    except expat.ExpatError as error:
        raise InputError(f"{path}: main.xml: {error}") from error
    return {key: value.strip() for key, value in fields.items() if value.strip()}


def _layout(fields: dict[str, str], path: str) -> tuple[int, int, tuple[float, float], np.dtype, float]:
    """Columns, rows, pixel size, type of the numbers, and metres per unit of them."""

    def value(key, kind):
        try:
            return kind(fields[key])
        except KeyError:
            raise InputError(f"{path}: main.xml has no {key}") from None
        except ValueError:
            raise InputError(f"{path}: main.xml: {key} = {fields[key]!r}; need {kind.__name__}") from None

    nx, ny, nz = (value(f"Record3/MatrixDimension/Size{axis}", int) for axis in "XYZ")
    if nx < 3 or ny < 3 or nz != 1:
        raise InputError(f"{path}: a matrix of {nx} x {ny} x {nz}; need 3 or more a side, and one layer")
    code = value("Record1/Axes/CZ/DataType", str)
    if code not in TYPES:
        raise InputError(f"{path}: heights of type {code!r}; need one of {', '.join(TYPES)}")
    pixel = (value("Record1/Axes/CX/Increment", float), value("Record1/Axes/CY/Increment", float))
    check_pixel(path, pixel)
    # Integers count increments of the z axis; floating-point heights are metres, whatever the increment says.
    scale = value("Record1/Axes/CZ/Increment", float) if TYPES[code].kind == "i" else 1.0
    if not (np.isfinite(scale) and scale > 0):
        raise InputError(f"{path}: main.xml: z increment = {scale:g} m; need a positive number")
    return nx, ny, pixel, TYPES[code], scale
