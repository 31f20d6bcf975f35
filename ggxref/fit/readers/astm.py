"""ASTM E1392 style text of goniometers: a header of keywords, a line `VARS` that names the columns, then rows.

Columns are separated by commas: θi, φi, θs, φs in radians, and the BRDF [1/sr] per band.
"""

from ggxref.fit.data import Reflectance, Source
from ggxref.fit.readers import text

KEYWORD = "VARS"


def recognise(content: bytes) -> bool:
    start = content[: 2**16]
    return b"\0" not in start and any(line.startswith(KEYWORD.encode()) for line in start.splitlines())


def parse(content: bytes, source: Source) -> Reflectance:
    lines = text.decode(content, source.path).splitlines()
    at = next(number for number, line in enumerate(lines) if line.startswith(KEYWORD))
    names = text.words(lines[at].removeprefix(KEYWORD).lstrip("= \t"))
    return text.reflectance(text.read_rows(lines[at + 1 :], at + 2, source.path), names, source, 1.0)
