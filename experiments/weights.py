"""heitz2014 fig. 4 and table 2: which weights can a sample get at grazing incidence, and how much of the square is wasted?

    python experiments/weights.py [--samples 10000000] [--out docs/figures]

theta_i = 1.5 and alpha = 0.5, reflection, F = 1. Table: over all samples, the largest weight, the share of weight 0 and the
variance. Maps: the weight over (u0, u1). The paper does not print its alpha, and orders its numbers its own way.
"""

import argparse
import math
from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from ggxref import bsdf, geometry, masking, ndf
from ggxref.files import write_atomically
from ggxref.sampling import normals, slope_beckmann, spherical_cap, v_cavity
from ggxref.scene import image

WI = jnp.array([math.sin(1.5), 0.0, math.cos(1.5)], jnp.float32)
ALPHA = jnp.array([0.5, 0.5], jnp.float32)
BLOCK = 1 << 17
LAWS = {
    "ggx": (normals.sample_ggx, normals.pdf_ggx, ndf.ggx, masking.g1_ggx, spherical_cap.sample),
    "beckmann": (
        normals.sample_beckmann,
        normals.pdf_beckmann,
        ndf.beckmann,
        masking.g1_beckmann,
        slope_beckmann.sample,
    ),
}


def smith(law: str, wm):
    g1 = LAWS[law][3]
    g1_i, wo = g1(WI, wm, ALPHA), geometry.reflect(WI, wm)
    g2 = masking.g2_separable(g1_i, g1(wo, wm, ALPHA))
    return g1_i, jnp.where(wo[2] > 0, g2, 0)


def previous(law: str, u):
    wm = LAWS[law][0](u[:2], ALPHA)
    return bsdf.weight_normals(WI, wm, smith(law, wm)[1])


def walters_trick(law: str, u):
    """Normals of the roughness α' = (1.2 − 0.2 √|ωi·n|) α, weighted by the ratio of the densities."""
    sample, pdf, D, _, _ = LAWS[law]
    wide = (1.2 - 0.2 * jnp.sqrt(WI[2])) * ALPHA
    wm = sample(u[:2], wide)
    return bsdf.weight_normals(WI, wm, smith(law, wm)[1]) * D(wm, ALPHA) * wm[2] / pdf(wm, wide)


def visible(law: str, u):
    wm = LAWS[law][4](u[:2], WI, ALPHA)
    g1_i, g2 = smith(law, wm)
    return bsdf.weight_visible(g1_i, g2, 1.0)


def cavity_g2(wm):
    wo = geometry.reflect(WI, wm)
    return jnp.where(wo[2] > 0, masking.g2_v_cavity(WI, wo, wm), 0)


def cavity_previous(law: str, u):
    wm = LAWS[law][0](u[:2], ALPHA)
    return bsdf.weight_normals(WI, wm, cavity_g2(wm))


def cavity_visible(law: str, u):
    wm = v_cavity.sample(u, WI, ALPHA, distribution="ggx" if law == "ggx" else "beckmann")
    return bsdf.weight_visible(masking.g1_v_cavity(WI, wm), cavity_g2(wm), 1.0)


METHODS: dict[str, tuple[Callable, float]] = {
    "previous, Smith": (previous, math.inf),
    "Walter's trick, Smith": (walters_trick, math.inf),
    "visible, Smith": (visible, 1),
    "previous, V-cavity": (cavity_previous, 2),
    "visible, V-cavity": (cavity_visible, 1),
}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--samples", type=int, default=10_000_000)
    parser.add_argument("--out", type=Path, default=Path("docs/figures"))
    arguments = parser.parse_args()
    n = 48
    square = (jnp.stack(jnp.meshgrid(jnp.arange(n), jnp.arange(n))).reshape(2, -1).astype(jnp.float32) + 0.5) / n
    square = jnp.concatenate([square, jax.random.uniform(jax.random.key(1), (1, n * n), jnp.float32)])
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    panels = figure.subplots(len(LAWS), len(METHODS))
    print("| law | method | largest | stated limit | share of 0 | mean | variance |\n|---|---|---|---|---|---|---|")
    for law, row in zip(LAWS, panels, strict=True):
        for (name, (method, limit)), panel in zip(METHODS.items(), row, strict=True):
            kernel = jax.jit(jax.vmap(lambda u, law=law, method=method: method(law, u), -1))
            largest, zeros, total, squares, count = 0.0, 0, 0.0, 0.0, 0
            for block in range(-(-arguments.samples // BLOCK)):
                w = np.asarray(kernel(jax.random.uniform(jax.random.key(block), (3, BLOCK), jnp.float32)), float)
                largest, zeros = max(largest, w.max()), zeros + (w == 0).sum()
                total, squares, count = total + w.sum(), squares + (w * w).sum(), count + BLOCK
            mean = total / count
            print(f"| {law} | {name} | {largest:.7g} | {limit:g} | {zeros / count:.2%} | {mean:.4f} | "
                  f"{squares / count - mean**2:.4g} |", flush=True)  # fmt: skip
            panel.imshow(np.asarray(kernel(square)).reshape(n, n), origin="lower", vmin=0, vmax=2, cmap="viridis")
            panel.set_title(f"{law}: {name}", fontsize=6)
            panel.set_axis_off()
    write_atomically(arguments.out / "weights.png", image.figure_bytes(figure))


if __name__ == "__main__":
    main()
