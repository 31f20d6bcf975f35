"""heitz2014 figs 2 and 10: how do estimates of a rough conductor converge, and how many fireflies are left?

    python experiments/convergence.py [--samples 64] [--out docs/figures]

A GGX conductor, α = 0.05, Smith masking: a ball on a plate of the same metal, so that light is reflected several times, under
a sky with a wide, soft sun: a small one would be all the noise, whatever draws the normals. The paper's pedestal and
environment map are not available: the shapes and the light are ours. Above, the pictures with 64 samples a pixel; below,
running estimates of one pixel, each line its own random numbers.
"""

import argparse
import math
from pathlib import Path

import numpy as np
from harness import fireflies, row, say, still, work
from matplotlib.figure import Figure

from ggxref.files import write_atomically
from ggxref.scene import image, lights, render, shapes
from ggxref.scene.materials import Kind

WIDTH, HEIGHT = 96, 64
FOV = math.radians(24)
EYE, TO = (0.0, -6.0, 1.6), (0.0, 0.0, 0.75)
NUMBER = still(0).astype(int)
SHAPES = (
    shapes.Sphere(still(0, 0, 1), still(1), NUMBER),
    shapes.Plane(still(0, 0, 0), still(0, 0, 1), still(1, 0, 0), NUMBER),
)
LIGHTS = (lights.Sky(still(0.2), still(0.6)), lights.Sun(still(0.48, -0.6, 0.64), still(math.radians(25)), still(3)))
METAL = row((0.05, 0.05), f0=0.9)
METHODS = {"normals": "previous", "spherical_cap": "visible normals"}
STRATEGIES = {"bsdf": "BSDF sampling", "mis": "with light sampling (MIS)"}
# The plate in front of the ball, where it mirrors the ball: the running estimates' pixel.
POINT = (0.0, -1.15, 0.0)
LINES = 16
LONGEST = 12


def world(to, fov: float, width: int, height: int) -> render.World:
    return render.World(render.look(EYE, to, fov, width, height), SHAPES, LIGHTS, (METAL,))


def kind(sampler: str) -> Kind:
    return Kind("conductor", "ggx", fresnel=("schlick",), sampler=sampler)


def running(sampler: str, strategy: str) -> tuple[np.ndarray, np.ndarray]:
    """Estimates after 1, 2, 4, … samples: the same samples, and more of them. (lengths,), (lengths, lines)."""
    settings = render.Settings(LINES, 1, strategy)
    view = world(POINT, 1e-6, LINES, 1)
    counts = 2 ** np.arange(LONGEST + 1)
    return counts, np.array(
        [render.render((kind(sampler),), view, settings, samples=int(n), block=int(n)).mean[0] for n in counts]
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--out", type=Path, default=Path("docs/figures"))
    arguments = parser.parse_args()
    view = world(TO, FOV, WIDTH, HEIGHT)
    settings = {name: render.Settings(WIDTH, HEIGHT, name) for name in STRATEGIES}
    truth = render.render((kind("spherical_cap"),), view, settings["mis"], samples=64 * arguments.samples, seed=9)
    figure = Figure(figsize=(9.6, 5.2), layout="constrained")
    columns = [(strategy, sampler) for strategy in STRATEGIES for sampler in METHODS]
    panels = figure.subplots(2, len(columns), gridspec_kw={"height_ratios": (1, 1.1)})
    for (strategy, sampler), (above, below) in zip(columns, panels.T, strict=True):
        render.render((kind(sampler),), view, settings[strategy], samples=2)  # compiles
        picture = render.render((kind(sampler),), view, settings[strategy], samples=arguments.samples)
        counts, lines = running(sampler, strategy)
        title = f"{METHODS[sampler]},\n{STRATEGIES[strategy]}"
        say(
            title.replace("\n", " "),
            mean=picture.mean.mean(),
            error_of_mean=math.sqrt(picture.variance.mean() / picture.samples / picture.mean.size),
            variance=picture.variance.mean(),
            largest_sample=picture.largest.max(),
            fireflies=fireflies(picture, truth),
            variance_times_time=work(picture),
            spread_of_lines_at_the_end=float(lines[-1].std(ddof=1) / lines[-1].mean()),
            pixel=float(lines[-1].mean()),
        )
        above.imshow(image.to_bytes(picture.mean), cmap="gray", vmin=0, vmax=255)
        above.set_title(title, fontsize=8)
        above.set_axis_off()
        below.plot(counts, lines, color="black", lw=0.5, alpha=0.6)
        below.set(xscale="log", xlabel="samples", ylim=(0, 2 * lines[-1].mean()))
        below.tick_params(labelsize=7)
    panels[1, 0].set_ylabel("radiance of one pixel, running mean")
    write_atomically(arguments.out / "convergence.png", image.figure_bytes(figure))


if __name__ == "__main__":
    main()
