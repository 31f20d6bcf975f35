"""What a grade says: for the terminal, for machines, and as a page."""

from collections.abc import Sequence
from html import escape
from typing import Any

from rich.console import Console
from rich.table import Table

from ggxref.golden.grade import Grade, hexed, readable, worst
from ggxref.golden.rounding import to_float
from ggxref.golden.verdict import Verdict


def show(grade: Grade, again: str) -> None:
    """On the terminal; `again` is the command that made the grade."""
    console = Console()
    for made in tables(grade):
        console.print(made, "")
    for line in [*lines(grade, again), "", summary(grade)]:
        console.print(line, soft_wrap=True, markup=False, highlight=False)


def ulps(v: Verdict) -> str:
    return v.remark or "no number" if v.error is None else f"{to_float(v.error):.3g}"


def budget(v: Verdict) -> str:
    return str(v.test.result.ulp) if v.test.result else "-"


def tables(grade: Grade) -> list[Table]:
    """By function and dtype, and by flag."""
    by_group = grade.by(lambda v: (v.test.function.id, v.test.fmt.name))
    return [
        table("Function", {f"{f} {d}": vs for (f, d), vs in by_group.items()}),
        table("Flag", grade.flags()),
    ]


def table(what: str, rows: dict[str, list[Verdict]]) -> Table:
    made = Table(box=None, header_style="bold", pad_edge=False)
    for name in (what, "passed", "of", "worst ulp", "allowed"):
        made.add_column(name, justify="left" if name == what else "right", no_wrap=True)
    for name, verdicts in rows.items():
        measured = [v for v in verdicts if not v.test.outcomes or not v.passed]
        bad = worst(measured) if measured else None
        passed = sum(v.passed for v in verdicts)
        style = "" if passed == len(verdicts) else "red"
        numbers = (ulps(bad), budget(bad)) if bad else ("-", "-")
        made.add_row(name, str(passed), str(len(verdicts)), *numbers, style=style)
    return made


def lines(grade: Grade, again: str) -> list[str]:
    """The worst case of each function that failed, what it looks like, and how to run it alone."""
    told = []
    found = {d.function: d for d in grade.diagnoses}
    for function, verdicts in grade.by(lambda v: v.test.function.id).items():
        if all(v.passed for v in verdicts):
            continue
        v, wrong = worst(verdicts), sum(not v.passed for v in verdicts)
        told += ["", f"{function}: {wrong} of {len(verdicts)} fail. Worst: {', '.join(case(v))}", *detail(v)]
        if d := found.get(function):
            share = 100 * d.explained // d.failures
            told.append(
                f"  looks like {d.mutant.name}: {d.mutant.sentence} ({share} % of the failures are its results)"
            )
        told.append(f"  alone: {again} --functions {function} --dtypes {v.test.fmt.name} --test {v.test.id}")
    if grade.absent:
        names = sorted({function for function, _ in grade.absent})
        told += ["", f"Not answered at all: {', '.join(names)}"]
    return [*told, *(["", f"The program {grade.trouble}."] if grade.trouble else [])]


def case(v: Verdict) -> list[str]:
    error = f"{ulps(v)} ulp of {budget(v)} allowed" if v.error is not None else ulps(v)
    return [f"{v.test.fmt.name} test {v.test.id}", error, *v.test.flags]


def detail(v: Verdict) -> list[str]:
    fmt, result = v.test.fmt, v.test.result
    told = [f"  {a} = {readable(x, fmt)}  {plain(hexed(x, fmt))}" for a, x in v.test.inputs.items()]
    if v.got is not None:
        told.append(f"  got {readable(v.got, fmt)}  {plain(hexed(v.got, fmt))}")
    if result:
        told.append(f"  expected {plain(result.exact)}  {plain(hexed(result.expected, fmt))}")
    if v.test.outcomes:
        told.append(f"  acceptable: {', '.join(v.test.outcomes)}")
    return told


def plain(x: Any) -> str:
    """Nested words without quotes."""
    return f"[{', '.join(map(plain, x))}]" if isinstance(x, tuple | list) else str(x)


