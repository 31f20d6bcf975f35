"""Answers from Python functions: called a point at a time with NumPy arrays, or, for JAX, mapped and compiled."""

import gc
import importlib
import json
import os
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ggxref.errors import InputError
from ggxref.golden.catalogue import Function
from ggxref.golden.reading import Test
from ggxref.golden.rounding import Format
from ggxref.golden.verdict import Failure

WORDS = {64: np.uint64, 32: np.uint32, 16: np.uint16}


@dataclass(frozen=True)
class Found:
    """A callable, its options, and whether it is to be differentiated still."""

    function: Callable[..., Any]
    options: tuple[tuple[str, Any], ...]
    differentiate: bool

    def __call__(self, **inputs: Any) -> Any:
        return self.function(**inputs, **dict(self.options))


@dataclass(frozen=True)
class Implementation:
    """A module, or a mapping from the vectors' names to `module:attribute`; `jax`: its functions are JAX functions,
    `quick`: compiled for this one run, without optimisation."""

    module: str
    mapping: dict[str, str]
    jax: bool
    quick: bool = False

    def find(self, function: Function) -> Found | None:
        """The callable for a catalogue entry; None if there is none."""
        for name, whole in ((function.id, True), (function.name, not function.derivative)):
            if name in self.mapping:
                module, _, path = self.mapping[name].partition(":")
                found = attribute(module, path)
            else:
                found = attribute(self.module, name) if self.module and name == function.name else None
            if found is not None and (whole or self.jax):
                options = {} if name in self.mapping and name == function.id else function.options
                return Found(found, tuple(options.items()), not whole)
        return None


def attribute(module: str, path: str) -> Any:
    """`module.path`, importing submodules on the way; None where there is none."""
    found = importlib.import_module(module)
    for i, name in enumerate(parts := path.split(".")):
        try:
            found = getattr(found, name)
        except AttributeError:
            try:
                found = importlib.import_module(".".join([module, *parts[: i + 1]]))
            except ImportError:
                return None
    return found


def implementation(module: str, mapping: Path | None, jax: bool, quick: bool = False) -> Implementation:
    """Checked: the module imports, and each name of the mapping file leads to something."""
    names: dict[str, str] = {}
    if mapping:
        try:
            names = json.loads(mapping.read_bytes())
        except OSError as error:
            raise InputError(f"{mapping}: cannot be read: {error.strerror}") from None
        except (ValueError, RecursionError) as error:
            raise InputError(f"{mapping}: not JSON: {error}") from None
        if not isinstance(names, dict) or not all(isinstance(v, str) and ":" in v for v in names.values()):
            raise InputError(f'{mapping}: wanted {{"ndf.ggx": "module:function", …}}')
    for name in [*([module] if module else []), *(value.partition(":")[0] for value in names.values())]:
        try:
            importlib.import_module(name)
        except Exception as error:  # a module may fail in any way while it is imported
            raise InputError(f"--python: {name!r} cannot be imported: {type(error).__name__}: {error}") from None
    for name, target in names.items():
        owner, _, path = target.partition(":")
        if attribute(owner, path) is None:
            raise InputError(f"{mapping}: {name!r} leads to {target!r}, which does not exist")
    return Implementation(module, names, jax, quick)


def dtype(fmt: Format) -> Any:
    if fmt.name == "bf16":
        from ml_dtypes import bfloat16

        return np.dtype(bfloat16)
    return np.dtype({"f64": np.float64, "f32": np.float32, "f16": np.float16}[fmt.name])


def numbers(bits: Any, fmt: Format) -> Any:
    """Bits as an array of the dtype; a number alone as a NumPy scalar."""
    return np.array(bits, dtype=WORDS[fmt.width]).view(dtype(fmt))[()]


def bits_of(result: Any, fmt: Format) -> Any:
    """A result's bits, nested as it is, each number rounded to the dtype."""
    if isinstance(result, tuple | list):
        return tuple(bits_of(part, fmt) for part in result)
    with np.errstate(all="ignore"):
        array = np.asarray(result).astype(dtype(fmt))
    return nested(array.view(WORDS[fmt.width]).tolist())


