"""Make a chart's files: measure piece by piece (each kept on disk as it ends), then the CSV and the drawing."""

import csv
import io
import json
from collections.abc import Callable, Iterator
from pathlib import Path

from ggxref.files import write_atomically
from ggxref.measure.speed import machine
from ggxref.measure.tables import KINDS, Rows


def _pieces_of(out: Path, kind: str, points: int) -> Path:
    return out / ".pieces" / f"{kind}-{points}"


def collect(kind: str, out: Path, points: int) -> Iterator[Rows]:
    """The rows of each piece in turn: read from an earlier run's file, or measured and then kept."""
    folder = _pieces_of(out, kind, points)
    folder.mkdir(parents=True, exist_ok=True)
    for name, piece in KINDS[kind](points).items():
        path = folder / f"{name}.json"
        if not path.exists():
            write_atomically(path, json.dumps(piece()))
        yield json.loads(path.read_text())


def table(rows: Rows) -> str:
    """CSV with the union of the rows' columns, in order of appearance."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def chart(kind: str, out: Path, points: int, advance: Callable[[int], None]) -> list[Path]:
    """Write `kind`.csv, .png and .svg into `out`, with the advice table beside a `pareto`; the paths written."""
    from ggxref.measure import advice, charts

    rows: Rows = []
    for part in collect(kind, out, points):
        rows += part
        advance(1)
    files: dict[str, bytes | str] = {"csv": table(rows)} | charts.render(kind, rows, machine())
    written = []
    for suffix, data in files.items():
        written.append(out / f"{kind}.{suffix}")
        write_atomically(written[-1], data)
    if kind == "pareto":
        written.append(out / "advice.md")
        write_atomically(written[-1], advice.table(rows))
    return written