def summary(grade: Grade) -> str:
    failed = sum(not v.passed for v in grade.verdicts)
    total = len(grade.verdicts)
    verdict = "passed" if grade.passed else "failed"
    return f"{verdict}: {total - failed} of {total} tests pass" + (
        f"; {len(grade.absent)} groups not answered" if grade.absent else ""
    )


def as_json(grade: Grade) -> dict[str, Any]:
    by_group = grade.by(lambda v: (v.test.function.id, v.test.fmt.name))
    return {
        "schema": "ggxref-grade-1",
        "passed": grade.passed,
        "trouble": grade.trouble,
        "functions": [{"function": f, "dtype": d} | numbers(vs) for (f, d), vs in by_group.items()],
        "flags": [{"flag": flag} | numbers(vs) for flag, vs in grade.flags().items()],
        "absent": [{"function": f, "dtype": d} for f, d in grade.absent],
        "diagnoses": [
            {
                "function": d.function,
                "mutant": d.mutant.name,
                "statement": d.mutant.sentence,
                "explained": d.explained,
                "failures": d.failures,
            }
            for d in grade.diagnoses
        ],
    }


def numbers(verdicts: Sequence[Verdict]) -> dict[str, Any]:
    v = worst(verdicts)
    return {
        "passed": sum(v.passed for v in verdicts),
        "count": len(verdicts),
        "worst": {
            "id": v.test.id,
            "dtype": v.test.fmt.name,
            "ulp": None if v.error is None else to_float(v.error),
            "allowed": v.test.result.ulp if v.test.result else None,
            "remark": v.remark,
            "passed": v.passed,
            "inputs": {a: hexed(x, v.test.fmt) for a, x in v.test.inputs.items()},
            "got": None if v.got is None else hexed(v.got, v.test.fmt),
            "expected": hexed(v.test.result.expected, v.test.fmt) if v.test.result else None,
        },
    }


STYLE = """body{font:14px system-ui,sans-serif;margin:2em}table{border-collapse:collapse}td,th{padding:2px 5px}
th.flag{writing-mode:vertical-rl;transform:rotate(180deg);text-align:left;font-weight:normal}
td.n{text-align:right;min-width:1.6em;color:#000}th.name{text-align:left;font-weight:normal;white-space:nowrap}
pre{white-space:pre-wrap}@media(prefers-color-scheme:dark){body{background:#111;color:#ddd}}"""


def page(grade: Grade, again: str) -> str:
    """One self-contained page: a heat map of functions and flags, then the worst cases."""
    flags = list(grade.flags())
    head = "".join(f'<th class="flag">{escape(flag)}</th>' for flag in ["all", *flags])
    rows = []
    for function, verdicts in grade.by(lambda v: v.test.function.id).items():
        cells = [verdicts, *([v for v in verdicts if flag in v.test.flags] for flag in flags)]
        rows.append(f'<tr><th class="name">{escape(function)}</th>{"".join(map(cell, cells))}</tr>')
    cases = escape("\n".join(lines(grade, again)))
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>ggxref grade</title><style>{STYLE}</style>'
        f"<h1>ggxref grade</h1><p>{escape(summary(grade))}. A cell is the number of tests that fail; its colour is "
        f"their share.</p><table><tr><th></th>{head}</tr>{''.join(rows)}</table><pre>{cases}</pre></html>\n"
    )


def cell(verdicts: Sequence[Verdict]) -> str:
    if not verdicts:
        return "<td></td>"
    failed = sum(not v.passed for v in verdicts)
    # From pale green over yellow to a darker red, so that it reads in grey too; a single failure must show.
    share = failed / len(verdicts)
    colour = f"{50 - 50 * share:.0f},75%,{80 - 25 * share:.0f}%" if failed else "120,60%,93%"
    bad = worst(verdicts)
    title = f"{failed} of {len(verdicts)} fail, worst {ulps(bad)}{'' if bad.error is None else ' ulp'}"
    return f'<td class="n" style="background:hsl({colour})" title="{escape(title)}">{failed or ""}</td>'
