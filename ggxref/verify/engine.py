"""What a check is, the register of all checks, and how one is run: on the formula, then on a wrong one that must fail."""

import time
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib import import_module

import numpy as np

from ggxref.errors import InputError
from ggxref.oracle.precision import lookup
from ggxref.verify.batch import batched

PAPERS = ("heitz2014", "walter2014", "dupuy2023", "tokuyoshi2024", "ours")
# The modules that hold the checks of each.
CHECKS = (
    "heitz2014",
    "heitz2014_slopes",
    "heitz2014_bsdf",
    "heitz2014_tables",
    "heitz2014_cavities",
    "heitz2014_derivatives",
    "heitz2014_weights",
    "heitz2014_exact",
    "walter2014",
    "walter2014_derivatives",
    "walter2014_areas",
    "walter2014_sampling",
    "walter2014_laws",
    "walter2014_steps",
    "walter2014_exact",
    "walter2014_exact_areas",
    "dupuy2023",
    "dupuy2023_sampling",
    "dupuy2023_caps",
    "dupuy2023_exact",
    "tokuyoshi2024",
    "tokuyoshi2024_horizon",
    "tokuyoshi2024_exact",
    "tokuyoshi2024_exact_bound",
    "ours",
    "ours_energy",
    "ours_integrals",
    "misprints_heitz2014",
    "misprints",
    "streamed",
)
METHODS = ("exact", "certified", "quadrature", "autodiff", "monte_carlo")
SAMPLES = 1 << 16


class Stream:
    """Independent uniform numbers for one check: seeded by its name, so neither order nor selection changes them."""

    def __init__(self, name: str, samples: int):
        self.name = name
        self.samples = samples
        self._generator = np.random.default_rng(zlib.crc32(name.encode()))

    def uniform(self, *shape: int) -> np.ndarray:
        return self._generator.random(shape)


@dataclass(frozen=True)
class Control:
    """The same check on a wrong formula."""

    mutant: str
    error: float
    caught: bool


@dataclass(frozen=True)
class Record:
    """What one check found; the JSON output is this, field for field."""

    paper: str
    equation: str
    statement: str
    method: str
    error: float
    tolerance: float
    passed: bool
    seconds: float
    control: Control
    failure: str = ""

    @property
    def good(self) -> bool:
        return self.passed and self.control.caught


@dataclass(frozen=True)
class Check:
    """One statement of a paper as a function from formulas to an error, and the change that makes the first one wrong."""

    paper: str
    equation: str
    statement: str
    method: str
    functions: tuple
    tolerance: float
    mutant: str
    change: Callable
    body: Callable
    settings: dict = field(default_factory=dict)
    also: tuple[tuple[str, str], ...] = ()
    thorough: bool = False

    @property
    def places(self) -> list[tuple[str, str]]:
        """Where the statement stands: document and equation, the first one and those that say the same."""
        return [(self.paper, self.equation), *self.also]

    def error(self, samples: int, *, control: bool = False) -> float:
        """Error of the check on the formulas, or (`control`) on the wrong one in place of the first."""
        functions = [formula(f) if isinstance(f, str) else f for f in self.functions]
        if control:
            functions[0] = self.change(functions[0])
        settings = dict(self.settings)
        if self.method == "monte_carlo":
            settings["stream"] = Stream(f"{self.paper} {self.equation} {self.statement}", samples)
        return float(self.body(*functions, **settings))

    def run(self, samples: int = SAMPLES) -> Record:
        start = time.perf_counter()
        error, failure = self._attempt(samples, control=False)
        control, control_failure = self._attempt(samples, control=True)
        return Record(
            paper=self.paper,
            equation=self.equation,
            statement=self.statement,
            method=self.method,
            error=error,
            tolerance=self.tolerance,
            passed=error <= self.tolerance,
            seconds=time.perf_counter() - start,
            # A control that stops with an error shows nothing about the check.
            control=Control(self.mutant, control, not control_failure and not control <= self.tolerance),
            failure=failure or control_failure,
        )

    def _attempt(self, samples, control):
        try:
            return self.error(samples, control=control), ""
        except Exception as problem:  # one broken formula must not hide the verdict on the others
            return np.inf, f"{'control: ' if control else ''}{type(problem).__name__}: {problem}"


