"""Do fits of synthetic data find what made them, do their intervals hold it 95 times in 100, and is the right model chosen?

    python experiments/fit_recovery.py --trials 500 --ladders 100

Reflectance: 960 directions, five incident; lognormal noise of 10 %. A trial is one draw of the noise.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

import fit_data

from ggxref.fit import parameters, selection
from ggxref.fit.data import Reflectance, Source, direction
from ggxref.fit.fitting import fit_many
from ggxref.fit.models import Surface
from ggxref.fit.problem import Problem, from_reflectance

TRUTH = {
    "isotropic": ((0.0, 0.0), ((0.04, 0.0), (0.0, 0.04))),
    "anisotropic": ((0.0, 0.0), ((0.09, 0.0), (0.0, 0.01))),
    "rotated": ((0.0, 0.0), ((0.06, 0.03), (0.03, 0.05))),
    "ellipsoid": ((0.06, -0.04), ((0.06, 0.03), (0.03, 0.05))),
}
F0, DIFFUSE, NOISE = 0.6, 0.1, 0.1
BATCH = 20


def problem(shape: str, exact: np.ndarray, degrees: np.ndarray, seed: int) -> Problem:
    noise = np.exp(NOISE * np.random.default_rng([seed, list(TRUTH).index(shape)]).normal(size=len(exact)))
    zenith_i, azimuth_i, zenith_o, azimuth_o = np.radians(degrees).T
    wi, wo = direction(zenith_i, azimuth_i), direction(zenith_o, azimuth_o)
    one = np.ones(len(exact))
    data = Reflectance(wi, wo, (exact * noise)[:, None], one, one > 0, ("brdf",), Source("synthetic", "none", ""))
    return from_reflectance(data, Surface(), min_cosine=0.05, most=4096)


def truth(shape: str) -> dict[str, float]:
    mean, scatter = TRUTH[shape]
    C = np.linalg.cholesky(scatter)
    found = {"alpha_x": C[0, 0], "alpha_y": C[1, 1], "shear": C[1, 0], "mean_x": mean[0], "mean_y": mean[1]}
    return found | {"f0": F0, "diffuse": DIFFUSE}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=500)
    parser.add_argument("--ladders", type=int, default=100, help="trials of the whole ladder, a shape")
    parser.add_argument("--shapes", default=",".join(TRUTH), help="of what makes the data")
    given = parser.parse_args()
    degrees = fit_data.angles()
    ladder = parameters.ladder(parameters.SHAPES, ["ggx"])
    print("| made by | parameter | bias / its standard error | intervals that hold it |\n|---|---|---|---|")
    chosen: dict[str, list[str]] = {}
    for model in (each for each in ladder if each.name in given.shapes.split(",")):
        exact = fit_data.brdf(degrees, fit_data.shape(*TRUTH[model.name]), F0, DIFFUSE)
        values, inside = [], []
        expected = truth(model.name)
        for start in range(0, given.trials, BATCH):
            problems = [
                problem(model.name, exact, degrees, seed) for seed in range(start, min(start + BATCH, given.trials))
            ]
            for (found,) in fit_many(problems, [model], [{}] * len(problems)):
                free = [n for n, moved in zip(problems[0].parameters, found.space.moved, strict=True) if moved]
                values.append([found.values[name] - expected[name] for name in free])
                inside.append([found.intervals[name][0] <= expected[name] <= found.intervals[name][1] for name in free])
        off = np.mean(values, axis=0) / (np.std(values, axis=0, ddof=1) / np.sqrt(len(values)))
        for name, bias, share in zip(free, off, np.mean(inside, axis=0), strict=True):
            print(f"| {model.name} | {name} | {bias:+.2f} | {100 * share:.1f} % |", flush=True)
        chosen[model.name] = []
        for start in range(0, given.ladders, BATCH):
            problems = [
                problem(model.name, exact, degrees, 10**6 + k) for k in range(start, min(start + BATCH, given.ladders))
            ]
            for fits in fit_many(problems, ladder, [{}] * len(problems)):
                losses = np.stack([fit.held_out for fit in fits])
                chosen[model.name].append(selection.choose([fit.model.name for fit in fits], losses))
    print("\n| made by | " + " | ".join(model.name for model in ladder) + " |\n" + "|---" * 5 + "|")
    for made, names in chosen.items():
        print(f"| {made} | " + " | ".join(str(names.count(model.name)) for model in ladder) + " |")


if __name__ == "__main__":
    main()
