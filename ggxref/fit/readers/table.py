"""Text tables: `#` comments, then rows of four angles in degrees and the BRDF [1/sr] in one or more bands.

Columns are separated by blanks or commas. A first row of words, or else the last comment above the numbers if it has as many words as
there are columns, names them: `zenith_i`, `azimuth_i`, `zenith_o`, `azimuth_o` in any order, and the bands. Under other names the
angles are the first four columns, in that order: some files call the zenith phi, others theta.
"""

import math
from itertools import islice, takewhile

from ggxref.fit.data import Reflectance, Source
from ggxref.fit.readers import text


def recognise(content: bytes) -> bool:
    """Text with a number first in the first or the second row that is no comment, and at least five words in it."""
    if b"\0" in content[: 2**16]:
        return False
    lines = (text.words(line) for line in content[: 2**16].decode("latin-1").splitlines())
    rows = islice((words for words in lines if words and not words[0].startswith("#")), 2)
    return any(len(words) > len(text.ANGLES) and _is_number(words[0]) for words in rows)


def parse(content: bytes, source: Source) -> Reflectance:
    lines = text.decode(content, source.path).splitlines()
    rows = text.read_rows(lines, 1, source.path)
    head = takewhile(lambda line: not line.strip() or line.lstrip().startswith("#"), lines)
    comments = [line.replace("#", " ") for line in head if line.strip()]
    names = rows.names or text.words(comments[-1] if comments else "")
    return text.reflectance(rows, names, source, math.radians(1))


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
