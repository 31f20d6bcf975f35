"""The verdict for people, as a table, and for machines, as JSON."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ggxref.verify.engine import Record
from ggxref.verify.mutants import Verdict


def table(records: Sequence[Record]) -> Table:
    """One row a check, in the order given."""
    drawn = Table(box=None, pad_edge=False, header_style="bold")
    for name in ("", "equation", "statement", "method"):
        drawn.add_column(name, overflow="fold")
    for name in ("error", "tolerance", "control", "s"):
        drawn.add_column(name, justify="right", no_wrap=True)
    paper = None
    for r in records:
        if r.paper != paper:
            paper = r.paper
            drawn.add_row("", Text(paper, style="bold"))
        mark = Text("ok", style="green") if r.good else Text("FAIL", style="bold red")
        numbers = (f"{r.error:.1e}", f"{r.tolerance:.0e}", f"{r.control.error:.1e}", f"{r.seconds:.1f}")
        drawn.add_row(mark, r.equation, Text(r.statement), r.method, *numbers)
    return drawn


def hunt_table(verdicts: Sequence[Verdict]) -> Table:
    """One row a mutant: what was put in the formula's place, and the check that killed it."""
    drawn = Table(box=None, pad_edge=False, header_style="bold")
    for name in ("", "function", "mutant", "killed by"):
        drawn.add_column(name, overflow="fold")
    for name in ("error", "tolerance", "s"):
        drawn.add_column(name, justify="right", no_wrap=True)
    for v in verdicts:
        row = v.mutant.target, Text(v.mutant.name)
        if v.killer:
            by = Text(f"{v.killer.paper} {v.killer.equation}, {v.killer.method}: {v.killer.statement}")
            numbers = f"{v.error:.1e}", f"{v.killer.tolerance:.0e}", f"{v.seconds:.1f}"
            drawn.add_row(Text("killed", style="green"), *row, by, *numbers)
        else:
            drawn.add_row(Text("ALIVE", style="bold red"), *row, "", "", "", f"{v.seconds:.1f}")
    return drawn


# Columns of the table where the output is a file or a pipe, whose width is unknown.
WIDTH = 160


def show(records: Sequence[Record], seconds: float) -> None:
    """Print the table, what went wrong, and the sum."""
    console = _console()
    console.print(table(records))
    console.print()
    for r in records:
        for line in problems(r):
            console.print(Text(f"{r.paper} {r.equation}, {r.statement}: {line}", style="red"))
    failed = sum(not r.passed for r in records)
    missed = sum(not r.control.caught for r in records)
    console.print(
        f"{len(records)} checks: {len(records) - failed} pass, {failed} fail; "
        f"{len(records) - missed} controls caught, {missed} not; {seconds:.0f} s"
    )


def show_hunt(verdicts: Sequence[Verdict], seconds: float) -> None:
    """Print which check killed each mutant, and the sum."""
    console = _console()
    console.print(hunt_table(verdicts))
    killed = sum(v.killer is not None for v in verdicts)
    console.print(f"\n{len(verdicts)} mutants: {killed} killed, {len(verdicts) - killed} alive; {seconds:.0f} s")


def _console() -> Console:
    console = Console()
    return console if console.is_terminal else Console(width=WIDTH)


def problems(r: Record) -> list[str]:
    """What is wrong with a record, a line each; none if it is good."""
    lines = [r.failure] if r.failure else []
    if not r.passed:
        lines.append(f"error {r.error:.3g} is above the tolerance {r.tolerance:.3g}")
    if not r.control.caught:
        lines.append(f"the control ({r.control.mutant}) was not caught: its error is {r.control.error:.3g}")
    return lines


def document(records: Sequence[Record], errata: Sequence[dict], seconds: float) -> str:
    """The JSON of design.md; an error that is not finite is null."""
    checks = [{k: v for k, v in asdict(r).items() if k != "failure"} for r in records]
    value = {"version": version("ggxref"), "seconds": seconds, "checks": checks, "errata": list(errata)}
    return json.dumps(_finite(value), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def hunt_document(verdicts: Sequence[Verdict], seconds: float) -> str:
    """The mutants and their killers as JSON."""
    rows = []
    for v in verdicts:
        by = v.killer and {
            name: getattr(v.killer, name) for name in ("paper", "equation", "statement", "method", "tolerance")
        }
        rows.append(
            {
                "function": v.mutant.target,
                "mutant": v.mutant.name,
                "killed_by": by,
                "error": v.error,
                "seconds": v.seconds,
            }
        )
    value = {"version": version("ggxref"), "seconds": seconds, "mutants": rows}
    return json.dumps(_finite(value), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _finite(value):
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
