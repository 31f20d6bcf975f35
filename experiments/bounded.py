"""tokuyoshi2024: what does the bounded cap save, and where does it not pay?

    python experiments/bounded.py [--samples 200000] [--out docs/figures]

Light from a white hemisphere reflected by a conductor with F = 1: each sample's weight is f cos / pdf. For each roughness,
at 60 degrees and, in brackets, 85: the share of samples that end below the horizon, and variance × time of the bounded cap
over the whole one (below 1: it pays).
"""

import argparse
import math
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from ggxref import bsdf, geometry, jacobian, masking, ndf
from ggxref.files import write_atomically
from ggxref.sampling import bounded_cap, spherical_cap
from ggxref.scene import image

ALPHAS = (0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.5)
ANISOTROPY = (1.0, 4.0)
METHODS = {"whole": spherical_cap, "bounded": bounded_cap}


def weight(method, u, wi, alpha):
    """f cos / pdf of one sample; 0 below the horizon."""
    wm = method.sample(u, wi, alpha)
    wo = geometry.reflect(wi, wm)
    g2 = masking.g2_height_correlated(masking.g1_ggx(wi, wm, alpha), masking.g1_ggx(wo, wm, alpha))
    value = bsdf.brdf(wi, wo, ndf.ggx(wm, alpha), g2, 1.0) * wo[2]
    pdf = method.pdf(wm, wi, alpha) * jacobian.reflection(wo, wm)
    good = (wo[2] > 0) & (pdf > 0)
    return jnp.where(good, value / jnp.where(good, pdf, 1), 0)


def measure(kernel, u, theta: float, alpha) -> tuple[float, float, float, float]:
    """Share rejected, mean, variance, nanoseconds a sample (the least of ten)."""
    wi = jnp.array([math.sin(theta), 0.0, math.cos(theta)], jnp.float32)
    times, weights = [], np.zeros(0)
    for _ in range(10):
        begun = time.process_time()
        weights = np.asarray(jax.block_until_ready(kernel(u, wi, jnp.array(alpha, jnp.float32))), float)
        times.append(time.process_time() - begun)
    return (weights == 0).mean(), weights.mean(), weights.var(), min(times) / u.shape[1] * 1e9


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--samples", type=int, default=200_000)
    parser.add_argument("--out", type=Path, default=Path("docs/figures"))
    arguments = parser.parse_args()
    u = jax.random.uniform(jax.random.key(0), (2, arguments.samples), jnp.float32)
    kernels = {
        name: jax.jit(jax.vmap(lambda u, wi, alpha, method=method: weight(method, u, wi, alpha), (-1, None, None), -1))
        for name, method in METHODS.items()
    }
    figure = Figure(figsize=(7, 3), layout="constrained")
    rejected, work = figure.subplots(1, 2)
    print(
        "| ratio | angle | alpha_x | rejected whole | rejected bounded | variance ratio | ns whole | ns bounded | variance x time |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for ratio in ANISOTROPY:
        for theta, mark in ((60, "o-"), (85, "s--")):
            rows = []
            for alpha in ALPHAS:
                found = {
                    name: measure(k, u, math.radians(theta), (alpha, alpha / ratio)) for name, k in kernels.items()
                }
                (lost, mean, var, ns), (lost_b, mean_b, var_b, ns_b) = found["whole"], found["bounded"]
                assert abs(mean - mean_b) < 6 * math.sqrt((var + var_b) / arguments.samples) + 1e-6
                rows.append((lost, lost_b, var_b * ns_b / (var * ns)))
                print(f"| {ratio:g} | {theta} | {alpha:g} | {lost:.2%} | {lost_b:.2%} | {var_b / var:.3f} | {ns:.1f} | {ns_b:.1f} "
                      f"| {rows[-1][2]:.3f} |")  # fmt: skip
            lost, lost_b, product = np.array(rows).T
            label = f"αx/αy = {ratio:g}, {theta}°"
            (line,) = rejected.plot(ALPHAS, 100 * lost, mark, ms=3, lw=1, label=label)
            rejected.plot(ALPHAS, 100 * lost_b, mark, ms=3, lw=1, color=line.get_color(), alpha=0.4)
            work.plot(ALPHAS, product, mark, ms=3, lw=1, label=label)
    rejected.set(xscale="log", xlabel="αx", ylabel="rejected [%] (pale: bounded)")
    work.set(xscale="log", xlabel="αx", ylabel="variance × time, bounded / whole")
    work.axhline(1, color="k", lw=0.5)
    work.legend(fontsize=6)
    write_atomically(arguments.out / "bounded.png", image.figure_bytes(figure))


if __name__ == "__main__":
    main()
