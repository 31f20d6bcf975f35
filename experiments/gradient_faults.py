"""Where is a derivative not finite? The formulas and samplers named below, over every region.

The gradient of each float32 function, summed over its components, with respect to all of its arguments, under `jit`. Points
whose value is itself infinite are counted apart. Prints a row for each function with faults and a total; exits with 1 if there
are any.

    python experiments/gradient_faults.py --points 1048576
"""

import argparse
import sys

import jax
import jax.numpy as jnp
import numpy as np
from rich.progress import track

from ggxref.measure.accuracy import arguments
from ggxref.measure.regions import REGIONS, rounded
from ggxref.measure.tables import DRAWS, library

FUNCTIONS = {
    "geometry": "reflect half_reflection refract half_refraction",
    "jacobian": "reflection refraction slope linear",
    "ndf": "ggx beckmann student_t ellipsoid",
    "masking": "lambda_ggx lambda_beckmann g1_ggx g1_beckmann g1_v_cavity g1_ellipsoid g2_separable g2_height_correlated g2_v_cavity",
    "fresnel": "schlick dielectric conductor",
    "ellipsoid": "canonical size gaussian_curvature projected_area lune_area mean_normal sggx",
    "bsdf": "brdf_ggx",
    "sampling.normals": "sample_ggx sample_beckmann pdf_ggx pdf_beckmann",
    "sampling.bounded_cap": "sample pdf bound",
    "sampling.ellipsoid_bounded": "sample pdf bound",
} | {
    f"sampling.{name}": "sample pdf"
    for name in ("spherical_cap", "cross_section", "slope_ggx", "slope_beckmann", "v_cavity", "lune", "ellipsoid_cap")
}
NAMES = [f"{module}.{name}" for module, names in FUNCTIONS.items() for name in names.split()]
BLOCK = 1 << 16


def _faulty(name: str):
    """Of a block of points: how many have a derivative that is not finite where the value is, how many no finite value."""
    function = library(name)
    names = arguments(function)

    def both(*args):
        def total(*args):
            return sum(jnp.sum(x) for x in jax.tree.leaves(function(*args)))

        value, slopes = jax.value_and_grad(total, argnums=tuple(range(len(args))))(*args)
        fine = jnp.all(jnp.stack([jnp.all(jnp.isfinite(s)) for s in slopes]))
        return jnp.isfinite(value) & ~fine, ~jnp.isfinite(value)

    return names, jax.jit(jax.vmap(both, in_axes=-1))


def faults(name: str, points: int, seed: int = 0) -> dict[str, tuple[int, int, str]]:
    """For each region with faults: their number, that of infinite values, and the first faulty input."""
    names, run = _faulty(name)
    draws = ("u3" if name == "sampling.v_cavity.sample" and n == "u" else n for n in DRAWS.get(name, names))
    draws, found = tuple(draws), {}
    for region, draw in REGIONS.items():
        rng = np.random.default_rng([seed, *region.encode()])
        bad = infinite = 0
        first = ""
        for _ in range(0, points, BLOCK):
            drawn = rounded(draw(rng, min(points, BLOCK)), np.float32)
            drawn["u3"] = np.concatenate([drawn["u"], drawn["x"].astype(np.float32)[None]])
            args = [drawn[d] for d in draws]
            faulty, without = map(np.asarray, run(*args))
            bad, infinite = bad + int(faulty.sum()), infinite + int(without.sum())
            if faulty.any() and not first:
                k = int(np.argmax(faulty))
                first = " ".join(f"{n}={a[..., k].tolist()}" for n, a in zip(names, args, strict=True))
        if bad or infinite:
            found[region] = bad, infinite, first
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--points", type=int, default=1 << 20, help="a region")
    parser.add_argument("--functions", default="", help="only names that hold this")
    options = parser.parse_args()
    names = [name for name in NAMES if options.functions in name]
    total = 0
    for name in track(names, description="functions"):
        for region, (bad, infinite, first) in faults(name, options.points).items():
            total += bad
            print(f"{name:36s} {region:14s} not finite {bad:8d}  value infinite {infinite:8d}  {first}", flush=True)
    print(f"{len(names)} functions, {len(REGIONS)} regions of {options.points} points: {total} derivatives not finite")
    sys.exit(total > 0)


if __name__ == "__main__":
    main()
