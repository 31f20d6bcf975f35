"""walter2014: what does the mean slope of a measured surface do to a picture of it?

    python experiments/measured_balls.py [--data ../shared/data/height] [--samples 256] [--out docs/figures]

A conductor ball (F0 = 0.9) under a sky with a sun, its normal distribution the ellipsoid that `ggxref fit` finds in a measured
height field; the same without its mean slope (the anisotropic GGX of the same scatter), and isotropic. The document's balls
are lit by an environment map and show metallic paints of its own measurement: the light and the surfaces are ours.
"""

import argparse
import math
from pathlib import Path

import numpy as np
from harness import row, say, still
from matplotlib.figure import Figure

from ggxref.files import write_atomically
from ggxref.fit import fitting, models, readers
from ggxref.scene import build, compare, image, lights, render, shapes
from ggxref.scene.materials import Kind

SETTINGS = render.Settings(96, 96)
VIEW = render.look((0.0, -6.0, 1.5), (0.0, 0.0, 0.0), math.radians(21), 96, 96)
BALL = (shapes.Sphere(still(0, 0, 0), still(1), still(0).astype(int)),)
LIGHTS = (lights.Sky(still(0.1), still(0.4)), lights.Sun(still(-0.48, -0.64, 0.6), still(math.radians(3)), still(120)))
SURFACES = {"matrix-2.txt": "striated, skewed", "x3p-2.x3p": "striated"}
BALL_PIXELS = np.isfinite(render.first_seen(96, 96, VIEW, BALL)[0])
BATCHES = 8
KIND = Kind("conductor", "ellipsoid", fresnel=("schlick",), sampler="ellipsoid_cap")


def picture(A: np.ndarray, turn: float, samples: int) -> compare.Batches:
    """The ball; every model by the ellipsoid's formulas."""
    material = row(A.diagonal()[:2], f0=0.9, A=A)._replace(turn=still(math.cos(turn), math.sin(turn))[None])
    world = render.World(VIEW, BALL, LIGHTS, (material,))
    return compare.batches((KIND,), world, SETTINGS, count=BATCHES, samples=samples // BATCHES, seed=0)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--data", type=Path, default=Path("../shared/data/height"))
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--out", type=Path, default=Path("docs/figures"))
    arguments = parser.parse_args()
    figure = Figure(figsize=(9, 4.6), layout="constrained")
    panels = figure.subplots(len(SURFACES), len(build.MODELS) + 1)
    for (name, what), line in zip(SURFACES.items(), panels, strict=True):
        ladder = fitting.fit(readers.read(arguments.data / name), model="ellipsoid", tail="ggx")
        A = np.asarray(models.shape_matrix(ladder.best.theta), float)
        found = {}
        for model in reversed(build.MODELS):
            plainer, turn = build.plainer(A, model)
            found[model] = picture(plainer, turn, arguments.samples)
            off = compare.deviations(found[model], found["ellipsoid"], {"ball": BALL_PIXELS})["ball"]
            say(f"{name} ({what})", model=model, deviation=off.value, error=off.error, alpha_x=plainer[0, 0],
                alpha_y=plainer[1, 1], turn=math.degrees(turn), mean_slope=float(np.hypot(*plainer[2, :2])))  # fmt: skip
        difference = found["anisotropic"].mean - found["ellipsoid"].mean
        for panel, (model, each) in zip(line, found.items(), strict=False):
            panel.imshow(image.to_bytes(each.mean, 0.5), cmap="gray", vmin=0, vmax=255)
            panel.set_title(f"{name}: {model}", fontsize=8)
        line[-1].imshow(difference / found["ellipsoid"].mean.mean(), cmap="RdBu", vmin=-1, vmax=1)
        line[-1].set_title("without − with mean slope,\n±1 mean radiance", fontsize=8)
    for panel in panels.flat:
        panel.set_axis_off()
    write_atomically(arguments.out / "measured_balls.png", image.figure_bytes(figure))


if __name__ == "__main__":
    main()
