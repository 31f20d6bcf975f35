"""How many samples a second does a streaming normalisation check reach, random numbers included?

Uniform numbers come from a Weyl sequence (a quasi-random lattice, one integer multiplication each), and the mean of
D cos / density over cap samples is accumulated without storing any; for GGX it is the projected area's share.

python experiments/normalisation_throughput.py
"""

import time

import jax
import jax.numpy as jnp
import numpy as np

from ggxref import ndf
from ggxref.measure.speed import machine
from ggxref.sampling import normals, spherical_cap

BLOCK = 1 << 18
WI = jnp.array([0.6, 0.0, 0.8], jnp.float32)
ALPHA = jnp.array([0.3, 0.1], jnp.float32)


@jax.jit
def block(index):
    """Mean of D cos θ over the density of visible normals in one block: 1 where every normal is visible."""
    k = index * jnp.uint32(BLOCK) + jnp.arange(BLOCK, dtype=jnp.uint32)
    # Multiples of 2^32/φ₂ and 2^32/φ₂² (Roberts' sequence): the top 24 bits are uniform numbers.
    u = [((k * jnp.uint32(c)) >> 8).astype(jnp.float32) * 2.0**-24 for c in (3242174889, 2447445414)]

    def weight(u0, u1):
        wm = normals.sample_ggx(jnp.stack([u0, u1]), ALPHA)
        return spherical_cap.pdf(wm, WI, ALPHA) / (ndf.ggx(wm, ALPHA) * wm[2])

    return jax.vmap(weight)(*u).mean()


def main(blocks: int = 400) -> None:
    jax.block_until_ready(block(jnp.uint32(0)))
    start = time.perf_counter()
    means = [block(jnp.uint32(i)) for i in range(blocks)]
    jax.block_until_ready(means)
    seconds = time.perf_counter() - start
    count = blocks * BLOCK
    print(machine())
    print(f"{count:.3g} samples in {seconds:.2f} s: {count / seconds:.3g} a second")
    print(f"integral of the visible normals' density: {float(np.mean([float(m) for m in means])):.7f}")


if __name__ == "__main__":
    main()
