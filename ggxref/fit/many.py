"""Many files into one table: side by side where they are of a kind, resumed after a stop, and no bad file stops the rest."""

import csv
import io
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path

import numpy as np

from ggxref.errors import InputError
from ggxref.files import write_atomically
from ggxref.fit import fitting, readers
from ggxref.fit.fitting import Ladder
from ggxref.fit.preparation import Options, Prepared, prepare

BATCH = 16
"""Files side by side; the table is written after those of them that are of a kind."""
Done = list[tuple[Path, dict[str, str]]]
"""Files and their rows."""
FIRST = ("file", "sha256", "options", "status", "model", "samples", "log_rmse", "loss", "next_model", "next_gain")


def fit_files(
    paths: Sequence[Path],
    table: Path,
    options: Options,
    pixel: tuple[float, float] | None,
    advance: Callable[[int], None],
) -> list[dict[str, str]]:
    """Fit every file, and write one row each to the CSV `table`; rows that it already has of the same bytes and options stay, and so
    do those of other files.
    """
    digest = sha256(json.dumps([asdict(options), pixel], sort_keys=True).encode()).hexdigest()[:12]
    done = {row["file"]: row for row in _read(table)}
    for batch in _batches(paths):
        fresh = []
        for path in batch:
            old = done.get(str(path))
            if old and old["options"] == digest and old["sha256"] == _sha256(path):
                continue
            fresh.append(path)
        advance(len(batch) - len(fresh))
        for several in _rows(fresh, options, pixel):
            for path, row in several:
                done[str(path)] = {"file": str(path), "sha256": _sha256(path), "options": digest} | row
            _write(table, _ordered(done, paths))
            advance(len(several))
    _write(table, _ordered(done, paths))
    return [done[str(path)] for path in paths]


def _ordered(done: dict[str, dict[str, str]], paths: Sequence[Path]) -> list[dict[str, str]]:
    """The rows of these files, in their order, then the others."""
    first = {str(path): done[str(path)] for path in paths if str(path) in done}
    return list((first | done).values())


def _batches(paths: Sequence[Path]) -> Iterator[Sequence[Path]]:
    return (paths[start : start + BATCH] for start in range(0, len(paths), BATCH))


def _sha256(path: Path) -> str:
    try:
        return sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
    except OSError:
        return ""


def _rows(paths: Sequence[Path], options: Options, pixel: tuple[float, float] | None) -> Iterator[Done]:
    """First the files that cannot be read, then one kind after the other."""
    bad: Done = []
    kinds: dict[tuple, list[tuple[Path, Prepared]]] = {}
    for path in paths:
        try:
            prepared = prepare(readers.read(path, pixel=pixel), options)
        except InputError as error:
            bad.append((path, {"status": f"error: {error}"}))
            continue
        kinds.setdefault(prepared.kind, []).append((path, prepared))
    if bad:
        yield bad
    for several in kinds.values():
        yield _fitted(several)


def _fitted(several: Sequence[tuple[Path, Prepared]]) -> Done:
    """The rows of files of one kind; where their common work fails, of each by itself."""
    try:
        ladders = fitting.fit_prepared([prepared for _, prepared in several])
        return [(path, _row(ladder)) for (path, _), ladder in zip(several, ladders, strict=True)]
    except (InputError, ArithmeticError, ValueError) as error:
        if len(several) == 1:
            return [(several[0][0], {"status": f"error: {error}"})]
        return [row for each in several for row in _fitted([each])]


def _row(ladder: Ladder) -> dict[str, str]:
    best = ladder.best
    larger = [fit for fit in ladder.fits if fit.space.size > best.space.size]
    row = {
        "status": f"trouble: {best.trouble}" if best.trouble else "good",
        "model": best.model.name,
        "samples": str(ladder.problem.size),
        "log_rmse": _text(best.log_rmse),
        "loss": _text(float(best.held_out.mean())),
        "next_model": larger[0].model.name if larger else "",
        "next_gain": _text(float((best.held_out - larger[0].held_out).mean())) if larger else "",
    }
    for name, value in best.values.items():
        row |= {name: _text(value), f"{name} error": _text(best.errors[name])}
    return row


def _text(value: float) -> str:
    return f"{value:.6g}" if np.isfinite(value) else ""


def _read(table: Path) -> list[dict[str, str]]:
    if not table.exists():
        return []
    try:
        with table.open(newline="", encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"--table: {table} cannot be read: {error}") from error
    if rows and not set(FIRST[:4]) <= set(rows[0]):
        raise InputError(f"--table: {table} is no table of fits: it has no column {FIRST[1]!r}; give another name")
    for number, row in enumerate(rows, start=2):
        if None in row:
            raise InputError(f"--table: {table}, row {number}: more cells than columns; mend it or give another name")
    return rows


def _write(table: Path, rows: Sequence[dict[str, str]]) -> None:
    """All of it anew, with the columns that any row has."""
    names = dict.fromkeys([*FIRST, *(name for row in rows for name in row)])
    stream = io.StringIO(newline="")
    writer = csv.DictWriter(stream, list(names), restval="")
    writer.writeheader()
    writer.writerows(rows)
    write_atomically(table, stream.getvalue())
