"""Is it the same picture as Mitsuba's? A rough conductor ball, a constant sky and a square light, the same parameters.

    python experiments/against_mitsuba.py [--samples 4096] [--variant llvm_ad_rgb] [--out docs/figures]

Needs the `peers` extra, and for the LLVM variants LLVM's library (DRJIT_LIBLLVM_PATH); `scalar_rgb` needs neither.
Mitsuba's rough conductor has the separable G2. Prints the difference in standard errors (a mean of squares of 1 is
agreement), and the samples per second of processor time of both.
"""

import argparse
import math
import time
from dataclasses import replace
from pathlib import Path

import mitsuba as mi
import numpy as np
from harness import row, say, still
from matplotlib.figure import Figure

from ggxref.files import write_atomically
from ggxref.scene import image, lights, render, shapes
from ggxref.scene.materials import Kind

WIDTH, HEIGHT, FOV = 48, 32, 35.0
ORIGIN, TARGET = (0.5, -4.0, 1.5), (0.0, 0.0, 0.0)
ALPHA, ETA, K = 0.3, 0.2, 3.9
LIGHT, LIGHT_SIZE, RADIANCE = (-2.0, -1.5, 2.5), 0.4, 20.0


def theirs(variant: str):
    """Mitsuba's scene, and the light's frame as a matrix."""
    mi.set_variant(variant)
    T = mi.ScalarTransform4f
    light = T().look_at(origin=LIGHT, target=TARGET, up=[0, 0, 1]) @ T().scale(LIGHT_SIZE)
    number = {name: {"type": "uniform", "value": value} for name, value in (("eta", ETA), ("k", K))}
    description = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": -1, "rr_depth": 5},
        "sensor": {
            "type": "perspective",
            "fov": FOV,
            "fov_axis": "y",
            "to_world": T().look_at(origin=ORIGIN, target=TARGET, up=[0, 0, 1]),
            "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "box"}},
        },
        "sky": {"type": "constant", "radiance": {"type": "uniform", "value": 0.5}},
        "ball": {"type": "sphere", "bsdf": {"type": "roughconductor", "distribution": "ggx", "alpha": ALPHA, **number}},
        "light": {
            "type": "rectangle",
            "to_world": light,
            "emitter": {"type": "area", "radiance": {"type": "uniform", "value": RADIANCE}},
        },
    }
    return mi.load_dict(description), np.array(light.matrix)


def ours(frame: np.ndarray) -> render.World:
    area = lights.Area(still(*frame[:3, 3]), still(*2 * frame[:3, 0]), still(*2 * frame[:3, 1]), still(RADIANCE))
    ball = shapes.Sphere(still(0, 0, 0), still(1), still(0).astype(int))
    view = render.look(ORIGIN, TARGET, math.radians(FOV), WIDTH, HEIGHT)
    return render.World(view, (ball,), (lights.Sky(still(0.5), still(0.5)), area), (row((ALPHA, ALPHA), eta=ETA, k=K),))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--samples", type=int, default=4096)
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--out", type=Path, default=Path("docs/figures"))
    arguments = parser.parse_args()
    scene, frame = theirs(arguments.variant)
    np.array(mi.render(scene, spp=2))  # compiles, in the LLVM variants
    batches, seconds = [], 0.0
    for seed in range(8):
        begun = time.process_time()
        batches.append(np.array(mi.render(scene, spp=arguments.samples // 8, seed=seed))[..., :3].mean(axis=-1))  # pyright: ignore[reportArgumentType]
        seconds += time.process_time() - begun
    peer, peer_error = np.mean(batches, axis=0), np.std(batches, axis=0, ddof=1) / math.sqrt(8)

    settings = render.Settings(WIDTH, HEIGHT)
    kind, world = Kind(g2=("separable",)), ours(frame)
    render.render((kind,), world, settings, samples=2)  # compiles
    mine = render.render((kind,), world, settings, samples=arguments.samples)
    for name, picture in (("same G2", mine), ("control: correlated G2", None)):
        if picture is None:
            correlated = replace(kind, g2=("height_correlated",))
            picture = render.render((correlated,), world, settings, samples=arguments.samples)
        score = (picture.mean - peer) / np.sqrt(picture.error**2 + peer_error**2 + 1e-12)
        ball = np.abs(peer - 0.5) > 1e-6
        # Student's t with 7 degrees of freedom on their side: its square's mean is at most 7/5.
        say(name, pixels=int(ball.sum()), mean_square_of_errors=float((score[ball] ** 2).mean()),
            mean_difference=float((picture.mean - peer)[ball].mean() / peer[ball].mean()),
            its_error=float(np.sqrt((picture.error**2 + peer_error**2)[ball].sum()) / ball.sum() / peer[ball].mean()))  # fmt: skip
    count = arguments.samples * WIDTH * HEIGHT
    say("samples per second", ggxref=count / mine.seconds, mitsuba=count / seconds, variant=arguments.variant)

    figure = Figure(figsize=(8, 2.2), layout="constrained")
    pictures = {
        "ggxref": mine.mean,
        f"Mitsuba {mi.__version__}": peer,
        "difference, ±5 % of the mean": mine.mean - peer,
    }
    for panel, (name, picture) in zip(figure.subplots(1, 3), pictures.items(), strict=True):
        level = 0.05 * peer.mean()
        if "difference" in name:
            panel.imshow(picture, cmap="RdBu", vmin=-level, vmax=level)
        else:
            panel.imshow(image.to_bytes(picture, 0.6), cmap="gray", vmin=0, vmax=255)
        panel.set_title(name, fontsize=8)
        panel.set_axis_off()
    write_atomically(arguments.out / "against_mitsuba.png", image.figure_bytes(figure))


if __name__ == "__main__":
    main()
