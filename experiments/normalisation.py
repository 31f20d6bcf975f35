"""Does the streamed normalisation of visible normals hold to 10⁹ samples: constant memory, linear time, error N^-1/2?

And what do quasi-random points (Roberts' lattice, scrambled Sobol' of scipy) gain per second over random numbers?

python experiments/normalisation.py [10^9]
"""

import resource
import sys
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure
from scipy.stats import chi2, qmc

from ggxref.files import write_atomically
from ggxref.measure.speed import machine
from ggxref.sampling import spherical_cap
from ggxref.scene.image import figure_bytes
from ggxref.verify import distributed, montecarlo
from ggxref.verify.streamed import over_normals

FIGURE = Path(__file__).parent.parent / "docs" / "figures" / "normalisation.png"
WI, ALPHA = np.array([0.6, 0.0, 0.8], np.float32), np.array([0.3, 0.1], np.float32)
# Repetitions of each power of ten, so that a root mean square says more than one deviation.
REPEATS = {4: 64, 5: 64, 6: 32, 7: 8, 8: 2, 9: 1}
# The lattice is followed as far as float32 lets its error fall.
LATTICE = 10**7

integrand = over_normals(lambda m: spherical_cap.pdf(m, jnp.asarray(WI), jnp.asarray(ALPHA)), np.diag([*ALPHA, 1.0]))


def timed(draw):
    start = time.perf_counter(), time.process_time()
    value = draw()
    return value, time.perf_counter() - start[0], time.process_time() - start[1]


def streamed(count, points, number=0):
    return montecarlo.mean(integrand, count, name=f"normalisation {number}", about=1.0, points=points)


@jax.jit
def sobol_block(u):
    return jax.vmap(integrand)(u).mean()


def sobol(power, number):
    """Mean over 2^power points of scipy's scrambled Sobol' sequence, drawn and evaluated in pieces."""
    sequence, size = qmc.Sobol(2, rng=number), 1 << min(power, 20)
    return np.mean([sobol_block(jnp.asarray(sequence.random(size), jnp.float32)) for _ in range((1 << power) // size)])


def rows(largest):
    """Samples, root mean square error, seconds and processor seconds of one run, for each kind of points."""
    found = {"random": [], "lattice": [], "Sobol'": []}
    for points in ("random", "lattice"):  # compile
        streamed(1, points)
    for power in range(14, 21, 2):
        sobol(power, 0)
    for power, repeats in REPEATS.items():
        if 10**power > largest:
            break
        for points in ("random", "lattice") if 10**power <= LATTICE else ("random",):
            runs = [timed(lambda k=k, p=points: streamed(10**power, p, k)) for k in range(repeats)]  # noqa: B023
            found[points].append(summary(runs[0][0].count, [(e.mean, *t) for e, *t in runs]))
            print(points, *found[points][-1], flush=True)
    for power in range(14, 25, 2):
        runs = [timed(lambda k=k, p=power: sobol(p, k)) for k in range(8 if power < 22 else 2)]
        found["Sobol'"].append(summary(1 << power, runs))
        print("Sobol'", *found["Sobol'"][-1], flush=True)
    return {points: np.array(table) for points, table in found.items()}


def summary(count, runs):
    values, wall, cpu = np.array(runs, float).T
    return count, np.sqrt(np.mean((values - 1) ** 2)), np.mean(wall), np.mean(cpu)


def draw(found):
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    for points, marker in zip(found, "os^", strict=True):
        count, error, _, cpu = found[points].T
        left.loglog(count, error, marker, label=points, fillstyle="none" if points == "random" else "full")
        right.loglog(cpu, error, marker + "-", label=points, lw=0.8)
    count = found["random"][:, 0]
    sigma = streamed(10**6, "random").error * 1000
    left.loglog(count, sigma / np.sqrt(count), "k-", lw=0.8, label=f"{sigma:.2f} N$^{{-1/2}}$")
    # Where 95 of 100 root mean squares of so many deviations lie.
    repeats = np.array([REPEATS[power] for power in range(4, 4 + len(count))])
    low, high = (sigma * np.sqrt(chi2.ppf(p, repeats) / repeats / count) for p in (0.025, 0.975))
    left.fill_between(count, low, high, color="k", alpha=0.1, lw=0, label="95 % of the means")
    left.set(xlabel="samples N", ylabel="root mean square error of ∫ D$_{wi}$ dm = 1")
    right.set(xlabel="processor time [s]", ylabel="root mean square error")
    for panel in (left, right):
        panel.grid(alpha=0.3)
        panel.legend(frameon=False, loc="upper right")
    write_atomically(FIGURE, figure_bytes(figure))


def main(largest: int) -> None:
    distributed.use_all_cores()
    print(machine())
    found = rows(largest)
    draw(found)
    count, error, _, cpu = found["random"].T
    print("processor time per sample [ns]:", *(f"{t / n * 1e9:.1f}" for n, t in zip(count, cpu, strict=True)))
    # The logarithm of a root mean square of R deviations has the standard deviation 1/√(2R), about.
    weight = np.sqrt([REPEATS[power] for power in range(4, 4 + len(count))])
    print(f"slope of the error: {np.polyfit(np.log(count), np.log(error), 1, w=weight)[0]:.3f}")
    print(f"resident memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.2f} GiB")
    print(FIGURE)


if __name__ == "__main__":
    main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 10**9)
