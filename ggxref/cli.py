"""The command line: six verbs, and the only file that sees every part of the package."""

import itertools
import os
import shlex
import signal
import sys
from collections.abc import Callable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from json import dumps
from pathlib import Path
from time import perf_counter
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from typer.core import TyperGroup

from ggxref.errors import InputError
from ggxref.files import writable, writable_directory, write_atomically


class _Verbs(TyperGroup):
    """The verbs: of bad input one line and exit code 2, of a worker that was killed one line and exit code 1."""

    def invoke(self, ctx):
        try:
            return super().invoke(ctx)
        except InputError as error:
            print(f"ggxref: {error}", file=sys.stderr)
            raise typer.Exit(2) from None
        except BrokenProcessPool:
            print(
                "ggxref: something ended a worker process; if it was for want of memory, a smaller --jobs needs less",
                file=sys.stderr,
            )
            raise typer.Exit(1) from None


app = typer.Typer(
    cls=_Verbs,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help="A research toolkit and reference oracle for GGX microfacet models.",
)


@app.callback()
def _root() -> None:
    """Several verbs, also while there is only one."""


@contextmanager
def _progress(what: str, total: int) -> Iterator[Callable[[int], None]]:
    """A bar on the terminal's error stream; calls say how many more are done."""
    columns = TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(what, total=total)
        yield lambda done: progress.advance(task, done)


@contextmanager
def _stages(total: int) -> Iterator[Callable[[str], None]]:
    """A bar like `_progress` of unlike stages; calls say which one begins."""
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task, done = progress.add_task("", total=total), itertools.count()

        def say(stage: str) -> None:
            progress.update(task, description=stage, completed=next(done))

        yield say


@app.command(epilog="Example: ggxref verify --paper walter2014 --equation 28 --json report.json")
def verify(
    paper: Annotated[str | None, typer.Option(metavar="KEY", help="Only the checks of this document.")] = None,
    equation: Annotated[str | None, typer.Option(metavar="N", help="Only those of this equation or place.")] = None,
    samples: Annotated[int, typer.Option(help="Random numbers per case of a statistical check.", min=1 << 12)] = 1
    << 16,
    thorough: Annotated[
        bool,
        typer.Option("--thorough", help="Eight times the samples, and normalisations by tens of millions of them."),
    ] = False,
    distributed: Annotated[
        str | None,
        typer.Option(
            metavar="HOST:PORT,COUNT,RANK", help="This is process RANK of COUNT; process 0 listens at HOST:PORT."
        ),
    ] = None,
    mutants: Annotated[
        bool,
        typer.Option("--mutants", help="Put wrong formulas in the library's place and show which check kills each."),
    ] = False,
    pages: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write equations.md and errata.md from all checks, if they pass.")
    ] = None,
    json: Annotated[Path | None, typer.Option(metavar="PATH", help="Write the records and errata here too.")] = None,
) -> None:
    """Prove the formulas numerically, each beside a wrong one that must fail."""
    from ggxref.verify import distributed as processes

    processes.use_all_cores()
    if distributed:
        processes.join(distributed)
    from ggxref.verify import engine, errata, report
    from ggxref.verify import pages as write

    writable("--json", json)
    if pages and not pages.is_dir():
        raise InputError(f"--pages: there is no directory {pages}")
    if (paper or equation) and (mutants or pages):
        raise InputError(f"{'--mutants' if mutants else '--pages'}: takes all checks; leave out --paper and --equation")
    if mutants:
        return _hunt(samples, json)
    checks = engine.select(engine.registered(thorough), paper, equation)
    samples = 8 * samples if thorough else samples
    together = [c for c in checks if c.thorough]
    start, records = perf_counter(), []
    with _progress("checks", len(own := processes.share(checks)) + len(together)) as advance:
        for each, threads in ((own, 2), (together, 1)):
            for record in engine.run(each, samples, threads):
                records.append(record)
                advance(1)
    records = processes.gathered(records, checks)
    seconds = perf_counter() - start
    if processes.first():
        report.show(records, seconds)
        if json:
            write_atomically(json, report.document(records, errata.found(records), seconds))
    if not all(r.good for r in records):
        raise typer.Exit(1)
    if pages and processes.first():
        write_atomically(pages / "equations.md", write.equations(engine.registered()))
        write_atomically(pages / "errata.md", write.misprints(records))


