"""The list of everything that the documents state, and which checks stand behind each entry."""

import tomllib
from importlib.resources import files

from ggxref.verify.engine import PAPERS, Check

Places = dict[str, dict[str, str]]


def _listed():
    return tomllib.loads(files("ggxref.verify").joinpath("equations.toml").read_text("utf-8"))


def places() -> Places:
    """What each place of each document says, in the document's order."""
    listed = _listed()
    return {paper: listed[paper] for paper in PAPERS}


def one_route() -> dict[tuple[str, str], str]:
    """The places that only one method can check, and why."""
    return {
        (paper, place): why for name, why in _listed()["one_route"].items() for paper, place in [name.split(" ", 1)]
    }


def proofs(checks: list[Check]) -> dict[tuple[str, str], list[Check]]:
    """The checks of each place, errata aside."""
    found: dict[tuple[str, str], list[Check]] = {(p, place): [] for p, listed in places().items() for place in listed}
    for each in checks:
        if not each.statement.startswith("erratum"):
            for place in each.places:
                found[place].append(each)
    return found
