"""Two pages for readers of the documents, written from the checks: every equation with its proofs, and every misprint.

Errors of right formulas are rounding, which differs between machines, so the pages give their bound, the tolerance.
"""

from collections.abc import Sequence
from itertools import zip_longest

from ggxref.verify import coverage, errata
from ggxref.verify.engine import Check, Record
from ggxref.verify.identities import PROVEN
from ggxref.verify.statistics import FALSE_ALARM

TITLES = {
    "heitz2014": "heitz2014: Importance Sampling Microfacet-Based BSDFs using the Distribution of Visible Normals",
    "walter2014": "walter2014: The Ellipsoid Normal Distribution Function",
    "dupuy2023": "dupuy2023: Sampling Visible GGX Normals with Spherical Caps",
    "tokuyoshi2024": "tokuyoshi2024: an article on Bounded VNDF Sampling for the Smith–GGX BRDF",
    "ours": "ours: what ggxref adds",
}
# Functions named in a row; a whole BRDF has a dozen, of which the first is the one under test.
NAMED = 3

EQUATIONS = f"""# Every equation and its proofs

Written by `ggxref verify --pages docs` from the checks that it ran; all of them passed, and every control was caught.

- **Route**: how the two sides were found. *exact* is an identity, in ball arithmetic where the bound is {PROVEN:.0e} and
  in float64 otherwise; *certified* an integral enclosed in ball arithmetic; *quadrature*, *autodiff* and *monte_carlo*
  what they say.
- **Agreement**: a bound on the largest error over all cases, relative where the sides are large. Of a statistical test:
  the probability with which it rejects what is right.
- **Control**: the wrong formula in place of the first function, for which the same check fails.

tokuyoshi2024 numbers nothing: its equations are counted in the order in which the article displays them.
"""

ERRATA = """# Misprints of the documents

Written by `ggxref verify --pages docs` from the checks that it ran. Each entry is a check that the correct form passes and
the printed form fails: the first number bounds the error of the correct form, the second is the error of the printed one.
*Culprit* is the print, or the converter of the file that was read where a lost or altered character is likelier.
"""


def equations(checks: Sequence[Check]) -> str:
    """docs/equations.md: document, equation, routes, functions, agreement, control."""
    proofs, reasons = coverage.proofs(list(checks)), coverage.one_route()
    parts = [EQUATIONS, _summary(checks, proofs)]
    for paper, listed in coverage.places().items():
        rows = [
            "| equation | says | route | what agrees | functions | agreement | control |",
            "|---|---|---|---|---|---|---|",
        ]
        for place, says in listed.items():
            reason = reasons.get((paper, place))
            notes = [place, says + (f" (one route: {reason})" if reason else "")]
            for each, note in zip_longest(proofs[paper, place], [notes], fillvalue=["", ""]):
                rows.append(_row(*note, *_proof(each)))
        parts.append("\n".join([f"## {TITLES[paper]}\n", *rows, ""]))
    return "\n".join(parts)


def _summary(checks, proofs):
    methods = {place: {c.method for c in found} for place, found in proofs.items()}
    twice = sum(len(used) > 1 for used in methods.values())
    proven = sum(c.tolerance == PROVEN for c in checks)
    return f"{len(methods)} places, {twice} of them by two methods or more; {len(checks)} checks, {proven} of them proven to 40 digits.\n"


def _proof(check):
    return check.method, check.statement, _functions(check), _agreement(check), check.mutant


def _functions(check):
    names = [f"`{f}`" for f in check.functions if isinstance(f, str)] or ["the document's formula"]
    more = len(names) - NAMED
    return ", ".join(names[:NAMED]) + (f" and {more} more" if more > 0 else "")


def _agreement(check):
    if check.tolerance == FALSE_ALARM:
        return f"10^-{FALSE_ALARM:.0f}"
    return f"< {check.tolerance:.0e}" if check.tolerance else "equal"


def misprints(records: Sequence[Record]) -> str:
    """docs/errata.md: place, printed, correct, the numbers that show it, culprit."""
    rows = [
        "| document | place | printed | correct | correct form | printed form | route | culprit |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for entry, record in errata.shown(records):
        rows.append(_row(entry.paper, entry.place, entry.printed, entry.correct, *_evidence(record), entry.origin))
    return "\n".join([ERRATA, *rows, ""])


def _evidence(record):
    bound = f"< {record.tolerance:.0e}" if record.tolerance else "0"
    return bound, f"{record.control.error:.1g}", record.method


def _row(*cells):
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
