"""Where is a derivative in float32 not finite, or wrong? Every public function, over every region.

Jacobians by reverse mode under `jit`, with respect to all arguments, against those in float64 at the same inputs; with
--proof those against difference quotients of the oracle, at that many points a region. Prints a row for each function and
exits with 1 if a derivative is not finite.

    python experiments/gradient_faults.py --points 65536
    python experiments/gradient_faults.py --proof 8
"""

import argparse
import sys
from functools import cache, partial

import jax.numpy as jnp
import numpy as np
from rich.progress import track

from ggxref import ndf, slopes
from ggxref.measure.accuracy import arguments
from ggxref.measure.derivatives import Derivative, measure, proof
from ggxref.measure.regions import REGIONS
from ggxref.measure.tables import DRAWS, library
from ggxref.sampling import table

FUNCTIONS = {
    "geometry": "reflect refract half_reflection half_refraction basis",
    "jacobian": "reflection refraction slope linear",
    "slopes": "from_normal to_normal stretch ggx beckmann student_t ellipsoid visible_ggx visible_beckmann",
    "ndf": "hemisphere ggx beckmann student_t ellipsoid",
    "masking": "lambda_ggx lambda_beckmann g1_ggx g1_beckmann g1_v_cavity g1_ellipsoid g2_separable g2_height_correlated g2_v_cavity",
    "fresnel": "schlick dielectric conductor",
    "ellipsoid": "shape_matrix canonical from_slopes to_slopes sggx size gaussian_curvature projected_area lune_area mean_normal",
    "bsdf": "brdf brdf_ggx btdf weight_normals weight_visible",
    "sampling.normals": "sample_ggx sample_beckmann pdf_ggx pdf_beckmann",
    "sampling.spherical_cap": "sample pdf cap_pdf",
    "sampling.bounded_cap": "sample pdf bound",
    "sampling.ellipsoid_bounded": "sample pdf bound",
    "sampling.lune": "sample pdf sample_rejection_sphere sample_rejection_ellipsoid",
    "sampling.table": "sample pdf",
} | {
    f"sampling.{name}": "sample pdf"
    for name in ("cross_section", "slope_ggx", "slope_beckmann", "v_cavity", "ellipsoid_cap")
}
# A row's name -> options other than the default.
OPTIONS = {f"sampling.v_cavity.{name}, beckmann": {"distribution": "beckmann"} for name in ("sample", "pdf")}
NAMES = [f"{module}.{name}" for module, names in FUNCTIONS.items() for name in names.split()] + [*OPTIONS]
# Arguments whose names do not say which points they take, beside those of the charts.
TAKEN = DRAWS | {
    "sampling.v_cavity.sample": ("u3", "wi", "alpha"),
    "sampling.spherical_cap.cap_pdf": ("wo", "wi"),
    "sampling.lune.sample_rejection_sphere": ("rows", "wi", "A"),
    "sampling.lune.sample_rejection_ellipsoid": ("rows", "wi", "A"),
}
ONE = jnp.ones(2)
# A gradient this far from the exact one is wrong.
LIMIT = 1e-4


@cache
def subject(name: str):
    """The function of that name, and the points that it takes."""
    public = name.partition(",")[0]
    function = library(public)
    if name in OPTIONS:
        function = partial(function, **OPTIONS[name])
    if name.startswith("sampling.table"):
        function = partial(
            function, table=table.build(partial(slopes.ggx, alpha=ONE), size=64, normals=partial(ndf.ggx, alpha=ONE))
        )
    return function, TAKEN.get(public, arguments(function))


def row(found: list[Derivative]) -> str:
    """A function's line of the table: its worst region, and each fault."""
    worst, points = max(found, key=lambda d: d.worst), sum(d.points for d in found)
    ill, p999 = sum(d.ill for d in found) / points, max(d.p999 for d in found)
    line = f"{worst.function:42s} ill-conditioned {ill:6.2%}  p99.9 {p999:7.1e}  largest {worst.worst:7.1e}"
    line += f"  {worst.region}, by {worst.worst_block}: {worst.worst_input}" if worst.worst else ""
    faults = [f"\n  {d.region:14s} not finite {d.not_finite:8d}  {d.fault_input}" for d in found if d.not_finite]
    return line + "".join(faults)


def grade(names: list[str], points: int) -> int:
    """Prints the table; the number of derivatives that are not finite."""
    faults, over = 0, []
    for name in track(names, description="functions"):
        found = [measure(name, *subject(name), region, points) for region in REGIONS]
        print(row(found), flush=True)
        faults += sum(d.not_finite for d in found)
        over += [name] if max(d.worst for d in found) > LIMIT else []
    print(f"{len(names)} functions, {len(REGIONS)} regions of {points} points: {faults} derivatives not finite")
    print(
        f"{len(names) - len(over)} within {LIMIT:g} wherever they are well-conditioned; not: {', '.join(over) or 'none'}"
    )
    return faults


def prove(names: list[str], points: int) -> None:
    """Prints how far the float64 derivatives, which the others are compared with, are from the oracle's, where either is not 0."""
    for name in track([n for n in names if "table" not in n], description="functions"):
        public, options = name.partition(",")[0], OPTIONS.get(name, {})
        found = np.concatenate([proof(public, *subject(name), region, points, **options) for region in REGIONS])
        spread = f"  median {np.median(found):7.1e}  largest {max(found):7.1e}" if len(found) else ""
        print(f"{name:42s} {len(found):6d} derivatives{spread}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--points", type=int, default=1 << 16, help="a region")
    parser.add_argument("--functions", default="", help="only names that hold this")
    parser.add_argument(
        "--proof", type=int, metavar="POINTS", help="compare float64 with the oracle, at that many a region"
    )
    options = parser.parse_args()
    names = [name for name in NAMES if options.functions in name]
    if options.proof:
        prove(names, options.proof)
    elif grade(names, options.points):
        sys.exit(1)


if __name__ == "__main__":
    main()
