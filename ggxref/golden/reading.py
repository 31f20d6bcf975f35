"""Reading vectors, and refusing what is not: each error says which file and place, what it wants, and what it got."""

import hashlib
import json
import math
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ggxref.errors import InputError
from ggxref.golden import schema
from ggxref.golden.catalogue import Function
from ggxref.golden.invalid import ALL_OUTCOMES
from ggxref.golden.rounding import FORMATS, Format, from_hex
from ggxref.golden.samplers import FUNCTIONS

SHIPPED = Path(__file__).with_name("data")
# No honest file is larger; a manifest's claims are checked against it before anything is read.
LARGEST_FILE = 1 << 30
# Outermost length and so on of each quantity; a number is ().
SHAPES = {
    "A": (3, 3),
    "wi": (3,),
    "wo": (3,),
    "wm": (3,),
    "u3": (3,),
    "rows": (4, 2),
    "scatter": (2, 2),
    "angles": (3,),
}
SHAPES |= dict.fromkeys(("alpha", "u", "mean", "slope"), (2,))


@dataclass(frozen=True)
class Result:
    """Bits of the correctly rounded result, nested as the function returns it, and the error it allows.

    `flushed` is the result for inputs whose subnormals are taken for zeros.
    """

    exact: Any
    expected: Any
    condition: float
    spread: float
    ulp: int
    flushed: Any


@dataclass(frozen=True)
class Test:
    """One test. `result` is None, and `outcomes` (`invalid`) are not, where the input is broken and has no value."""

    function: Function
    fmt: Format
    id: int
    flags: tuple[str, ...]
    inputs: dict[str, Any]
    result: Result | None
    outcomes: tuple[str, ...]


def need(condition: object, message: str | Callable[[], str]) -> None:
    """The message may be made on demand: most are never read."""
    if not condition:
        raise InputError(message if isinstance(message, str) else message())