def nested(x: Any) -> Any:
    return tuple(map(nested, x)) if isinstance(x, list) else x


def together(implementation: Implementation, tests: list[Test]) -> list[list[Test]]:
    """Tests by what answers them, without those that nothing does: a callable under several names is compiled once,
    as are all its derivatives."""
    functions = {t.function.id: t.function for t in tests}
    found = {name: implementation.find(function) for name, function in functions.items()}
    jobs: dict[Any, list[Test]] = defaultdict(list)
    for t in tests:
        if f := found[t.function.id]:
            # By identity: somebody's callable need not have a hash.
            same = (id(f.function), f.options, f.differentiate) if implementation.jax else t.function.id
            jobs[same, frozenset(t.function.arguments.items()), t.fmt.name].append(t)
    return list(jobs.values())


def ask(implementation: Implementation, tests: list[Test]) -> list[Any]:
    """Answers to tests of one callable and dtype."""
    found, fmt = implementation.find(tests[0].function), tests[0].fmt
    assert found is not None
    if implementation.jax:
        return compiled(found, tests, implementation.quick)
    return [guarded(found, {a: numbers(x, fmt) for a, x in t.inputs.items()}, fmt) for t in tests]


def guarded(f: Callable[..., Any], inputs: dict[str, Any], fmt: Format) -> Any:
    try:
        with np.errstate(all="ignore"):
            return bits_of(f(**inputs), fmt)
    except Exception as error:  # whatever somebody's code raises is its answer
        return Failure(f"{type(error).__name__}: {error}"[:200])


# Five times as fast to compile: also in one piece, as each part for a further thread starts the compiler anew. The
# operations are the same, but what is contracted to a fused multiply-add is not.
QUICK = {
    "xla_cpu_use_fusion_emitters": False,
    "xla_backend_optimization_level": 0,
    "xla_cpu_parallel_codegen_split_count": 1,
}


def processes(implementation: Implementation, jobs: int) -> int:
    """How many to work in. One more takes as long to start as a few functions to compile; an accelerator serves one."""
    if not implementation.jax:
        return 1
    import jax

    return max(1, min(os.cpu_count() or 1, jobs // 8)) if jax.default_backend() == "cpu" else 1


@contextmanager
def uncollected() -> Iterator[None]:
    """Without Python's search for cycles: a fifth of the time of tracing many functions, which leaves few of them."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def compiled(f: Found, tests: list[Test], quick: bool) -> list[Any]:
    """All tests at once, through `jax.jit(jax.vmap(f))`."""
    import jax

    fmt = tests[0].fmt
    inputs = {a: numbers([t.inputs[a] for t in tests], fmt) for a in tests[0].inputs}
    by = {t.function.derivative for t in tests} if f.differentiate else set()

    def point(values: dict[str, Any]) -> Any:
        if not f.differentiate:
            return f(**values)
        rest = {a: x for a, x in values.items() if a not in by}
        return jax.value_and_grad(lambda some: f(**rest, **some))({a: values[a] for a in by})

    def answer(result: Any, i: int) -> Any:
        result = jax.tree.map(lambda x: x[i], result)
        if not f.differentiate:
            return bits_of(result, fmt)
        value, slopes = result
        return bits_of([value, *slopes[tests[i].function.derivative].ravel()], fmt)

    try:
        with jax.enable_x64(fmt.name == "f64"), uncollected():
            options = QUICK if quick and jax.default_backend() == "cpu" else {}
            result = jax.tree.map(np.asarray, jax.jit(jax.vmap(point), compiler_options=options)(inputs))
            return [answer(result, i) for i in range(len(tests))]
    except Exception as error:  # whatever somebody's code raises is its answer
        if len(by) < 2:
            return [Failure(f"{type(error).__name__}: {error}"[:200])] * len(tests)
        # One derivative that fails must not fail the others.
        parts = {a: iter(compiled(f, [t for t in tests if t.function.derivative == a], quick)) for a in by}
        return [next(parts[t.function.derivative]) for t in tests]
