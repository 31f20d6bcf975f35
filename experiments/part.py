"""A part of a page that an experiment writes, between two comments that name it."""

from pathlib import Path

from ggxref.errors import InputError
from ggxref.files import write_atomically


def write_part(page: Path, name: str, text: str) -> None:
    """Put `text` between the lines `<!-- NAME -->` and `<!-- end NAME -->`, less what stands behind a colon in the latter."""
    begin, end = f"<!-- {name} -->\n", f"<!-- end {name.partition(':')[0]} -->\n"
    before, found, rest = page.read_text(encoding="utf-8").partition(begin)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        raise InputError(f"{page}: wanted the lines {begin.strip()} and {end.strip()}")
    write_atomically(page, before + begin + text + end + after)
