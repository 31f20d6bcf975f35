"""Make a chart's files: measure piece by piece (each kept on disk as it ends), then the CSV and the drawing."""

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path

from ggxref.files import write_atomically
from ggxref.measure.speed import machine
from ggxref.measure.tables import KINDS, Rows, timed
from ggxref.workers import workers


def _pieces_of(out: Path, kind: str, points: int) -> Path:
    return out / ".pieces" / f"{kind}-{points}"


def _keep(path: Path, piece: Callable[[], Rows]) -> None:
    write_atomically(path, json.dumps(piece()))


def collect(kind: str, out: Path, points: int, jobs: int, advance: Callable[[int], None]) -> Rows:
    """The rows of all pieces, in their order: read from an earlier run's files, or measured, each kept as soon as it is.

    Pieces that time nothing are measured in `jobs` processes side by side, the others alone and after them.
    """
    folder = _pieces_of(out, kind, points)
    folder.mkdir(parents=True, exist_ok=True)
    pieces = KINDS[kind](points)
    paths = {name: folder / f"{name}.json" for name in pieces}
    missing = [name for name, path in paths.items() if not path.exists()]
    advance(len(paths) - len(missing))
    for alone in (False, True):
        names = [name for name in missing if timed(kind, name) == alone]
        with workers(1 if alone else min(jobs, max(len(names), 1))) as submit:
            for finished in [submit(_keep, paths[name], pieces[name]) for name in names]:
                finished()
                advance(1)
    return [row for path in paths.values() for row in json.loads(path.read_text())]


def table(rows: Rows) -> str:
    """CSV with the union of the rows' columns, in order of appearance."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def chart(kind: str, out: Path, points: int, advance: Callable[[int], None], jobs: int = 1) -> list[Path]:
    """Write `kind`.csv, .png and .svg into `out`, with the advice table beside a `pareto`; the paths written."""
    from ggxref.measure import advice, charts

    rows = collect(kind, out, points, jobs, advance)
    files: dict[str, bytes | str] = {"csv": table(rows)} | charts.render(kind, rows, machine())
    written = []
    for suffix, data in files.items():
        written.append(out / f"{kind}.{suffix}")
        write_atomically(written[-1], data)
    if kind == "pareto":
        written.append(out / "advice.md")
        write_atomically(written[-1], advice.table(rows))
    return written
