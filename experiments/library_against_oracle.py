"""How far is the library from the exact values, at 10⁴ random points a function, in float64?

Each function of `tests/points.py` runs under `jit`; the oracle evaluates the very same inputs. The error is relative, vectors
and matrices in the maximum norm, over max(1, condition number); the condition is computed where the error asks for it. Prints a
row a function and exits with 1 if one exceeds 1e-13. Errors below 1e-14 in every number of a result are not told apart and show as 0.

    python experiments/library_against_oracle.py --points 10000
"""

import argparse
import sys
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from rich.progress import track

from ggxref.oracle.precision import lookup, raised

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import exact
import library
import points

LIMIT = 1e-13
CLOSE = 1e-14


def measure(job: tuple[str, int, int]) -> tuple[str, float, float, int]:
    """Worst error, worst error over condition, and how many points have no exact value (a branch exactly on its edge)."""
    name, count, seed = job
    inputs = points.points(name, count, seed)
    got = library.numbers(library.over_rows(library.public(name), inputs))

    def true(point):
        return raised(lambda: lookup(name)(**point), exact.BITS, name, point)

    worst = over = 0.0
    undecided = 0
    for k, row in enumerate(got.tolist()):
        point = {argument: x[k] for argument, x in inputs.items()}
        try:
            value = exact.leaves(true({argument: exact.balls(x) for argument, x in point.items()}))
            # Most results are far within the limit: their condition, a dozen more evaluations, need not be known.
            if all(abs(g - float(v.mid())) <= CLOSE * abs(g) for g, v in zip(row, value, strict=True)):
                continue
            found = exact.error(true, point, row, np.finfo(float), LIMIT)
        except ArithmeticError:
            undecided += 1
            continue
        worst, over = max(worst, found.relative), max(over, found.over_condition)
    return name, worst, over, undecided


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--points", type=int, default=10_000)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--functions", default="", help="only names that hold this")
    options = parser.parse_args()
    names = [name for name in points.FUNCTIONS if options.functions in name]
    jobs = [(name, options.points, 1) for name in names]
    with get_context("spawn").Pool(options.jobs) as pool:
        rows = list(track(pool.imap_unordered(measure, jobs), total=len(jobs), description="functions"))
    for name, worst, over, undecided in sorted(rows):
        print(f"{name:44s} error {worst:.1e}  over condition {over:.1e}  undecided {undecided}")
    print(
        f"{len(rows)} functions, {options.points} points each; worst over condition {max(row[2] for row in rows):.1e}"
    )
    sys.exit(any(row[2] > LIMIT for row in rows))


if __name__ == "__main__":
    main()
