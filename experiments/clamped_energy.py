"""How much energy does the min(1, ·) of walter2014 (6) lose, as a function of skew?

Light that leaves the surface steeply away from the mean normal sees less than the surface's projected area; there G1 would
have to exceed 1. The loss is 1 - A_ℓ⊥(u, n) G1(u)/(A_e⊥(n) |u·n|), by the equality that (31) then misses.

python experiments/clamped_energy.py
"""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from ggxref import ellipsoid, masking
from ggxref.files import write_atomically
from ggxref.scene.image import figure_bytes

FIGURE = Path(__file__).parent.parent / "docs" / "figures" / "clamped_energy.png"
TILTS = np.arange(0, 61, 1.0)
THETAS, ALPHAS = (15, 30, 60, 85), (0.05, 0.2, 0.5, 1.0)


@jax.jit
def loss(tilt, w, alpha):
    """Share of energy lost for light from w; the mean slope leans the surface by `tilt` degrees towards +x."""
    A = ellipsoid.from_slopes(jnp.stack([-jnp.tan(jnp.radians(tilt)), 0.0]), alpha**2 * jnp.eye(2))
    n = jnp.array([0.0, 0.0, 1.0])
    seen = ellipsoid.lune_area(w, n, A, 1.0) * masking.g1_ellipsoid(w, w, A)
    return 1 - seen / (ellipsoid.projected_area(n, A, 1.0) * w[2])


def direction(theta, phi):
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1)


def along(theta, alpha):
    """Loss over tilt for light in the plane of the skew, from the side that the surface leans away from."""
    w = jnp.asarray(direction(np.radians(theta), np.array(np.pi)), jnp.float32)
    return jax.vmap(loss, (0, None, None))(jnp.asarray(TILTS), w, alpha)


def diffuse(alpha):
    """Mean loss over a uniformly bright hemisphere: cosine-weighted directions, evenly spaced."""
    u, v = (x.ravel() for x in np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(128) + 0.5) / 128))
    w = jnp.asarray(direction(np.arcsin(np.sqrt(u)), 2 * np.pi * v), jnp.float32)
    return jax.vmap(lambda t: jax.vmap(loss, (None, 0, None))(t, w, alpha).mean())(jnp.asarray(TILTS))


def main() -> None:
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for theta in THETAS:
        left.plot(TILTS, 100 * along(theta, 0.2), label=f"θ = {theta}°")
    for alpha in ALPHAS:
        lost = 100 * diffuse(alpha)
        right.plot(TILTS, lost, label=f"α = {alpha:g}")
        print(
            f"α = {alpha:g}: lost under a white sky at 10, 30, 60° of skew:",
            *(f"{lost[k]:.2f} %" for k in (10, 30, 60)),
        )
    left.set(title="from one direction, opposite the mean normal, α = 0.2", ylabel="energy lost by min(1, ·) [%]")
    right.set(title="under a white sky", ylabel="energy lost by min(1, ·) [%]")
    for panel in (left, right):
        panel.set(xlabel="skew: angle of the mean slope [°]", xlim=(0, 60))
        panel.set_ylim(bottom=0)
        panel.title.set_fontsize(9)
        panel.grid(alpha=0.3)
        panel.legend(frameon=False)
    write_atomically(FIGURE, figure_bytes(figure))
    print(FIGURE)


if __name__ == "__main__":
    main()
