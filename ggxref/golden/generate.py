"""Writing vectors: the same bytes from the same order, whatever the number of workers, the machine or the Python."""

import difflib
import hashlib
import json
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import flint

from ggxref.errors import InputError
from ggxref.golden import invalid, reading, schema, text
from ggxref.golden.cases import case
from ggxref.golden.flags import SENTENCES
from ggxref.golden.rounding import FORMATS
from ggxref.golden.samplers import FUNCTIONS
from ggxref.golden.solve import test
from ggxref.golden.themes import themes
from ggxref.workers import workers

Group = tuple[str, str]
FORMS = ("json", "text")


@dataclass(frozen=True)
class Order:
    """What to generate: functions (by id), dtypes, tests in all (None: each theme of each function once), seed, form."""

    functions: tuple[str, ...]
    dtypes: tuple[str, ...]
    count: int | None
    seed: int
    form: str = "json"

    def quotas(self) -> dict[Group, int]:
        """Tests of each function and dtype, in proportion to the themes that concern the function."""
        weights = {(f, d): len(themes(FUNCTIONS[f])) for f in self.functions for d in self.dtypes}
        total, quotas, before = sum(weights.values()), {}, 0
        count, passed = total if self.count is None else self.count, 0
        for group, weight in weights.items():
            passed += weight
            quotas[group] = passed * count // total - before
            before += quotas[group]
        return quotas


def compact(value: Any) -> str:
    """JSON on one line, without spaces, letters as they are."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


def tests(seed: int, function: str, dtype: str, quota: int) -> list[str]:
    """The first `quota` different tests of a function in a dtype, each as a line of JSON."""
    seen: set[str] = set()
    lines: list[str] = []
    # Candidates are left out by ones and twos of a hundred; a function of a few bf16 numbers also repeats itself.
    for index in range(20 * quota + 1000):
        if len(lines) == quota:
            break
        candidate = case(seed, FUNCTIONS[function], FORMATS[dtype], index)
        record = candidate and test(candidate)
        if record and (key := compact(record["inputs"])) not in seen:
            seen.add(key)
            lines.append(compact({"id": len(lines) + 1} | record))
    if len(lines) < quota:
        raise InputError(f"{function} in {dtype}: asked for {quota} different tests, there are {len(lines)}")
    return lines


def document(order: Order, function: str, groups: dict[str, list[str]]) -> str:
    """A function's file: the header on top, then a test a line."""
    f = FUNCTIONS[function]
    records = {dtype: [json.loads(line) for line in lines] for dtype, lines in groups.items()}
    flags = {flag for tests in records.values() for record in tests for flag in record["flags"]}
    inputs = [compact([dtype, record["inputs"]]) for dtype, tests in records.items() for record in tests]
    header = {
        "schema": schema.VECTORS,
        "function": f.name,
        "options": f.options,
        "derivative": f.derivative,
        "statement": f.statement,
        "source": f.source,
        "note": f.note,
        "generator": {
            "version": schema.VERSION,
            "flint": flint.__FLINT_VERSION__,
            "seed": order.seed,
            "inputs_sha256": sha256("\n".join(inputs).encode()),
        },
        "flags": {flag: sentence for flag, sentence in (SENTENCES | invalid.SENTENCES).items() if flag in flags},
        "count": len(inputs),
    }
    optional = ("options", "derivative", "note")
    top = ",\n".join(f"{compact(k)}: {compact(v)}" for k, v in header.items() if v or k not in optional)
    bodies = (
        f'{{"id":{i},"dtype":{compact(dtype)},"tests":[\n' + ",\n".join(lines) + "\n]}"
        for i, (dtype, lines) in enumerate(groups.items(), 1)
    )
    return "{" + top + ',\n"groups": [\n' + ",\n".join(bodies) + "\n]}\n"


