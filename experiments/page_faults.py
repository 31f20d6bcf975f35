"""What do large arrays cost beyond their kernel? The cap sampler at 2²² points, with fresh memory for each result and with kept memory.

    python experiments/page_faults.py

glibc gives large arrays back to the operating system, and asks for the next anew, a page at a time. The environment is read when a process
starts, hence one process for each setting. Components are arrays of their own, of 16 MB; "packed": in one of 48 MB.
"donated": the result takes the place of the one before.
"""

import os
import resource
import subprocess
import sys

import jax
import jax.numpy as jnp

from ggxref.measure import peers, speed
from ggxref.sampling import spherical_cap

POINTS = 1 << 22
SETTINGS = (
    {},
    {"GLIBC_TUNABLES": "glibc.malloc.hugetlb=1"},  # pages of 2 MB
    {"MALLOC_MMAP_THRESHOLD_": str(1 << 32), "MALLOC_TRIM_THRESHOLD_": str(1 << 33)},  # keep what was freed
)


def in_place(args, options=None):
    """A subject whose result takes the place of the one before, which it is given and does not read; `options` are XLA's."""
    u, wi, alpha = args
    mapped = jax.vmap(spherical_cap.sample, (-1, -1, None), -1)

    def run(u, wi, _):
        return speed.components(mapped(jnp.stack(u), jnp.stack(wi), alpha))

    # Donated ω_i would be copied first: a loop of several results may not write where it reads.
    program = jax.jit(run, donate_argnums=2, keep_unused=True, compiler_options=options)
    u, wi = speed.components(u), speed.components(wi)
    kept = [[jnp.zeros(POINTS, jnp.float32) for _ in range(3)]]

    def call():
        kept[0] = jax.block_until_ready(program(u, wi, kept[0]))

    return call


def faults(call) -> float:
    """Pages that the kernel maps in one call, of four."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(4):
        call()
    return (resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before) / 4


def main():
    args = speed.inputs(("u", "wi", "alpha"), POINTS)
    subjects = {
        "fresh": speed.subject(spherical_cap.sample, args),
        "donated": in_place(args),
        "packed": speed.subject(spherical_cap.sample, args, apart=False),
        "copy": speed.copy(args),
    }
    subjects |= {name: call for name, call in peers.mitsuba(POINTS).items() if name == "mitsuba sample"}
    for t in speed.interleaved(subjects, POINTS, seconds=10):
        pages = faults(subjects[t.subject])
        print(
            f"  {t.subject:15s} {t.median:5.1f} ns [{t.lower:.1f}, {t.upper:.1f}], {pages:.0f} pages a call", flush=True
        )


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main()
    else:
        for settings in SETTINGS:
            print(" ".join(f"{name}={value}" for name, value in settings.items()) or "defaults", flush=True)
            subprocess.run([sys.executable, __file__, "here"], env=os.environ | settings, check=True)