def _hunt(samples: int, json: Path | None) -> None:
    """Put each mutant in the library's place; exit code 1 if one lives."""
    from ggxref.verify import engine, mutants, report

    start, verdicts, checks = perf_counter(), [], engine.registered()
    with _progress("mutants", len(mutants.MUTANTS)) as advance:
        for each in mutants.MUTANTS:
            verdicts.append(mutants.hunt(each, checks, samples))
            advance(1)
    seconds = perf_counter() - start
    report.show_hunt(verdicts, seconds)
    if json:
        write_atomically(json, report.hunt_document(verdicts, seconds))
    if not all(v.killer for v in verdicts):
        raise typer.Exit(1)


@app.command(epilog="Example: ggxref vectors out --functions ndf,masking.g1_ggx --dtypes f32 --count 1000")
def vectors(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Where to write the files; made if it is missing.")],
    functions: Annotated[str, typer.Option(help="Names or modules, separated by commas.")] = "all",
    dtypes: Annotated[str, typer.Option(help="Of f64, f32, bf16, f16, separated by commas.")] = "all",
    count: Annotated[
        int | None, typer.Option(help="Tests in all; without it, each corner of each function once.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Another seed draws other inputs.")] = 1,
    form: Annotated[str, typer.Option("--format", help="json, or text: hex words only, for scanf.")] = "json",
    jobs: Annotated[int, typer.Option(help="Worker processes; they do not change the bytes.", min=1)] = 1,
    json: Annotated[Path | None, typer.Option(metavar="PATH", help="Write the manifest here too.")] = None,
) -> None:
    """Write golden test vectors: inputs as bits, results proven correctly rounded, from the oracle alone."""
    from ggxref.golden import generate

    writable("--json", json)
    order = generate.order(functions, dtypes, count, seed, form)
    if directory.exists() and not directory.is_dir():
        raise InputError(f"{directory}: is a file; vectors are written into a directory")
    with _progress("tests", sum(order.quotas().values())) as advance:
        try:
            manifest = generate.generate(order, directory, jobs, advance)
            if json:
                write_atomically(json, dumps(manifest, indent=1) + "\n")
        except OSError as error:
            raise InputError(f"{error.filename}: cannot be written: {error.strerror}") from None
    print(f"{manifest['count']} tests in {len(manifest['files'])} files in {directory}")
    print(f"SHA-256 of all tests: {manifest['tests_sha256']}")


