"""How much faster is the cap than the cross-section (dupuy2023: 37.67 %)? The listings in C++, and both forms under XLA.

python experiments/cap_against_cross_section.py
"""

import json
import shutil
import subprocess
import tempfile
from pathlib import Path

from ggxref.measure import speed
from ggxref.measure.variants import QUANTITIES


def in_cpp(*flags: str) -> dict | None:
    """The C++ loop's own report; None without a compiler."""
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        return None
    source = Path(__file__).with_suffix(".cpp")
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "listings"
        subprocess.run([compiler, "-O3", "-march=native", *flags, str(source), "-o", str(program)], check=True)
        return json.loads(subprocess.run([str(program)], check=True, capture_output=True, text=True).stdout)


def under_xla(points: int = 1 << 16) -> list[speed.Timing]:
    """Printed and library forms of both samplers, interleaved."""
    forms = {f"{q} {v.name}": v.function for q in ("cap", "cross_section") for v in QUANTITIES[q].variants}
    return speed.throughput(forms, points, seconds=6)


def main() -> None:
    print(speed.machine())
    for flags in ((), ("-ffast-math",)):
        print("C++", *flags, in_cpp(*flags) or "no compiler found")
    times = under_xla()
    for t in times:
        print(f"XLA {t.subject}: {t.median:.2f} ns [{t.lower:.2f}, {t.upper:.2f}], best {t.best:.2f}")
    best = {t.subject: t.best for t in times}
    for name in ("no cancellation", "printed"):
        print(f"XLA ratio, {name}: {best[f'cross_section {name}'] / best[f'cap {name}']:.2f}")


if __name__ == "__main__":
    main()
