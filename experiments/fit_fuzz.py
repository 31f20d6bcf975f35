"""Do the readers of measurements keep their word on any bytes? A measurement or an InputError, soon, and in memory of the file's own size.

python experiments/fit_fuzz.py --cases 1000000
"""

import argparse
import random
import sys
import tempfile
import time
import tracemalloc
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

import fit_fuzz


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--memory", type=int, default=20_000, help="cases under the slow memory counter")
    given = parser.parse_args()
    warnings.simplefilter("error")
    random_ = random.Random(given.seed)
    seeds = fit_fuzz.seeds()
    outcomes = {"read": 0, "refused": 0}
    slowest, start = 0.0, time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case"
        for _ in range(given.cases):
            content = fit_fuzz.mutated(random_, seeds)
            # Processor time: the clock on the wall would time what else the machine does.
            before = time.process_time()
            outcomes[fit_fuzz.outcome(content, path)] += 1
            slowest = max(slowest, time.process_time() - before)
        tracemalloc.start()
        most = 0.0
        for _ in range(given.memory):
            content = fit_fuzz.mutated(random_, seeds)
            tracemalloc.reset_peak()
            base = tracemalloc.get_traced_memory()[0]
            fit_fuzz.outcome(content, path)
            most = max(most, (tracemalloc.get_traced_memory()[1] - base) / max(len(content), 4096))
    seconds = time.perf_counter() - start
    print(
        f"{given.cases} cases in {seconds:.0f} s: {outcomes}; slowest {slowest * 1e3:.0f} ms CPU; most memory {most:.0f} x the file"
    )


if __name__ == "__main__":
    main()
