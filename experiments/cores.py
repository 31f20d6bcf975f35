"""What does a second core bring? The cap sampler and a conductor's BRDF beside Mitsuba's. Writes docs/speed-accuracy.md's table.

    python experiments/cores.py docs/speed-accuracy.md

float32, one material, vectors as three arrays, all subjects of a size in one interleaved run; a process for each setting, as cores and
dispatch are given when one starts. "waiting": the caller's thread computes too (no asynchronous dispatch). At 2²² points the cap's
result takes the place of the one before. Needs an idle machine with two cores, and the extra `peers`.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import jax
from page_faults import POINTS as DONATED
from page_faults import in_place
from part import write_part

from ggxref.measure import peers, speed
from ggxref.measure.variants.brdf import one_expression
from ggxref.sampling import spherical_cap

KERNELS = {"cap": (spherical_cap.sample, "mitsuba sample"), "BRDF": (one_expression, "mitsuba conductor")}
# Cores, asynchronous dispatch, bits of a vector.
SETTINGS = {
    "one core": (1, True, 256),
    "one core, waiting, 512 bits": (1, False, 512),
    "two cores": (2, True, 256),
    "two cores, waiting": (2, False, 256),
    "two cores, waiting, 512 bits": (2, False, 512),
}
# Seconds: at 2²² points ten calls, before which Mitsuba's threads still take a core.
SETTLE = 0.1
SIZES = 1 << 8, 1 << 12, 1 << 16, 1 << 18, 1 << 20


def measured(size: int, bits: int) -> dict[str, tuple[float, float]]:
    """Of each kernel: nanoseconds a point, and how many times faster than Mitsuba's."""
    options = {"xla_cpu_prefer_vector_width": bits}
    subjects = {
        name: in_place(args, options) if size == DONATED else speed.subject(kernel, args, options=options)
        for name, (kernel, _) in KERNELS.items()
        if size < DONATED or name == "cap"
        for args in [speed.inputs(speed.arguments(kernel), size)]
    }
    others = {name: call for name, call in peers.mitsuba(size).items() if name in dict(KERNELS.values()).values()}
    ran = {t.subject: t.median for t in speed.interleaved(subjects | others, size, seconds=10, settle=SETTLE)}
    return {name: (ran[name], ran[KERNELS[name][1]] / ran[name]) for name in subjects}


def run(name: str) -> None:
    """One setting, in this process: a line of JSON for the table."""
    cores, dispatch, bits = SETTINGS[name]
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:cores])
    jax.config.update("jax_cpu_enable_async_dispatch", dispatch)
    print(json.dumps([measured(size, bits) for size in (*SIZES, DONATED)]))


def table() -> str:
    head = " | ".join(f"2^{size.bit_length() - 1}" for size in (*SIZES, DONATED))
    lines = [f"{speed.machine()}; medians [ns a point], and how many times faster than Mitsuba with as many cores.\n"]
    lines += [f"| kernel | setting | {head}, donated |", "|---|---|" + "---|" * (len(SIZES) + 1)]
    for setting in SETTINGS:
        done = subprocess.run([sys.executable, __file__, setting], stdout=subprocess.PIPE, check=True, text=True)
        found = json.loads(done.stdout.splitlines()[-1])
        for name in KERNELS:
            cells = ("{:.2g}, {:.2f} ×".format(*sizes[name]) if name in sizes else "" for sizes in found)
            lines.append(f"| {name} | {setting} | {' | '.join(cells)} |")
            print(lines[-1], flush=True)
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    if sys.argv[1] in SETTINGS:
        run(sys.argv[1])
    else:
        write_part(Path(sys.argv[1]), "cores: experiments/cores.py", table())