def documents(order: Order, function: str, groups: dict[str, list[str]]) -> dict[str, tuple[int, bytes]]:
    """A function's files, with the number of tests in each: one of JSON, or one of text a dtype."""
    data = document(order, function, groups).encode()
    if order.form == "json":
        return {f"{function}.json": (sum(map(len, groups.values())), data)}
    parsed = text.groups(reading.tests(data, function))
    return {f"{function}.{fmt.name}.txt": text.vectors(f, fmt, group) for f, fmt, group in parsed}


def sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def order(functions: str, dtypes: str, count: int | None, seed: int, form: str = "json") -> Order:
    """An order from comma-separated names; a function's may be a module's, and both may be `all`."""
    wanted = [name.strip() for name in functions.split(",")]
    for name in wanted:
        if name != "all" and not any(belongs(f, name) for f in FUNCTIONS):
            near = difflib.get_close_matches(name, FUNCTIONS, 1)
            raise InputError(f"--functions: no vectors for {name!r}" + (f"; did you mean {near[0]}?" if near else ""))
    types = list(FORMATS) if dtypes == "all" else [name.strip() for name in dtypes.split(",")]
    for name in types:
        if name not in FORMATS:
            raise InputError(f"--dtypes: no dtype {name!r}; there are {', '.join(FORMATS)}")
    if count is not None and count < 1:
        raise InputError(f"--count: {count} is no number of tests")
    chosen = tuple(f for f in FUNCTIONS if any(belongs(f, name) for name in wanted))
    if form not in FORMS:
        raise InputError(f"--format: no form {form!r}; there are {', '.join(FORMS)}")
    return Order(chosen, tuple(dict.fromkeys(types)), count, seed, form)


def belongs(function: str, name: str) -> bool:
    """Whether a name asks for the function: its own, or one of all above it."""
    return name in ("all", function) or (name not in FUNCTIONS and function.startswith(name + "."))


def generate(
    order: Order, directory: Path, jobs: int = 1, advance: Callable[[int], None] = lambda tests: None
) -> dict[str, Any]:
    """Write the vectors and their manifest into `directory`; returns the manifest. `advance` hears of tests that are done.

    All files are made in a directory beside it first, and the manifest is renamed last: an interrupted run leaves the old vectors.
    """
    directory = directory.absolute()
    directory.parent.mkdir(parents=True, exist_ok=True)
    quotas = order.quotas()
    with tempfile.TemporaryDirectory(prefix=f".{directory.name}.", dir=directory.parent) as scratch:
        manifest = fill(order, quotas, Path(scratch), jobs, advance)
        directory.mkdir(exist_ok=True)
        for name in [*manifest["files"], schema.MANIFEST_NAME]:
            os.replace(Path(scratch, name), directory / name)
    return manifest


def fill(order: Order, quotas: dict[Group, int], scratch: Path, jobs: int, advance: Callable[[int], None]) -> dict:
    """Make all files in `scratch`."""
    files, running = {}, hashlib.sha256()
    with workers(jobs) as submit:
        results = {group: submit(tests, order.seed, *group, quota) for group, quota in quotas.items()}
        for function in order.functions:
            groups = {}
            for dtype in order.dtypes:
                groups[dtype] = results.pop((function, dtype))()
                running.update("".join(line + "\n" for line in groups[dtype]).encode())
                advance(quotas[function, dtype])
            for name, (size, data) in documents(order, function, groups).items():
                Path(scratch, name).write_bytes(data)
                files[name] = {"sha256": sha256(data), "bytes": len(data), "count": size}
    manifest = {
        "schema": schema.MANIFEST,
        "generator": {"version": schema.VERSION, "flint": flint.__FLINT_VERSION__, "seed": order.seed},
        "count": sum(quotas.values()),
        # Of all tests' lines, in this order: two large runs agree if this does.
        "tests_sha256": running.hexdigest(),
        "files": files,
    }
    Path(scratch, schema.MANIFEST_NAME).write_text(
        json.dumps(manifest, indent=1, ensure_ascii=False) + "\n", encoding="utf-8"
    )
    return manifest
