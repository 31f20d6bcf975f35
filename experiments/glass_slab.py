"""heitz2014 figs 1 and 9: what do visible normals buy on a glass slab, at equal time?

    python experiments/glass_slab.py [--seconds 5] [--out docs/figures]

The slab has n = 1.5 on all faces in a white sky, unbounded paths, BSDF and light sampling combined, as in the paper. Our
slab is a box along the axes, the paper's an unnamed plate; the estimates per second are of this renderer.
"""

import argparse
import math
from pathlib import Path

from harness import error_map, fireflies, row, say, still, work

from ggxref.scene import lights, render, shapes
from ggxref.scene.materials import Kind

SETTINGS = render.Settings(72, 48)
VIEW = render.look((1.6, -3.6, 2.4), (0, 0, 0), math.radians(34), 72, 48)
SLAB = shapes.Slab(still(-1.3, -0.9, -0.2), still(1.3, 0.9, 0.2), still(0).astype(int))
WHITE = (lights.Sky(still(1), still(1)),)

CASES = {
    "fig. 1: GGX (0.05, 0.4)": ((0.05, 0.4), "ggx", "spherical_cap"),
    "fig. 9: Beckmann 0.1": ((0.1, 0.1), "beckmann", "slope_beckmann"),
}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("--out", type=Path, default=Path("docs/figures"))
    arguments = parser.parse_args()
    for number, (case, (alpha, ndf, visible)) in enumerate(CASES.items()):
        world = render.World(VIEW, (SLAB,), WHITE, (row(alpha),))
        kinds = {name: Kind("dielectric", ndf, sampler=name) for name in ("normals", visible)}
        for kind in kinds.values():
            render.render((kind,), world, SETTINGS, samples=2)  # compiles
        truth = render.render((kinds[visible],), world, SETTINGS, samples=4096, seconds=4 * arguments.seconds, seed=9)
        found = {
            name: render.render((kind,), world, SETTINGS, samples=1 << 20, seconds=arguments.seconds, block=16)
            for name, kind in kinds.items()
        }
        for name, picture in found.items():
            say(case, sampler=name, samples=picture.samples, variance=picture.variance.mean(),
                largest_sample=picture.largest.max(), fireflies=fireflies(picture, truth),
                variance_times_time=work(picture), mean=picture.mean.mean(),
                error_of_mean=math.sqrt(picture.variance.mean() / picture.samples / picture.mean.size))  # fmt: skip
        before, after = found["normals"], found[visible]
        say(
            case,
            variance_ratio=before.variance.mean() / after.variance.mean(),
            at_equal_time=work(before) / work(after),
        )
        error_map(arguments.out / f"glass_slab_{number}.png", found, truth, case)


if __name__ == "__main__":
    main()
