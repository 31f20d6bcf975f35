"""Does what `ggxref choose` names for the shipped scenes hold in an independent picture, and how long does it search?

    python experiments/choose_scenes.py [--tolerance 0.01] [--samples 2048] [--scenes brushed glass] [--out docs/figures]

Each scene is searched by the command in a process of its own, timed from outside. Then the richest and the chosen picture
are rendered anew, each with its own seed and all of its formulas (the chosen sampler, the stored precision), and their
deviation is estimated as `choose` does it, but that no random number is shared: its error is larger, and nothing that
`choose` relied on is relied on. At tolerance 0 the richest models must be chosen. Exit code 1 if a claim does not hold.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ggxref.scene import build, compare, render
from ggxref.scene.build import Choice
from ggxref.scene.choose import AXES, COUNT
from ggxref.scene.compare import Deviation
from ggxref.scene.read import Scene, read

SCENES = Path(__file__).parent / "scenes"
SEEDS = {"richest": 1001, "chosen": 2002}
HEADER = "| scene | wall, processor [s] | material | in place of the richest | deviation | independent | faster |"


def search(scene: Path, tolerance: float, figure: Path) -> tuple[dict, float, float]:
    """What `choose` writes, the seconds it took, and the processor's."""
    with tempfile.TemporaryDirectory() as directory:
        found = Path(directory) / "found.json"
        command = [sys.executable, "-c", "from ggxref.cli import main; main()", "choose", str(scene)]
        command += ["--tolerance", str(tolerance), "--json", str(found), "--figure", str(figure)]
        begun, before = time.perf_counter(), os.times()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        wall, after = time.perf_counter() - begun, os.times()
        used = after.children_user + after.children_system - before.children_user - before.children_system
        return json.loads(found.read_text()), wall, used


def independent(scene: Scene, found: dict, samples: int) -> dict[str, Deviation]:
    """Per material, the deviation of the chosen picture from the richest, each from random numbers of its own."""
    settings = render.Settings(scene.width, scene.height)
    pictures = {}
    for which, seed in SEEDS.items():
        choices = {name: Choice(**each[which]) for name, each in found["materials"].items()}
        kinds, world = build.world(scene, choices)
        pictures[which] = compare.batches(kinds, world, settings, count=COUNT, samples=samples // COUNT, seed=seed)
    return compare.deviations(pictures["chosen"], pictures["richest"], build.seen(scene))


def percent(value: float, error: float) -> str:
    return f"{100 * value:.2f} ± {100 * error:.2f} %"


def holds(each: dict, found: Deviation, tolerance: float) -> bool:
    """Not contradicted by the independent picture; at tolerance 0, the richest."""
    if tolerance == 0:
        return all(each["chosen"][axis] == each["richest"][axis] for axis in AXES)
    return found.least < tolerance


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--tolerance", type=float, default=0.01)
    parser.add_argument("--samples", type=int, default=2048)
    parser.add_argument("--scenes", nargs="*", default=sorted(path.stem for path in SCENES.glob("*.toml")))
    parser.add_argument("--out", type=Path, default=Path("docs/figures"))
    arguments = parser.parse_args()
    print(HEADER + "\n|" + "---|" * 7, flush=True)
    good = True
    for name in arguments.scenes:
        path = SCENES / f"{name}.toml"
        found, wall, used = search(path, arguments.tolerance, arguments.out / f"choose_{name}.png")
        scene = read(path)
        anew = independent(scene, found, arguments.samples)
        first = name, f"{wall:.0f}, {used:.0f}"
        for material, each in found["materials"].items():
            if material not in anew:
                continue
            keys = [key for key in each["richest"] if each["chosen"][key] != each["richest"][key]]
            changed = ", ".join(each["chosen"][key] for key in keys) or "-"
            good &= holds(each, anew[material], arguments.tolerance)
            by_choose = percent(each["deviation"]["value"], each["deviation"]["standard_error"])
            faster = f"{found['faster']:.2f}" if first[0] else ""
            again = percent(anew[material].value, anew[material].error)
            print("| " + " | ".join([*first, material, changed, by_choose, again, faster]) + " |", flush=True)
            first = "", ""
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
