"""Does what `ggxref choose` names for the shipped scenes hold in an independent picture, and how long does it search?

    python experiments/choose_scenes.py [--tolerance 0.01] [--most 134217728] [--scenes brushed glass] [--out docs/figures]

Each scene is searched by the command in a process of its own, timed from outside. Then each material is rendered
anew, the richest and the chosen, in a picture of the box round its pixels: each with its own seed and all of its
formulas (the chosen sampler, the stored precision). Their deviation is estimated as `choose` does it, but that no
random number is shared: its error is larger, and nothing that `choose` relied on is relied on. A first picture tells
how many samples resolve the tolerance; a second one, of other seeds and that many, tells the deviation, or else a
third one, of four times as many. At tolerance 0 the richest models must be chosen. Exit code 1 if a claim does not
hold: a deviation that two errors leave above the tolerance.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ggxref.scene import build, compare, render
from ggxref.scene.build import Choice
from ggxref.scene.compare import Deviation
from ggxref.scene.read import Scene, read
from ggxref.scene.search import AXES, COUNT

SCENES = Path(__file__).parent / "scenes"
SEEDS = {"richest": (1001, 1003, 1005), "chosen": (2002, 2004, 2006)}
PILOT = 512
"""Samples a pixel that tell how many are needed."""
CLEAR = 5
"""Standard errors of the squared deviation wanted below the tolerance's square: of 16 materials none fails by chance."""
HEADER = (
    "| scene | wall, processor [s] | material | in place of the richest | deviation | independent | samples | faster |"
)


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


@dataclass(frozen=True)
class Anew:
    """A deviation, and the samples a pixel that it took."""

    deviation: Deviation
    samples: int


def box(region: np.ndarray) -> tuple[slice, slice]:
    """Rows and columns round the pixels of a region."""
    spans = [np.flatnonzero(region.any(axis=axis)) for axis in (1, 0)]
    rows, columns = (slice(int(span[0]), int(span[-1]) + 1) for span in spans)
    return rows, columns


def cropped(camera: render.Camera, scene: Scene, rows: slice, columns: slice) -> render.Camera:
    """The camera that sees these rows and columns of the scene's picture, and nothing else."""
    across = (columns.start + columns.stop) / scene.width - 1
    up = 1 - (rows.start + rows.stop) / scene.height
    forward = camera.forward + across * camera.right + up * camera.up
    shares = (columns.stop - columns.start) / scene.width, (rows.stop - rows.start) / scene.height
    return camera._replace(forward=forward, right=shares[0] * camera.right, up=shares[1] * camera.up)


def pair(scene: Scene, found: dict, region: np.ndarray, samples: int, turn: int) -> Deviation:
    """The chosen picture's deviation from the richest in a region, each from random numbers of its own."""
    rows, columns = box(region)
    settings = render.Settings(columns.stop - columns.start, rows.stop - rows.start)
    pictures = {}
    for which, seeds in SEEDS.items():
        choices = {name: Choice(**each[which]) for name, each in found["materials"].items()}
        kinds, world = build.world(scene, choices)
        world = world._replace(camera=cropped(world.camera, scene, rows, columns))
        pictures[which] = compare.batches(
            kinds, world, settings, count=COUNT, samples=samples // COUNT, seed=seeds[turn]
        )
    inside = {"": region[rows, columns]}
    return compare.deviations(pictures["chosen"], pictures["richest"], inside)[""]


def independent(scene: Scene, found: dict, region: np.ndarray, expected: float, tolerance: float, most: int) -> Anew:
    """With as many samples as a deviation as large as `expected` needs to be told from the tolerance, at most `most` in all."""
    pilot = pair(scene, found, region, PILOT, 0)
    # The square's error, from the root's (`compare.deviation`), falls as the samples rise.
    error = ((pilot.value + compare.SURE * pilot.error) ** 2 - pilot.value**2) / compare.SURE
    room = max(tolerance**2 - expected**2, 0.1 * tolerance**2)
    wanted = PILOT * (CLEAR * error / room if tolerance else 4)
    pixels = np.prod([each.stop - each.start for each in box(region)])
    for turn in (1, 2):
        samples = int(min(max(wanted, 4 * PILOT), most / pixels)) // COUNT * COUNT
        deviation = pair(scene, found, region, samples, turn)
        if not tolerance or not deviation.least <= tolerance <= deviation.most:
            break
        wanted = 4 * samples  # the pilot had promised too much: once more, anew
    return Anew(deviation, samples)


def percent(value: float, error: float) -> str:
    return f"{100 * value:.2f} ± {100 * error:.2f} %"


def holds(each: dict, found: Deviation, tolerance: float) -> bool:
    """Within the tolerance by two errors of the independent picture; at tolerance 0, the richest."""
    if tolerance == 0:
        return all(each["chosen"][axis] == each["richest"][axis] for axis in AXES)
    return found.most < tolerance


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--tolerance", type=float, default=0.01)
    parser.add_argument("--most", type=int, default=1 << 27, help="samples of a picture, all pixels together")
    parser.add_argument("--scenes", nargs="*", default=sorted(path.stem for path in SCENES.glob("*.toml")))
    parser.add_argument("--out", type=Path, default=Path("docs/figures"))
    arguments = parser.parse_args()
    print(HEADER + "\n|" + "---|" * 7, flush=True)
    good = True
    for name in arguments.scenes:
        path = SCENES / f"{name}.toml"
        found, wall, used = search(path, arguments.tolerance, arguments.out / f"choose_{name}.png")
        scene = read(path)
        regions = {name: region for name, region in build.seen(scene).items() if region.any()}
        first = name, f"{wall:.0f}, {used:.0f}"
        faster = f"{found['faster']:.2f} ± {found['faster_standard_error']:.2f}"
        for material, region in regions.items():
            each = found["materials"][material]
            expected = Deviation(each["deviation"]["value"], each["deviation"]["standard_error"])
            anew = independent(scene, found, region, expected.most, arguments.tolerance, arguments.most)
            good &= holds(each, anew.deviation, arguments.tolerance)
            keys = [key for key in each["richest"] if each["chosen"][key] != each["richest"][key]]
            changed = ", ".join(each["chosen"][key] for key in keys) or "-"
            by_choose = percent(expected.value, expected.error)
            again = percent(anew.deviation.value, anew.deviation.error)
            cells = *first, material, changed, by_choose, again, str(anew.samples), faster
            print("| " + " | ".join(cells) + " |", flush=True)
            first, faster = ("", ""), ""
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