def object_of(text: bytes, where: str) -> dict[str, Any]:
    """The JSON object in a file."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{where}: not JSON: {error}") from None
    need(isinstance(value, dict), f"{where}: wanted a JSON object, got {kind(value)}")
    return value


def kind(value: Any) -> str:
    text = repr(value)
    return f"{type(value).__name__} {text if len(text) < 60 else text[:57] + '...'}"


def entry(record: dict[str, Any], key: str, wanted: type | tuple[type, ...], where: str) -> Any:
    """`record[key]`, of the wanted type."""
    need(key in record, f"{where}: {key!r} is missing")
    value = record[key]
    right = isinstance(value, wanted) and not isinstance(value, bool)
    types = wanted if isinstance(wanted, tuple) else (wanted,)
    need(right, lambda: f"{where}: {key!r} wants {' or '.join(t.__name__ for t in types)}, got {kind(value)}")
    return value


def choice(value: str, among: dict[str, Any], what: str, where: str) -> Any:
    need(value in among, f"{where}: unknown {what} {value!r}")
    return among[value]


def shape_of(value: Any) -> tuple[int, ...] | None:
    """Shape of a nested list of strings; None if it is ragged or anything else."""
    if isinstance(value, str):
        return ()
    if not isinstance(value, list) or not value:
        return None
    shapes = {shape_of(part) for part in value}
    inner = shapes.pop()
    return None if shapes or inner is None else (len(value), *inner)


def words(value: Any, fmt: Format, where: str) -> Any:
    """Bits of nested hex strings."""
    if isinstance(value, list):
        return tuple(words(part, fmt, where) for part in value)
    need(isinstance(value, str), lambda: f"{where}: wanted a hex string, got {kind(value)}")
    try:
        return from_hex(value, fmt)
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None


def positive(record: dict[str, Any], key: str, where: str) -> float:
    value = entry(record, key, (int, float), where)
    need(value >= 0 and math.isfinite(value), f"{where}: {key!r} wants a number >= 0, got {value}")
    return value


def test(record: Any, function: Function, fmt: Format, flags: dict[str, str], where: str) -> Test:
    """A test from its JSON."""
    need(isinstance(record, dict), lambda: f"{where}: wanted a JSON object, got {kind(record)}")
    inputs = entry(record, "inputs", dict, where)
    wanted, got = set(function.arguments), set(inputs)
    need(wanted == got, lambda: f"{where}: {function.name} takes {sorted(wanted)}, got {sorted(got)}")
    for argument, quantity in function.arguments.items():
        shape, expected = shape_of(inputs[argument]), SHAPES.get(quantity, ())
        if shape != expected:
            raise InputError(f"{where}: {argument!r} wants shape {expected}, got {kind(inputs[argument])}")
    named = entry(record, "flags", list, where)
    for flag in named:
        need(isinstance(flag, str) and flag in flags, f"{where}: flag {flag!r} is not in the file's list")
    outcomes = record.get("outcomes", [])
    known = isinstance(outcomes, list) and set(map(str, outcomes)) <= set(ALL_OUTCOMES)
    need(known, lambda: f"{where}: 'outcomes' wants a list of {', '.join(ALL_OUTCOMES)}, got {kind(outcomes)}")
    inputs = {a: words(x, fmt, f"{where}, {a}") for a, x in inputs.items()}
    valued = not outcomes or "value" in outcomes
    answer = result(record, fmt, where) if valued else None
    return Test(function, fmt, entry(record, "id", int, where), tuple(named), inputs, answer, tuple(outcomes))


def result(record: dict[str, Any], fmt: Format, where: str) -> Result:
    """The part of a test that tells the result."""
    ulp = entry(record, "ulp", int, where)
    need(ulp >= 0, f"{where}: 'ulp' wants a number >= 0, got {ulp}")
    expected = words(entry(record, "expected", (str, list), where), fmt, f"{where}, expected")
    return Result(
        entry(record, "exact", (str, list), where),
        expected,
        positive(record, "condition", where),
        positive(record, "spread", where),
        ulp,
        words(record["flushed"], fmt, f"{where}, flushed") if "flushed" in record else expected,
    )


def tests(text: bytes, where: str) -> Iterator[Test]:
    """The tests of one file."""
    document = object_of(text, where)
    version = entry(document, "schema", str, where)
    need(version == schema.VECTORS, f"{where}: wanted schema {schema.VECTORS!r}, got {version!r}")
    name, options = entry(document, "function", str, where), document.get("options", {})
    need(isinstance(options, dict), f"{where}: 'options' wants a JSON object, got {kind(options)}")
    derivative = document.get("derivative")
    parts = [name, *options.values()] + ([f"d_{derivative}"] if derivative else [])
    function = choice(".".join(map(str, parts)), FUNCTIONS, "function", where)
    flags = entry(document, "flags", dict, where)
    claimed, seen = entry(document, "count", int, where), 0
    for group in entry(document, "groups", list, where):
        need(isinstance(group, dict), f"{where}: a group wants a JSON object, got {kind(group)}")
        fmt = choice(entry(group, "dtype", str, where), FORMATS, "dtype", where)
        for place, record in enumerate(entry(group, "tests", list, where), 1):
            yield test(record, function, fmt, flags, f"{where}: {fmt.name} test {place}")
            seen += 1
    need(seen == claimed, f"{where}: 'count' says {claimed} tests, the file holds {seen}")


def contents(path: Path) -> bytes:
    try:
        size = path.stat().st_size
        need(size <= LARGEST_FILE, f"{path}: {size} bytes, more than the {LARGEST_FILE} that a vector file may have")
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None


def read(directory: Path, functions: Collection[str] = FUNCTIONS) -> Iterator[Test]:
    """The tests of these functions (by id) in a directory of vectors, each file checked against the manifest."""
    path = directory / schema.MANIFEST_NAME
    manifest = object_of(contents(path), str(path))
    version = entry(manifest, "schema", str, str(path))
    need(version == schema.MANIFEST, f"{path}: wanted schema {schema.MANIFEST!r}, got {version!r}")
    for name, claim in entry(manifest, "files", dict, str(path)).items():
        where = f"{path}: {name!r}"
        # A name is a file of this directory, and nothing else on the machine.
        need(name == Path(name).name and name.endswith(".json"), f"{where} is not the name of a vector file")
        need(isinstance(claim, dict), f"{where} wants a JSON object, got {kind(claim)}")
        data = contents(directory / name)
        for key, value in {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}.items():
            claimed = entry(claim, key, type(value), where)
            need(claimed == value, f"{directory / name}: the manifest says {key} {claimed}, the file has {value}")
        # A file of a known function is named by it, so that the others need not be parsed.
        if name.removesuffix(".json") in functions or name.removesuffix(".json") not in FUNCTIONS:
            yield from tests(data, str(directory / name))