@app.command(epilog="Example: ggxref fit surface.x3p --level 2 --json fit.json --figure fit.pdf")
def fit(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE…", help="BRDFs or height fields; their formats are recognised.")
    ],
    model: Annotated[
        str,
        typer.Option(help="Shapes to try: isotropic, anisotropic, rotated, ellipsoid, separated by commas; or all."),
    ] = "auto",
    tail: Annotated[
        str, typer.Option(help="Tails to try: ggx, beckmann, student_t; auto is ggx and student_t, its tail free.")
    ] = "auto",
    masking: Annotated[str, typer.Option(help="BRDF: height_correlated, separable or v_cavity.")] = "height_correlated",
    fresnel: Annotated[str, typer.Option(help="BRDF: schlick (F0) or conductor (eta, k).")] = "schlick",
    fix: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="Hold a parameter: alpha=0.1, diffuse=0, A=a,b,…")
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option(help="Choose the smallest model within this held-out loss of the best.")
    ] = None,
    min_cosine: Annotated[float, typer.Option(help="BRDF: leave out directions nearer to the horizon.")] = 0.05,
    samples: Annotated[int, typer.Option(help="BRDF: fit at most this many, evenly through the file.")] = 4096,
    level: Annotated[int, typer.Option(help="Heights: degree of the polynomial that is taken off first.")] = 1,
    slopes: Annotated[
        str, typer.Option(help="Heights: differences taken as slopes: central, cell (2 x 2) or facet (3 x 3).")
    ] = "central",
    smooth: Annotated[
        float, typer.Option(metavar="METRES", help="Heights: Gaussian filter first, of this cutoff; 0 for none.")
    ] = 0.0,
    pixel: Annotated[
        str | None, typer.Option(metavar="DX[,DY]", help="Heights: pixel size in metres, if FILE does not say it.")
    ] = None,
    bootstrap: Annotated[
        int, typer.Option(help="Intervals from this many replicates, and not from standard errors.", min=0)
    ] = 0,
    json: Annotated[Path | None, typer.Option(metavar="PATH", help="Write the fit here too.")] = None,
    figure: Annotated[
        Path | None, typer.Option(metavar="PATH", help="Draw it (.pdf, .png, .svg), -residuals, -sphere beside it.")
    ] = None,
    export: Annotated[
        str | None, typer.Option(metavar="FORM", help="Print it as mitsuba, pbrt, gltf, materialx or json say it.")
    ] = None,
    nearest: Annotated[bool, typer.Option("--nearest", help="Export: what is closest, if FORM cannot say it.")] = False,
    table: Annotated[
        Path | None, typer.Option(metavar="PATH.csv", help="Many files: a row each; run it again to go on.")
    ] = None,
) -> None:
    """Fit NDF parameters to measured reflectance or heights, with the simplest model that suffices."""
    from ggxref.fit import command, options

    for option, path in (("--json", json), ("--figure", figure), ("--table", table)):
        writable(option, path)
    if nearest and not export:
        raise InputError("--nearest is for --export: what is closest, if that renderer cannot say the model")
    command.run_calls_where_they_are_made()
    given = {"model": model, "tail": tail, "masking": masking, "fresnel": fresnel, "min_cosine": min_cosine}
    given |= {"samples": samples, "degree": level, "slopes": slopes, "smooth": smooth}
    given |= {"fixed": options.fixed(fix or []), "tolerance": tolerance}
    size = options.pixel(pixel)
    if table:
        ones = ("--json", json), ("--figure", figure), ("--export", export), ("--bootstrap", bootstrap)
        alone = [name for name, value in ones if value]
        if alone:
            raise InputError(f"{alone[0]} is for one FILE; --table is for many")
        with _progress("files", len(files)) as advance:
            good = command.many(files, table, given, size, advance)
    else:
        if len(files) != 1:
            raise InputError(f"{len(files)} files; need one, or --table PATH.csv for a row each")
        outputs = command.Outputs(json, figure, export, nearest, bootstrap)
        with Console(stderr=True).status(f"fitting {files[0].name}"):
            good = command.one(files[0], given, size, outputs)
    if not good:
        raise typer.Exit(1)


@app.command(epilog="Example: ggxref chart pareto --out figures")
def chart(
    kind: Annotated[str, typer.Argument(help="accuracy, speed, pareto, stability, variance, gradient, or all.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where PNG, SVG and CSV go; made if it is not there.")],
    points: Annotated[
        int, typer.Option(help="Points a region in float32; a million for a final figure.", min=1 << 10)
    ] = 1 << 16,
    jobs: Annotated[int, typer.Option(help="Worker processes for what is not timed.", min=1)] = os.cpu_count() or 1,
) -> None:
    """Measure and draw: accuracy, speed, one against the other, where forms fail. Run it again to go on after a stop."""
    from ggxref.measure import run, tables

    if kind != "all" and kind not in tables.KINDS:
        raise InputError(f"chart {kind}: there are {', '.join(tables.KINDS)}, and all")
    if out.exists() and not out.is_dir():
        raise InputError(f"--out: {out} is a file, not a directory")
    out.mkdir(parents=True, exist_ok=True)
    for one in tables.KINDS if kind == "all" else [kind]:
        with _progress(one, len(tables.KINDS[one](points))) as advance:
            written = run.chart(one, out, points, advance, jobs)
        print("\n".join(map(str, written)))


@app.command(epilog="Example: ggxref choose experiments/scenes/brushed.toml --tolerance 0.01 --figure brushed.png")
def choose(
    scene: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Shapes, lights, materials, view.")],
    tolerance: Annotated[
        float, typer.Option(help="Most deviation from the richest models, over mean radiance.")
    ] = 0.01,
    json: Annotated[Path | None, typer.Option(metavar="PATH", help="Write the findings here too.")] = None,
    figure: Annotated[
        Path | None, typer.Option(metavar="PATH.png", help="Cost against deviation, and pictures.")
    ] = None,
    pictures: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Richest and chosen picture as PNG and NPY; DIR is made.")
    ] = None,
) -> None:
    """Find the cheapest models with which a scene's picture stays within a tolerance of the richest ones'."""
    from ggxref.scene import choose as search
    from ggxref.scene import image, report
    from ggxref.scene.read import read

    writable("--json", json)
    writable("--figure", figure)
    writable_directory("--pictures", pictures)
    console = Console()
    asked = read(scene)
    with _stages(search.stages(asked)) as say:
        result = search.choose(asked, tolerance, say)
    console.print(report.tables(result))
    if json:
        write_atomically(json, dumps(report.document(result), indent=1) + "\n")
    if figure:
        write_atomically(figure, report.figure(result))
    if pictures:
        pictures.mkdir(exist_ok=True)
        for name, each in result.pictures.items():
            image.write(pictures / name, each.mean)


