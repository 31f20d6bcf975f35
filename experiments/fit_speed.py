"""How long do fits take: 100 materials of 10⁴ samples through the whole ladder, and one of them beside scipy's least squares?

    OPENBLAS_NUM_THREADS=1 taskset -c 0 python experiments/fit_speed.py scipy
    python experiments/fit_speed.py ladder --materials 100

The comparison is fair on one core without BLAS's threads alone: waiting for each other they take twice SciPy's processor time.
JAX is set as `ggxref fit` sets it. `--asynchronous` leaves it as it is in a program that calls `ggxref.fit.fit` itself.
"""

import argparse
import math
import sys
import time
from pathlib import Path

import numpy as np
import scipy.optimize

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

import fit_data

from ggxref.fit import command, lobes, parameters
from ggxref.fit.data import Reflectance, Source, direction
from ggxref.fit.fitting import fit_prepared
from ggxref.fit.preparation import Options, prepare


def measured(samples: int, seed: int) -> Reflectance:
    """An ellipsoid surface under 8 incident directions, with lognormal noise of 10 %."""
    random = np.random.default_rng(seed)
    alpha = np.exp(random.uniform(math.log(0.05), math.log(0.4), 2))
    A = fit_data.shape(tuple(random.normal(scale=0.05, size=2)), np.diag(alpha**2))
    zenith_i = np.repeat(np.linspace(5, 70, 8), samples // 8)
    outgoing = np.degrees(np.arccos(random.uniform(0.1, 1, len(zenith_i))))
    degrees = np.stack([zenith_i, np.full_like(zenith_i, 180), outgoing, random.uniform(0, 360, len(zenith_i))], axis=1)
    values = fit_data.brdf(degrees, A, 0.5, 0.1) * np.exp(0.1 * random.normal(size=len(degrees)))
    angles = np.radians(degrees)
    one = np.ones(len(values))
    source = Source(f"synthetic {seed}", "none", "")
    return Reflectance(
        direction(*angles[:, :2].T), direction(*angles[:, 2:].T), values[:, None], one, one > 0, ("brdf",), source
    )


def numpy_residuals(theta, wi, wo, wm, f, noise):
    """The same residuals in NumPy: GGX's ellipsoid, Smith's height-correlated G2, Schlick's F, a diffuse term."""
    alpha_x, alpha_y, shear, mean_x, mean_y = math.exp(theta[0]), math.exp(theta[1]), *theta[2:5]
    u = (-wm[0] / wm[2] - mean_x) / alpha_x
    v = (-wm[1] / wm[2] - mean_y - shear * u) / alpha_y
    D = 1 / (math.pi * alpha_x * alpha_y * (1 + u * u + v * v) ** 2 * wm[2] ** 4)

    def g1(w):
        x, y, z = alpha_x * w[0] + shear * w[1], alpha_y * w[1], w[2] - mean_x * w[0] - mean_y * w[1]
        return np.minimum(1, 2 * w[2] / (z + np.sqrt(x * x + y * y + z * z)))

    g_i, g_o = g1(wi), g1(wo)
    f0 = 1 / (1 + math.exp(-theta[6]))
    F = f0 + (1 - f0) * (1 - (wi * wm).sum(axis=0)) ** 5
    model = D * F * g_i * g_o / (g_i + g_o - g_i * g_o) / (4 * wi[2] * wo[2]) + math.exp(theta[7]) / math.pi
    r = np.log((model * wo[2] + noise) / (f[0] * wo[2] + noise))
    return r * np.sqrt(2 / (1 + np.sqrt(1 + r * r)))


REPEATS = 15


def beside_scipy(data: Reflectance) -> None:
    problem = prepare(data, Options(samples=10**6)).problem
    start = problem.starts[3]
    keep = [0, 1, 2, 3, 4, 6, 7]
    wi, wo, wm, f, noise = problem.samples

    def residuals(y):
        theta = start.copy()
        theta[keep] = y
        return numpy_residuals(theta, wi, wo, wm, f, noise)

    space = parameters.space(parameters.SHAPES["ellipsoid"], problem.parameters, {}, problem.scale)
    surface = problem.surface
    assert surface

    def ours():
        return lobes.minima(lobes.bank([problem]), surface, [space], [start[None]])[0]

    def theirs():
        return scipy.optimize.least_squares(residuals, start[keep])

    def theirs_from_few():
        few = slice(None, None, math.ceil(problem.size / 512))
        first = [part[..., few] if np.ndim(part) else part for part in (wi, wo, wm, f, noise)]

        def of_few(y):
            theta = start.copy()
            theta[keep] = y
            return numpy_residuals(theta, *first)

        return scipy.optimize.least_squares(residuals, scipy.optimize.least_squares(of_few, start[keep]).x)

    ours()
    # In turns, and the least and the middle of each: whatever else the machine does slows both.
    rounds = [(timed(ours), timed(theirs), timed(theirs_from_few)) for _ in range(REPEATS)]
    (mine, _), (found, _), (found_from_few, _) = rounds[0]
    cpu, cpu_scipy, cpu_few = np.array([[each[1] for each in turn] for turn in rounds]).T
    print(f"one fit of {problem.size} samples from one start: {cpu.min():.4f} s CPU, loss {mine.loss[0]:.12f}")
    print(
        f"scipy.optimize.least_squares: {cpu_scipy.min():.4f} s CPU, loss {found.cost / problem.size:.12f}, {found.nfev} steps"
    )
    print(f"ratio of the least of {REPEATS}: {cpu_scipy.min() / cpu.min():.1f}, "
          f"of the medians: {np.median(cpu_scipy) / np.median(cpu):.1f}")  # fmt: skip
    print(
        f"scipy's from the optimum of 512 samples, as ours goes: {cpu_few.min():.4f} s CPU, "
        f"loss {found_from_few.cost / problem.size:.12f}, ratio of the medians: {np.median(cpu_few) / np.median(cpu):.1f}"
    )


def timed(solve):
    """What it finds, and the processor's time that it takes."""
    begun = time.process_time()
    found = solve()
    return found, time.process_time() - begun


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=("scipy", "ladder"))
    parser.add_argument("--materials", type=int, default=100)
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--asynchronous", action="store_true")
    given = parser.parse_args()
    if not given.asynchronous:
        command.run_calls_where_they_are_made()
    if given.part == "scipy":
        beside_scipy(measured(given.samples, 0))
        return
    options = Options(samples=10**6)

    def ladders(count: int, samples: int) -> tuple[float, float]:
        several = [prepare(measured(samples, seed), options) for seed in range(count)]
        begun = time.perf_counter(), time.process_time()
        found = fit_prepared(several)
        names = [ladder.chosen for ladder in found]
        print(f"  chosen: { {name: names.count(name) for name in dict.fromkeys(names)} }")
        return time.perf_counter() - begun[0], time.process_time() - begun[1]

    cold, _ = ladders(21, 10_000)
    print(f"21 materials, with compilation: {cold:.1f} s")
    wall, cpu = ladders(given.materials, given.samples)
    print(
        f"{given.materials} materials of {given.samples} samples, 8 models each: {wall:.1f} s, {cpu:.1f} s CPU",
        flush=True,
    )
    few = max(given.materials // 10, 1)
    for samples in (given.samples * factor for factor in (2, 4, 8, 16)):
        wall, cpu = ladders(few, samples)
        print(
            f"{few} materials of {samples} samples: {wall:.1f} s, {cpu:.1f} s CPU, "
            f"{cpu / few / samples * 1e6:.1f} μs CPU a sample",
            flush=True,
        )


if __name__ == "__main__":
    main()
