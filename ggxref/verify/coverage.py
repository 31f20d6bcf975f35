"""The list of everything that the documents state, and which checks stand behind each entry."""

import tomllib
from importlib.resources import files

from ggxref.verify.engine import Check

Places = dict[str, dict[str, str]]


def places() -> Places:
    """What each place of each document says, in the document's order."""
    return tomllib.loads(files("ggxref.verify").joinpath("equations.toml").read_text("utf-8"))


def proofs(checks: list[Check]) -> dict[tuple[str, str], list[Check]]:
    """The checks of each place, errata aside."""
    found: dict[tuple[str, str], list[Check]] = {(p, place): [] for p, listed in places().items() for place in listed}
    for each in checks:
        if (each.paper, each.equation) in found and not each.statement.startswith("erratum"):
            found[each.paper, each.equation].append(each)
    return found