@app.command(epilog="Example: ggxref grade --command ./renderer_answers --functions ndf,masking --dtypes f32")
def grade(
    directory: Annotated[
        Path | None, typer.Argument(metavar="[DIR]", help="Vectors; without it, those shipped.")
    ] = None,
    python: Annotated[str, typer.Option(metavar="MODULE", help="A Python module with the public names.")] = "",
    mapping: Annotated[
        Path | None, typer.Option("--map", metavar="FILE", help='JSON for other names: {"ndf.ggx": "module:function"}.')
    ] = None,
    jax: Annotated[bool, typer.Option("--jax", help="The Python functions are JAX functions: compile them.")] = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="With --jax on a CPU: compile without optimisation, four times as fast.")
    ] = False,
    command: Annotated[str, typer.Option(metavar="CMD", help="A program: questions on stdin, answers on stdout.")] = "",
    answers: Annotated[Path | None, typer.Option(metavar="FILE", help="Answers written before.")] = None,
    functions: Annotated[str, typer.Option(help="Names or modules, separated by commas.")] = "all",
    dtypes: Annotated[str, typer.Option(help="Of f64, f32, bf16, f16, separated by commas.")] = "all",
    test: Annotated[int | None, typer.Option(metavar="ID", help="Only this test of each function and dtype.")] = None,
    timeout: Annotated[float, typer.Option(metavar="SECONDS", help="Stop the program after so long.", min=0.1)] = 60.0,
    strict: Annotated[bool, typer.Option("--strict", help="Subnormals must not be flushed to zero.")] = False,
    json: Annotated[Path | None, typer.Option(metavar="PATH", help="Write the result for machines here.")] = None,
    html: Annotated[Path | None, typer.Option(metavar="PATH", help="Write a page with a heat map here.")] = None,
) -> None:
    """Run somebody's implementation over golden vectors: what fails, by how much, which mistake it looks like."""
    from ggxref.golden import callables, generate, reading, report
    from ggxref.golden import grade as grading

    if sum(map(bool, (python or mapping, command, answers))) != 1:
        raise InputError("wanted one of --python (or --map), --command and --answers")
    if quick and not jax:
        raise InputError("--quick: says how --jax compiles, and there is no --jax")
    writable("--json", json)
    writable("--html", html)
    order = generate.order(functions, dtypes, None, 1)
    tests = grading.selected(reading.read(directory or reading.SHIPPED, order.functions), order, test)
    if command:
        result = grading.of_program(command, tests, timeout, strict)
    elif answers:
        result = grading.of_file(answers, tests, strict)
    else:
        implementation = callables.implementation(python, mapping, jax, quick)
        with _progress("tests", len(tests)) as advance:
            result = grading.of_python(implementation, tests, strict, advance)
    options = {"--python": python, "--map": mapping, "--command": command, "--answers": answers}
    given = [part for name, value in options.items() if value for part in (name, str(value))]
    flags = [name for name, value in {"--jax": jax, "--quick": quick}.items() if value]
    again = shlex.join(["ggxref", "grade", *([str(directory)] if directory else []), *given, *flags])
    report.show(result, again)
    for path, content in (
        (json, lambda: dumps(report.as_json(result), indent=1)),
        (html, lambda: report.page(result, again)),
    ):
        if path:
            write_atomically(path, content() + "\n")
    if not result.passed:
        raise typer.Exit(1)


def _interrupted(signum: int, frame: object) -> None:
    print("ggxref: interrupted", file=sys.stderr)
    raise SystemExit(130)


def main() -> None:
    signal.signal(signal.SIGINT, _interrupted)  # before the libraries, whose own answer to Ctrl-C is a traceback
    app()
