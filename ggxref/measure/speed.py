"""Time of functions side by side: in turns, so that a busy machine slows them all alike; a copy as the roof.

A subject is a call without arguments that returns when its result is there.
"""

import os
import platform
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from ggxref.measure.accuracy import DTYPES, arguments
from ggxref.measure.regions import REGIONS, rounded


@dataclass(frozen=True)
class Timing:
    """Nanoseconds a point: median, quartiles and minimum over the turns; compilation in seconds; bytes a point of
    intermediate results at the peak, beyond arguments and result (None: not known)."""

    subject: str
    points: int
    median: float
    lower: float
    upper: float
    best: float
    compilation: float
    memory: float | None
    runs: int


@dataclass(frozen=True)
class Compiled:
    """A subject that XLA compiled, in `seconds`; `memory` as in `Timing`."""

    run: Callable[[], object]
    seconds: float
    memory: float | None

    def __call__(self) -> object:
        return self.run()


def machine() -> str:
    """The processors that this process may use, and what runs on them: for the caption of every figure of speed."""
    info = Path("/proc/cpuinfo")
    names = [line.split(":")[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")]
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{count} x {names[0] if names else platform.processor()}, jax {jax.__version__}, {platform.system()}"


def inputs(names: Iterable[str], points: int, dtype: str = "f32", *, isotropic: bool = False, seed: int = 0) -> list:
    """Seeded typical arguments, points in the last axis, on the device."""
    drawn = rounded(REGIONS["typical"](np.random.default_rng(seed), points), DTYPES[dtype])
    # One material for all points, as a renderer has it.
    drawn["alpha"] = np.asarray([0.3, 0.3 if isotropic else 0.1], DTYPES[dtype])
    with jax.enable_x64(dtype == "f64"):
        return [jax.device_put(drawn[name]) for name in names]


def components(arrays: object) -> object:
    """Each array of several axes, the points in the last, as a list of its components: arrays of their own."""
    return jax.tree.map(lambda a: list(a.reshape(-1, a.shape[-1])) if a.ndim > 1 else a, arrays)


def subject(
    function: Callable, args: list, dtype: str = "f32", *, apart: bool = True, options: dict | None = None
) -> Compiled:
    """A jitted `function`, mapped over the last axis of all `args` but "alpha".

    - `apart`: each component of arguments and result is an array of its own, as within a renderer's kernel and as Mitsuba
      holds them; otherwise a vector is one array, which the result must be packed into.
    - `options`: XLA's, as `jax.jit` takes them for `compiler_options`.
    """
    names = arguments(function)
    axes = tuple(None if name == "alpha" else -1 for name in names)
    mapped = jax.vmap(function, in_axes=axes, out_axes=-1)
    given = components(args) if apart else args

    def run(given):
        whole = [jnp.stack(g).reshape(a.shape) if isinstance(g, list) else g for g, a in zip(given, args, strict=True)]
        result = mapped(*whole)
        return components(result) if apart else result

    with jax.enable_x64(dtype == "f64"):
        start = time.perf_counter()
        program = jax.jit(run).lower(given).compile(compiler_options=options)
        seconds = time.perf_counter() - start
    points = max(arg.shape[-1] for arg in args)
    sizes = program.memory_analysis()
    memory = sizes.temp_size_in_bytes / points if sizes else None
    return Compiled(lambda: jax.block_until_ready(program(given)), seconds, memory)


def copy(args: list) -> Callable[[], object]:
    """A subject that copies the bytes of `args` into fresh memory with NumPy: the roof."""
    flat = [np.array(a) for a in args]
    return lambda: [a.copy() for a in flat]


SETTLE = 0.01
"""Seconds: ten times the call that a kernel makes at 2^18 points."""


def _turn(call: Callable[[], object], settle: float) -> float:
    """Seconds of a call, the median of a turn that lasts as long again as the subject had to settle."""
    taken: list[float] = []
    settled = time.perf_counter() + settle
    while not taken or time.perf_counter() < settled + settle:
        start = time.perf_counter()
        call()
        if start >= settled:
            taken.append(time.perf_counter() - start)
    return float(np.median(taken))


def interleaved(
    subjects: dict[str, Callable[[], object]],
    points: int,
    *,
    seconds: float = 2.0,
    settle: float = SETTLE,
) -> list[Timing]:
    """Run all subjects in turns, again and again, for about `seconds` in all (at least 5 rounds).

    A turn begins with calls that aren't timed, until `settle` seconds have passed: the threads of whoever ran before still
    spin, and its own have gone to sleep. Each round has an order of its own.
    """
    for call in subjects.values():
        call()
    order, rng = list(subjects), np.random.default_rng(0)
    times: dict[str, list[float]] = {name: [] for name in subjects}
    end = time.perf_counter() + seconds
    while time.perf_counter() < end or len(next(iter(times.values()))) < 5:
        for name in rng.permutation(order).tolist():
            times[name].append(_turn(subjects[name], settle) / points * 1e9)
    rows = []
    for name, t in times.items():
        lower, median, upper = np.quantile(t, [0.25, 0.5, 0.75])
        made = subjects[name]
        known = (made.seconds, made.memory) if isinstance(made, Compiled) else (0.0, None)
        rows.append(Timing(name, points, float(median), float(lower), float(upper), float(min(t)), *known, len(t)))
    return rows


def throughput(
    functions: dict[str, Callable],
    points: int,
    *,
    dtype: str = "f32",
    isotropic: bool = False,
    seconds: float = 2.0,
    peers: dict[str, Callable[[], object]] | None = None,
) -> list[Timing]:
    """Time named one-point functions of the same arguments on the same points, beside a copy and `peers`."""
    names = arguments(next(iter(functions.values())))
    args = inputs(names, points, dtype, isotropic=isotropic)
    subjects: dict[str, Callable[[], object]] = {name: subject(f, args, dtype) for name, f in functions.items()}
    return interleaved(subjects | {"copy": copy(args)} | (peers or {}), points, seconds=seconds)
