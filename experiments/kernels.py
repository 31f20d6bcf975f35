"""What does a kernel cost beside Mitsuba's and beside a copy of its bytes, and what does it lose? Writes docs/speed-accuracy.md's table.

    taskset -c 0 python experiments/kernels.py docs/speed-accuracy.md

One core: on two, what a virtual machine's host takes from either makes a loop in two halves wait for the later one.

float32, one material (α = 0.3, 0.1), all kernels of a size in one interleaved run, vectors as three arrays (Mitsuba's way)
but in the row that says otherwise. Errors are the largest that sampling and
search find in all regions. Mitsuba's `sample` returns the density too. Needs an idle machine; the extra `peers` for Mitsuba's columns.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import jax.numpy as jnp
from part import write_part

from ggxref import masking, ndf, stable
from ggxref.measure import peers, speed
from ggxref.measure.accuracy import arguments, measure
from ggxref.measure.reference import REFERENCES
from ggxref.measure.regions import REGIONS
from ggxref.measure.variants import QUANTITIES
from ggxref.measure.variants.brdf import one_expression, three_bands
from ggxref.measure.variants.directions import cap_uncorrected
from ggxref.sampling import bounded_cap, cross_section, spherical_cap
from ggxref.sampling._sphere import half_in_cap, ray

PACKED, WIDE = "the same, packed in one array", "the same, vectors of 512 bits"
DIFFERENTLY = {PACKED: {"apart": False}, WIDE: {"options": {"xla_cpu_prefer_vector_width": 512}}}
SIZES = (1 << 16, 1 << 18, 1 << 20)
POINTS = 1 << 15


def cap_apart(u, wi, alpha):
    """The cap sampler without `stable.one_loop`: the compiler makes a loop of each component."""
    x, y, z = half_in_cap(u, ray(alpha[0] * wi[0], alpha[1] * wi[1], wi[2]), 0)
    return jnp.stack(stable.unit(alpha[0] * x, alpha[1] * y, z))


# Kernel, Mitsuba's of the same, the name of its reference; all of a group take the same arguments.
GROUPS = (
    {
        "spherical_cap.sample": (spherical_cap.sample, "mitsuba sample", "sampling.spherical_cap.sample"),
        PACKED: (spherical_cap.sample, "mitsuba sample", "sampling.spherical_cap.sample"),
        WIDE: (spherical_cap.sample, "mitsuba sample", "sampling.spherical_cap.sample"),
        "the same, a loop for each component": (cap_apart, "mitsuba sample", "sampling.spherical_cap.sample"),
        "the same, plain sum": (cap_uncorrected, "mitsuba sample", "sampling.spherical_cap.sample"),
        "bounded_cap.sample": (bounded_cap.sample, "mitsuba sample", "sampling.bounded_cap.sample"),
        "cross_section.sample": (cross_section.sample, "mitsuba sample", "sampling.cross_section.sample"),
    },
    {"spherical_cap.pdf": (spherical_cap.pdf, "mitsuba pdf", "sampling.spherical_cap.pdf")},
    {"ndf.ggx": (ndf.ggx, "mitsuba eval", "ndf.ggx")},
    {"masking.g1_ggx": (masking.g1_ggx, "", "masking.g1_ggx")},
    {
        "conductor, one expression": (one_expression, "mitsuba conductor", "brdf"),
        WIDE: (one_expression, "mitsuba conductor", "brdf"),
        "conductor, three bands": (three_bands, "mitsuba conductor, three bands", ""),
    }
    | {f"conductor, {v.name}": (v.function, "mitsuba conductor", "brdf") for v in QUANTITIES["brdf"].variants},
    {f"half vector, {v.name}": (v.function, "", "half") for v in QUANTITIES["half"].variants},
)


def times(group: dict) -> dict[str, list[tuple[speed.Timing, float | None, float]]]:
    """Per kernel and size: its timing, how many times faster than Mitsuba's, how many copies it takes."""
    found: dict[str, list] = {name: [] for name in group}
    for size in SIZES:
        wanted = {theirs for _, theirs, _ in group.values()}
        others = {name: call for name, call in peers.mitsuba(size).items() if name in wanted}
        for name in [n for n in group if n in DIFFERENTLY]:
            args = speed.inputs(arguments(group[name][0]), size)
            others[name] = speed.subject(group[name][0], args, **DIFFERENTLY[name])
        ours = {name: f for name, (f, _, _) in group.items() if name not in DIFFERENTLY}
        runs = speed.throughput(ours, size, seconds=4, peers=others)
        ran = {t.subject: t for t in runs}
        for name, (_, theirs, _) in group.items():
            ratio = ran[theirs].median / ran[name].median if theirs in ran else None
            found[name].append((ran[name], ratio, ran[name].median / ran["copy"].median))
    return found


def error(f: Callable, name: str) -> str:
    """p99.9 and the largest error of a kernel over all regions; its reference is a public function's or a quantity's."""
    if not name:
        return "| "
    reference = REFERENCES[name] if name in REFERENCES else QUANTITIES[name].reference
    graded = [measure(name, "", f, reference, region=region, count=POINTS, rounds=4) for region in REGIONS]
    unit = "ulp" if graded[0].unit == "ulp" else "× 2⁻²⁴"
    return f"{max(a.p999 for a in graded):.2g} {unit} | {max(a.worst for a in graded):.2g} {unit}"


def table() -> str:
    head = " | ".join(f"2^{size.bit_length() - 1} [ns]" for size in SIZES)
    lines = [
        f"{speed.machine()}; medians, lower quartile in brackets; after them, how many times faster than Mitsuba.\n",
        f"| kernel | {head} | time of a copy at 2^20 | p99.9 error | largest error found |",
        "|---|" + "---|" * (len(SIZES) + 3),
    ]
    for group in GROUPS:
        for name, sizes in times(group).items():
            cells = [f"{t.median:.1f} [{t.lower:.1f}]" + (f", {ratio:.2f} ×" if ratio else "") for t, ratio, _ in sizes]
            graded = error(group[name][0], group[name][2])
            lines.append(f"| {name} | {' | '.join(cells)} | {sizes[-1][2]:.1f} × | {graded} |")
            print(lines[-1], flush=True)
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    write_part(Path(sys.argv[1]), "kernels: experiments/kernels.py", table())
