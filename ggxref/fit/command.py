"""What `ggxref fit` does, once its words are read: one file in full, or many into a table."""

from collections.abc import Callable, Sequence
from json import dumps
from pathlib import Path
from typing import NamedTuple

import jax
from rich.console import Console
from rich.table import Table

from ggxref.files import write_atomically
from ggxref.fit import bootstrap, export, fitting, readers, report
from ggxref.fit.many import fit_files
from ggxref.fit.preparation import Options


class Outputs(NamedTuple):
    """Where the results of one file go, besides the terminal; `replicates` of the bootstrap, 0 for none."""

    json: Path | None
    figure: Path | None
    export: str | None
    nearest: bool
    replicates: int


def run_calls_where_they_are_made() -> None:
    """No other thread takes the compiled calls over, which costs more than a small one takes: `rows.each` has threads enough.

    It must come before the first of them, and is a program's to set, not a library's.
    """
    jax.config.update("jax_cpu_enable_async_dispatch", False)


def one(file: Path, given: dict, pixel: tuple[float, float] | None, outputs: Outputs) -> bool:
    """Fit one file; whether the chosen model can be relied on."""
    export.check(outputs.export)
    if outputs.figure:
        from ggxref.fit import figures

        figures.check(outputs.figure)
    ladder = fitting.fit(readers.read(file, pixel=pixel), **given)
    intervals = bootstrap.intervals(ladder, outputs.replicates) if outputs.replicates else None
    # What is exported has the standard output for itself.
    console = Console(stderr=bool(outputs.export))
    console.print(report.tables(ladder, intervals))
    # All that can fail comes before anything is written.
    said = export.text(ladder, outputs.export, outputs.nearest) if outputs.export else None
    if outputs.json:
        write_atomically(outputs.json, dumps(report.document(ladder, given, intervals), indent=1) + "\n")
    if outputs.figure:
        drawn, missing = figures.draw(ladder, outputs.figure)
        for path, content in drawn.items():
            write_atomically(path, content)
        if missing:
            console.print(missing)
    if said:
        if said[1]:
            console.print(said[1], style="bold")
        print(said[0], end="")
    return not ladder.best.trouble


def _listing(rows: Sequence[dict[str, str]]) -> Table:
    table = Table(box=None, pad_edge=False)
    for name in ("file", "status", "model", "log_rmse", "loss"):
        table.add_column(name)
    for row in rows:
        # The whole path, which a terminal has no room for, is in the CSV.
        table.add_row(Path(row["file"]).name, *(row.get(name, "") for name in ("status", "model", "log_rmse", "loss")))
    return table


def many(
    files: Sequence[Path], table: Path, given: dict, pixel: tuple[float, float] | None, advance: Callable[[int], None]
) -> bool:
    """Fit many files into a table; whether all of them went well."""
    rows = fit_files(files, table, Options(**given), pixel, advance)
    Console().print(_listing(rows))
    return all(row["status"] == "good" for row in rows)
