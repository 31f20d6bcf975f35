"""Grading: all verdicts on an implementation, summed up by function, dtype and flag."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from flint import fmpq

from ggxref.errors import InputError
from ggxref.golden import callables, program, text
from ggxref.golden.cases import mapped
from ggxref.golden.diagnose import Diagnosis, diagnose
from ggxref.golden.generate import Order
from ggxref.golden.reading import Test
from ggxref.golden.rounding import Format, decode, is_nan, to_float, to_hex
from ggxref.golden.verdict import Failure, Verdict, judge
from ggxref.workers import workers


@dataclass
class Grade:
    """Verdicts in the vectors' order; the groups that the implementation does not have; what went wrong as a whole."""

    verdicts: list[Verdict]
    absent: list[tuple[str, str]] = field(default_factory=list)
    trouble: str = ""
    diagnoses: list[Diagnosis] = field(default_factory=list)

    @property
    def passed(self) -> bool:
        return bool(self.verdicts) and not self.trouble and all(v.passed for v in self.verdicts)

    def by(self, key: Callable[[Verdict], Any]) -> dict[Any, list[Verdict]]:
        found: dict[Any, list[Verdict]] = defaultdict(list)
        for v in self.verdicts:
            found[key(v)].append(v)
        return found

    def flags(self) -> dict[str, list[Verdict]]:
        found: dict[str, list[Verdict]] = defaultdict(list)
        for v in self.verdicts:
            for flag in v.test.flags:
                found[flag].append(v)
        return dict(sorted(found.items()))


def worst(verdicts: Sequence[Verdict]) -> Verdict:
    """The verdict that exceeds its budget most; one without a number is worse, one on a broken input not as bad."""

    def badness(v: Verdict) -> tuple[bool, bool, bool, fmpq]:
        over = v.error / max(v.test.result.ulp, 1) if v.error is not None and v.test.result else fmpq(0)
        return not v.passed, not v.test.outcomes, not v.passed and v.error is None, over

    return max(verdicts, key=badness)


def selected(tests: Iterable[Test], order: Order, id: int | None) -> list[Test]:
    """The tests of these functions and dtypes; of each only one, if its id is given."""
    chosen = [
        t for t in tests if t.function.id in order.functions and t.fmt.name in order.dtypes and id in (None, t.id)
    ]
    if not chosen:
        raise InputError("no test is asked for: --functions, --dtypes and --test leave none of the vectors")
    return chosen


def collect(tests: list[Test], answers: text.Answers, strict: bool, trouble: str = "") -> Grade:
    """Verdicts on answers by function, dtype and id. A group without any answer is absent."""
    grade = Grade([], trouble=trouble)
    for function, fmt, group in text.groups(tests):
        given = [answers.get((function.id, fmt.name, t.id)) for t in group]
        if all(answer is None for answer in given):
            grade.absent.append((function.id, fmt.name))
            continue
        pairs = zip(group, given, strict=True)
        grade.verdicts += [judge(t, Failure("no answer") if a is None else a, strict) for t, a in pairs]
    for verdicts in grade.by(lambda v: v.test.function.id).values():
        if (found := diagnose(verdicts)) is not None:
            grade.diagnoses.append(found)
    return grade


def of_program(command: str, tests: list[Test], seconds: float, strict: bool) -> Grade:
    ran = program.run(command, tests, seconds)
    return collect(tests, ran.answers, strict, ran.trouble)


def of_file(path: Path, tests: list[Test], strict: bool) -> Grade:
    try:
        lines = path.read_text("ascii", "replace").splitlines()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    answers, garbage = text.answers(lines, tests)
    if garbage:
        raise InputError(f"{path} {garbage}")
    return collect(tests, answers, strict)


def of_python(
    implementation: callables.Implementation, tests: list[Test], strict: bool, advance: Callable[[int], None]
) -> Grade:
    answers: text.Answers = {}
    jobs = callables.together(implementation, tests)
    examples = {(t.function.id, t.fmt.name): t.result.expected for t in tests if t.result}
    trouble = ""
    advance(len(tests) - sum(map(len, jobs)))
    try:
        with workers(callables.processes(implementation, len(jobs))) as submit:
            asked = [submit(callables.ask, implementation, job) for job in jobs]
            for job, answer_all in zip(jobs, asked, strict=True):
                for test, answer in zip(job, answer_all(), strict=True):
                    group = test.function.id, test.fmt.name
                    answers[*group, test.id] = fitting(answer, examples[group]) if group in examples else answer
                advance(len(job))
    except BrokenProcessPool:
        trouble = "the functions ended the process that called them"
    return collect(tests, answers, strict, trouble)


def fitting(answer: Any, example: Any) -> Any:
    """The answer, if it is nested as a result."""
    if isinstance(answer, Failure) or shape(answer) == shape(example):
        return answer
    return Failure(f"wanted shape {described(example)}, got {described(answer)}")


def shape(x: Any) -> Any:
    return tuple(map(shape, x)) if isinstance(x, tuple) else None


def described(x: Any) -> str:
    return f"({', '.join(map(described, x))})" if isinstance(x, tuple) else "number"


def readable(bits: Any, fmt: Format) -> Any:
    """Numbers for people: nested lists of decimals."""
    if isinstance(bits, tuple):
        return [readable(b, fmt) for b in bits]
    if is_nan(bits, fmt):
        return "nan"
    if bits & (fmt.sign - 1) == fmt.infinity:
        return "-inf" if bits & fmt.sign else "inf"
    return to_float(decode(bits, fmt))


def hexed(bits: Any, fmt: Format) -> Any:
    return mapped(lambda b: to_hex(b, fmt), bits)