def formula(name: str) -> Callable:
    """The function of that name below `ggxref`: the library's batched, the oracle's as it is."""
    if name.startswith("oracle."):
        return lookup(name.removeprefix("oracle."))
    return batched(name)


_register: list[Check] = []


def check(
    paper: str,
    equation: str,
    statement: str,
    method: str,
    functions: str | Callable | Sequence,
    *,
    tolerance: float | int,
    mutant: tuple[str, Callable],
    also: Sequence[str] = (),
    thorough: bool = False,
    **settings,
):
    """Register the decorated body as a check; it may be decorated several times, once for each formula it tests.

    - `functions`: what the body is called with: a public name below `ggxref` (given batched, in float64) or a callable.
    - `mutant`: its name, and the change from the first function to a wrong one.
    - `also`: other places that state what is tested, "(7)" of the same document or "walter2014 (7)" of another.
    - `thorough`: one that takes long, and all processes together; it is left out unless asked for.
    - `settings`: further keyword arguments of the body; method "monte_carlo" adds `stream`.

    The body returns the error, which must stay within `tolerance` for the formula and not for the mutant.
    """
    names = tuple(functions) if isinstance(functions, list | tuple) else (functions,)
    others = tuple(_other_place(paper, place) for place in also)

    def register(body):
        found = Check(
            paper,
            equation,
            statement,
            method,
            names,
            float(tolerance),
            mutant[0],
            mutant[1],
            body,
            settings,
            others,
            thorough,
        )
        _register.append(found)
        return body

    return register


def _other_place(paper, place):
    first, _, rest = place.partition(" ")
    return (first, rest) if first in PAPERS else (paper, place)


def registered(thorough: bool = False) -> list[Check]:
    """Every check, in the order of the documents; those that take long if they are asked for."""
    for name in CHECKS:
        import_module(f"ggxref.verify.{name}")
    return sorted(
        (c for c in _register if thorough or not c.thorough), key=lambda c: (PAPERS.index(c.paper), _place(c.equation))
    )


def _place(equation):
    """Numbered equations by number, then the rest by name."""
    return (int(equation[1:-1]), "") if equation[1:-1].isdecimal() else (1000, equation)


def select(checks: Iterable[Check], paper: str | None = None, equation: str | None = None) -> list[Check]:
    """The checks of one paper, or of one equation (`5` and `(5)` are the same), or all."""
    chosen = list(checks)
    if paper is not None and paper not in PAPERS:
        raise InputError(f"--paper: no paper {paper!r}; there are {', '.join(PAPERS)}")

    def meant(place):
        return paper in (None, place[0]) and (equation is None or place[1] in {equation, f"({equation})"})

    found = [c for c in chosen if any(map(meant, c.places))]
    if not found and equation is not None:
        there = dict.fromkeys(place for c in chosen for p, place in c.places if paper in (None, p))
        where = f" of {paper}" if paper else ""
        raise InputError(f"--equation: no check{where} for {equation!r}; there are {', '.join(there)}")
    return found


def run(checks: Iterable[Check], samples: int = SAMPLES, threads: int = 2) -> Iterator[Record]:
    """Run the checks and yield their records in the same order. Compilation, most of the time, runs in parallel."""
    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(lambda each: each.run(samples), checks)


def worst(errors) -> float:
    """Largest absolute error; NaN where any is."""
    return float(np.max(np.abs(errors)))


def relative(got, expected) -> float:
    """Largest relative error; infinite where 0 is expected of what is not."""
    with np.errstate(divide="ignore"):
        return worst(np.asarray(got) / np.asarray(expected) - 1)
