"""The plain text form: a header line, then a test a line, hex words only; `scanf` reads it.

Vectors: `ggxref-text-1 <function> <dtype> <tests> <inputs> <outputs> <argument>:<words> …`, then a line for each test:
id, input words in the order of the arguments, words of the expected result, allowed error in ulp. All words are
hexadecimal, without `0x`. Questions are the same lines up to the inputs. Answers: a line `<function> <dtype>`, then
lines of id and output words; a test left out, or with `-` for words, was refused. Tests of broken inputs, which have
no expected result, are in the questions alone.
"""

from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Any

from ggxref.errors import InputError
from ggxref.golden import schema
from ggxref.golden.cases import leaves
from ggxref.golden.catalogue import Function
from ggxref.golden.reading import SHAPES, Test
from ggxref.golden.rounding import Format
from ggxref.golden.verdict import Failure

Key = tuple[str, str, int]
Answers = dict[Key, Any]


def word(bits: int, fmt: Format) -> str:
    return f"{bits:0{fmt.width // 4}x}"


def words(x: Any, fmt: Format) -> str:
    return " ".join(word(bits, fmt) for bits in leaves(x))


def size(shape: tuple[int, ...]) -> int:
    n = 1
    for length in shape:
        n *= length
    return n


def groups(tests: Iterable[Test]) -> Iterator[tuple[Function, Format, list[Test]]]:
    """Tests that follow each other in one function and dtype."""
    for _, group in groupby(tests, key=lambda t: (t.function.id, t.fmt.name)):
        together = list(group)
        yield together[0].function, together[0].fmt, together


def like(tests: list[Test]) -> Any:
    """The nesting of the group's results."""
    for t in tests:
        if t.result:
            return t.result.expected
    raise InputError(f"{tests[0].function.id}: tests of broken inputs alone; none tells what a result looks like")


def header(function: Function, fmt: Format, tests: list[Test], outputs: int) -> str:
    sizes = {a: size(SHAPES.get(q, ())) for a, q in function.arguments.items()}
    signature = " ".join(f"{a}:{n}" for a, n in sizes.items())
    return f"{schema.TEXT} {function.id} {fmt.name} {len(tests)} {sum(sizes.values())} {outputs} {signature}\n"


def vectors(function: Function, fmt: Format, tests: list[Test]) -> tuple[int, bytes]:
    """A group with its results, but for broken inputs: number of tests, and the file."""
    valid = [t for t in tests if t.result and not t.outcomes]
    lines = (
        f"{t.id:x} {words([*t.inputs.values()], fmt)} {words(t.result.expected, fmt)} {t.result.ulp:x}\n"
        for t in valid
        if t.result
    )
    file = header(function, fmt, valid, len([*leaves(like(tests))])) + "".join(lines)
    return len(valid), file.encode("ascii")


def questions(function: Function, fmt: Format, tests: list[Test]) -> str:
    """A group without its results."""
    lines = (f"{t.id:x} {words([*t.inputs.values()], fmt)}\n" for t in tests)
    return header(function, fmt, tests, len([*leaves(like(tests))])) + "".join(lines)


def nested(flat: Iterator[Any], example: Any) -> Any:
    return tuple(nested(flat, part) for part in example) if isinstance(example, tuple) else next(flat)


def answers(lines: Iterable[str], tests: Iterable[Test]) -> tuple[Answers, str]:
    """The answers in a program's output, up to the first line that is none; and what that line is."""
    known = {(f.id, fmt.name): (fmt, like(group), {t.id for t in group}) for f, fmt, group in groups(tests)}
    found: Answers = {}
    group: tuple[str, str] | None = None
    for number, line in enumerate(lines, 1):
        fields = line.split()
        if len(fields) == 2 and (fields[0], fields[1]) in known:
            group = fields[0], fields[1]
        elif fields and group is None:
            return found, f"line {number}: wanted '<function> <dtype>', got {clipped(line)}"
        elif fields and group:
            fmt, example, ids = known[group]
            id = hexadecimal(fields[0], 8)
            if id not in ids:
                return found, f"line {number}: no test {clipped(fields[0])} in {group[0]} {group[1]}"
            bits = [None] if fields[1:] == ["-"] else [hexadecimal(f, fmt.width // 4) for f in fields[1:]]
            wanted = len([*leaves(example)])
            if fields[1:] != ["-"] and (len(bits) != wanted or None in bits):
                got = clipped(" ".join(fields[1:]))
                return found, f"line {number}: wanted {wanted} hex words of {fmt.width // 4} digits, got {got}"
            found[(*group, id)] = Failure("refused") if None in bits else nested(iter(bits), example)
    return found, ""


def hexadecimal(text: str, digits: int) -> int | None:
    text = text.removeprefix("0x")
    right = 0 < len(text) <= digits and all(c in "0123456789abcdefABCDEF" for c in text)
    return int(text, 16) if right else None


def clipped(text: str) -> str:
    text = text.strip()
    return repr(text if len(text) <= 60 else text[:57] + "...")
