"""Misprints of the documents. Each is a check: it passes for the corrected form, and its control is the printed form."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

from ggxref.verify import engine
from ggxref.verify.engine import Record


@dataclass(frozen=True)
class Erratum:
    """Where a document is wrong, what it prints, what it should. `origin`: "print", or "converter" if that is likelier."""

    paper: str
    place: str
    printed: str
    correct: str
    origin: str

    @property
    def statement(self) -> str:
        return f"erratum: {self.correct}, not {self.printed}"


_errata: list[Erratum] = []


def erratum(
    paper: str,
    place: str,
    printed: str,
    correct: str,
    method: str,
    functions: str | Callable | Sequence,
    *,
    tolerance: float | int,
    change: Callable,
    origin: str = "print",
    **settings,
):
    """Register the decorated body as the check of a misprint; `change` makes the printed form of the first function."""
    entry = Erratum(paper, place, printed, correct, origin)
    _errata.append(entry)
    mutant = (f"as printed: {printed}", change)
    return engine.check(
        paper, place, entry.statement, method, functions, tolerance=tolerance, mutant=mutant, **settings
    )


def shown(records: Sequence[Record]) -> list[tuple[Erratum, Record]]:
    """The misprints whose checks were run, in their order, with what those found."""
    by_name = {(r.paper, r.statement): r for r in records}
    return [(e, by_name[e.paper, e.statement]) for e in _errata if (e.paper, e.statement) in by_name]


def found(records: Sequence[Record]) -> list[dict]:
    """The misprints among the checks that were run, with the numbers that show them."""
    return [{**asdict(entry), "evidence": evidence(record)} for entry, record in shown(records)]


def evidence(r: Record) -> str:
    return (
        f"error {r.error:.1e} as corrected, {r.control.error:.1e} as printed (tolerance {r.tolerance:.0e}, {r.method})"
    )
