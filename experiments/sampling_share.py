"""dupuy2023 fig. 1 and table 1: which share of a picture's time goes into drawing visible normals, old method and new?

    python experiments/sampling_share.py [--samples 512] [--out docs/figures]

Balls of a rough conductor, and of a rough dielectric, on a plate of the same, under a sky and a sun: one ball, eight and
thirty-two, which a ray is tested against one after the other. [Hei18] is `cross_section`, (ours) `spherical_cap`.

A sampler is timed by itself, at the renderer's number of lanes, in a loop of its own random numbers, less a stand-in that
reads and writes the same; both and the stand-in in turns, just before and after the picture. Inside the renderer it cannot
be timed: the compiler mixes it with what is around it. The picture's time is of a bounce: intersections, light sampling,
BSDF, and the direction drawn.
"""

import argparse
import math
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from harness import row, still
from jax import lax
from matplotlib.figure import Figure

from ggxref import sampling
from ggxref.files import write_atomically
from ggxref.scene import image, lights, materials, render, shapes
from ggxref.scene.materials import Kind
from ggxref.scene.render import Picture

WIDTH, HEIGHT = 72, 48
NUMBER = still(0).astype(int)
ALPHA = (0.2, 0.2)
COUNTS = (1, 8, 32)
SEEDS = {"cross_section": 1, "spherical_cap": 2}
PICTURED = 8
SAMPLERS = {"[Hei18]": "cross_section", "(ours)": "spherical_cap"}
LIGHTS = (lights.Sky(still(0.2), still(0.8)), lights.Sun(still(0.48, -0.6, 0.64), still(math.radians(10)), still(10)))
TURNS = 21
DRAWS = 64


def balls(count: int) -> tuple[shapes.Shape, ...]:
    """A plate and so many balls on it in a square, which together fill the picture."""
    side = math.ceil(math.sqrt(count))
    radius = 1 / side
    places = [((2 * k + 1) * radius - 1, (2 * j + 1) * radius - 1) for j in range(side) for k in range(side)][:count]
    plate = shapes.Plane(still(0, 0, 0), still(0, 0, 1), still(1, 0, 0), NUMBER)
    return plate, *(shapes.Sphere(still(x, y, radius), still(radius), NUMBER) for x, y in places)


def drawers() -> dict:
    """Compiled: each sampler drawing `DRAWS` normals a lane, each seen along the one before; and a stand-in."""
    alpha = still(*ALPHA)
    lane = jnp.arange(render.LANES, dtype=jnp.uint32)

    def nothing(u, wi, alpha):
        return wi + (u[0] + u[1]) * alpha[0]

    forms = {name: getattr(sampling, name).sample for name in SAMPLERS.values()} | {"nothing": nothing}
    kernels = {}
    for name, form in forms.items():

        def draws(wi, alpha, form=form):
            def draw(k, wi):
                u = jnp.stack(render.uniforms(0, lane, k, 0)[:2])
                return jax.vmap(form, (-1, -1, None), -1)(u, wi, alpha)

            return lax.fori_loop(0, DRAWS, draw, wi)

        wi = jax.vmap(materials.cosine_lobe, -1, -1)(jnp.stack(render.uniforms(1, lane, 0, 0)[:2]))
        compiled = jax.jit(draws).lower(wi, alpha).compile()
        kernels[name] = lambda compiled=compiled, wi=wi: compiled(wi, alpha)
    return kernels


def seconds(work) -> float:
    begun = time.process_time()
    jax.block_until_ready(work())
    return time.process_time() - begun


def sampler_times(kernels: dict) -> dict[str, float]:
    """Nanoseconds of a direction drawn, less the stand-in's."""
    times = np.array([[seconds(kernel) for kernel in kernels.values()] for _ in range(TURNS)])
    middle = dict(zip(kernels, np.median(times, axis=0) / (render.LANES * DRAWS) * 1e9, strict=True))
    return {name: middle[name] - middle["nothing"] for name in SAMPLERS.values()}


def bounce_time(surface: str, sampler: str, count: int, samples: int, kernels: dict) -> tuple[float, float, Picture]:
    """Nanoseconds of a bounce, and those of the sampler, measured just before and after it; the picture."""
    kind = Kind(surface, sampler=sampler, fresnel=("exact",))
    view = render.look((0.0, -4.2, 2.6), (0.0, 0.0, 0.2), math.radians(32), WIDTH, HEIGHT)
    world = render.World(view, balls(count), LIGHTS, (row(ALPHA, eta=1.5, k=0.0 if surface == "dielectric" else 4.0),))
    settings = render.Settings(WIDTH, HEIGHT)
    render.prepare((kind,), world, settings)
    before = sampler_times(kernels)[sampler]
    picture = render.render((kind,), world, settings, samples=samples, block=samples, seed=SEEDS[sampler])
    after = sampler_times(kernels)[sampler]
    bounces = picture.bounces * picture.samples * picture.mean.size
    return picture.seconds / bounces * 1e9, (before + after) / 2, picture


def agreement(old: Picture, new: Picture) -> float:
    """Mean square of the difference of two pictures in variances: 1 if both go to the same."""
    difference, variance = old.mean - new.mean, (old.variance + new.variance) / old.samples
    seen = variance > 0
    return float(np.mean(difference[seen] ** 2 / variance[seen]))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--out", type=Path, default=Path("docs/figures"))
    arguments = parser.parse_args()
    kernels = drawers()
    print(
        "| scene | a bounce [ns] | drawing, [Hei18] [ns] | (ours) [ns] | share, [Hei18] | (ours) | speed-up | agreement |"
    )
    print("|---|---|---|---|---|---|---|---|")
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    panels = figure.subplot_mosaic([["shares", "conductor"], ["shares", "dielectric"]], width_ratios=[1.7, 1])
    axes = panels["shares"]
    for surface, mark in (("conductor", "o"), ("dielectric", "s")):
        shares = {name: [] for name in SAMPLERS}
        for count in COUNTS:
            found = {
                name: bounce_time(surface, sampler, count, arguments.samples, kernels)
                for name, sampler in SAMPLERS.items()
            }
            for name, (bounce, drawing, _) in found.items():
                shares[name].append(drawing / bounce)
            (old_bounce, old, before), (new_bounce, new, after) = found.values()
            cells = f"{(old_bounce + new_bounce) / 2:.0f}", f"{old:.1f}", f"{new:.1f}"
            ratio = (old / old_bounce) / (new / new_bounce)
            shown = *cells, f"{old / old_bounce:.2%}", f"{new / new_bounce:.2%}", f"×{ratio:.2f}"
            shown += (f"{agreement(before, after):.2f}",)
            print(f"| {count} of {surface} | " + " | ".join(shown) + " |", flush=True)
            if count == PICTURED:
                panels[surface].imshow(image.to_bytes(after.mean), cmap="gray", vmin=0, vmax=255, aspect="auto")
                panels[surface].set_title(f"{count} of {surface}, (ours)", fontsize=8)
                panels[surface].set_axis_off()
        for (name, values), color in zip(shares.items(), ("0.5", "tab:blue"), strict=True):
            axes.plot(COUNTS, 100 * np.array(values), f"{mark}-", color=color, label=f"{surface}, {name}")
    axes.set(xscale="log", xlabel="balls", ylabel="time in drawing normals [%]", ylim=(0, None))
    axes.set_xticks(COUNTS, [str(count) for count in COUNTS])
    axes.minorticks_off()
    axes.legend(fontsize=8)
    write_atomically(arguments.out / "sampling_share.png", image.figure_bytes(figure))


if __name__ == "__main__":
    main()
