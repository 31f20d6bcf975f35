"""What share of samples still reflects below the horizon with tokuyoshi2024's bounded cap, over α, anisotropy and θ?

python experiments/below_horizon.py
"""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from ggxref import geometry
from ggxref.files import write_atomically
from ggxref.sampling import bounded_cap, spherical_cap
from ggxref.scene.image import figure_bytes

FIGURE = Path(__file__).parent.parent / "docs" / "figures" / "below_horizon.png"
ALPHAS = np.geomspace(0.02, 2, 25)
THETAS = np.append(np.arange(0, 90, 4.0), 89.9)
RATIOS = (1, 4, 16)
AZIMUTH = np.pi / 4
POINTS = 4096


def lattice():
    """Evenly spread points of the square (the R2 sequence)."""
    k = np.arange(1, POINTS + 1)[:, None]
    return jnp.asarray((0.5 + k * np.array([0.7548776662466927, 0.5698402909980532])) % 1, jnp.float32)


def shares(method, ratio):
    """Share of samples below the horizon, (θ, α); α is √(α_x α_y)."""
    u = lattice()

    def below(theta, alpha):
        wi = jnp.stack([jnp.sin(theta) * np.cos(AZIMUTH), jnp.sin(theta) * np.sin(AZIMUTH), jnp.cos(theta)])
        both = jnp.stack([alpha * ratio**0.5, alpha / ratio**0.5])
        wo = jax.vmap(lambda u: geometry.reflect(wi, method.sample(u, wi, both)))(u)
        return jnp.mean(wo[:, 2] <= 0)

    row = jax.jit(jax.vmap(below, (None, 0)))
    return np.array([row(jnp.float32(np.radians(t)), jnp.asarray(ALPHAS, jnp.float32)) for t in THETAS])


def main() -> None:
    figure = Figure(figsize=(9, 5.4), layout="constrained")
    panels = figure.subplots(2, len(RATIOS), sharex=True, sharey=True)
    fill = {"levels": np.arange(0, 101, 10), "cmap": "viridis"}
    for row, (name, method) in zip(
        panels, {"whole cap": spherical_cap, "bounded cap": bounded_cap}.items(), strict=True
    ):
        for panel, ratio in zip(row, RATIOS, strict=True):
            share = 100 * shares(method, ratio)
            drawn = panel.contourf(ALPHAS, THETAS, share, **fill)
            lines = panel.contour(ALPHAS, THETAS, share, levels=[1, 20, 50, 80], colors="w", linewidths=0.7)
            if panel is panels[-1, -1]:
                figure.colorbar(drawn, ax=panels, label="samples below the horizon [%]")
            panel.clabel(lines, fmt="%g %%", fontsize=7)
            panel.set_xscale("log")
            panel.set_title(f"{name}, $α_x/α_y$ = {ratio}", fontsize=9)
            print(f"{name}, ratio {ratio}: largest {share.max():.1f} %, mean over the map {share.mean():.1f} %")
    for panel in panels[-1]:
        panel.set_xlabel("$\\sqrt{α_x α_y}$")
    for panel in panels[:, 0]:
        panel.set_ylabel("θ [°]")
    write_atomically(FIGURE, figure_bytes(figure))
    print(FIGURE)


if __name__ == "__main__":
    main()
