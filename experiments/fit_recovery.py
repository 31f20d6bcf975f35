"""Do fits of synthetic data find what made them, do their intervals hold it 95 times in 100, and is the right model chosen?

    python experiments/fit_recovery.py intervals --trials 600 --seed 501 --page docs/fitting.md
    python experiments/fit_recovery.py choice --trials 500 --seed 502 --page docs/fitting.md
    python experiments/fit_recovery.py skew --trials 60 --seed 303 --page docs/fitting.md

Reflectance: 960 directions, five incident; slopes: 8192 independent ones. A trial is one draw of the noise. Each part writes its
table between its two marks of the page.
"""

import argparse
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy.stats

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

import fit_data
from part import write_part

from ggxref.fit import models, objectives, parameters, selection, solver
from ggxref.fit.data import Reflectance, Source, direction
from ggxref.fit.fitting import Fit, fit_many
from ggxref.fit.models import Surface
from ggxref.fit.parameters import Model
from ggxref.fit.preparation import TAILS
from ggxref.fit.problem import Problem, from_reflectance, from_slopes
from ggxref.fit.slopes import TILES, Slopes

MEAN, ROUND = (0.0, 0.0), ((0.04, 0.0), (0.0, 0.04))
TRUTH = {
    "isotropic": (MEAN, ROUND),
    "anisotropic": (MEAN, ((0.09, 0.0), (0.0, 0.01))),
    "rotated": (MEAN, ((0.06, 0.03), (0.03, 0.05))),
    "ellipsoid": ((0.06, -0.04), ((0.06, 0.03), (0.03, 0.05))),
}
"""Mean slope and scatter of what makes the data."""
GAMMA = 3.0
F0, DIFFUSE, NOISE = 0.6, 0.1, 0.1
BATCH = 50
"""Problems side by side."""
MODELS = {model.name: model for model in parameters.ladder(parameters.SHAPES, parameters.TAILS)}


class Maker(NamedTuple):
    """What makes the data: θ, its surface and model, the exact BRDF in directions, and the noise floor."""

    theta: np.ndarray
    model: Model
    wi: np.ndarray
    wo: np.ndarray
    exact: np.ndarray
    floor: float


def maker(model: Model, mean=None) -> Maker:
    theta = truth(model, mean)
    zenith_i, azimuth_i, zenith_o, azimuth_o = np.radians(fit_data.angles()).T
    wi, wo = direction(zenith_i, azimuth_i), direction(zenith_o, azimuth_o)
    wm = (wi + wo) / np.linalg.norm(wi + wo, axis=1, keepdims=True)
    with solver.float64():
        exact = models.brdfs(theta, wi.T, wo.T, wm.T, Surface(tail=model.tail))[0]
    return Maker(theta, model, wi, wo, exact, floor(exact, wo))


def floor(exact: np.ndarray, wo: np.ndarray) -> float:
    """The ε with which `noisy` makes data in which a fit finds ε again, on average over draws."""
    draws = np.random.default_rng(0).normal(size=(50, len(exact)))
    found = objectives.noise_floor(exact[:, None], wo)
    for _ in range(30):
        found = float(np.mean([objectives.noise_floor(noisy(exact, wo, found, draw)[:, None], wo) for draw in draws]))
    return found


def noisy(exact: np.ndarray, wo: np.ndarray, floor: float, normal: np.ndarray) -> np.ndarray:
    """f with lognormal noise of f cosθo + ε."""
    return ((exact * wo[:, 2] + floor) * np.exp(NOISE * normal) - floor) / wo[:, 2]


def truth(model: Model, mean=None) -> np.ndarray:
    """θ of the model's shape in TRUTH."""
    made, scatter = TRUTH[model.name.partition(" ")[0]]
    C = np.linalg.cholesky(scatter)
    gamma = GAMMA if model.tail == "student_t" else 2.0
    values = (C[0, 0], C[1, 1], C[1, 0], *(made if mean is None else mean), gamma, F0, DIFFUSE)
    return np.array([parameters.from_user(*each) for each in zip(parameters.names(("brdf",)), values, strict=True)])


def problem(made: Maker, noise: str, key: list[int]) -> Problem:
    """One draw. The noise is lognormal: of f cosθo + ε, as in the fit's residual, or of f "alone", down to 0; or there are slopes."""
    random = np.random.default_rng(key)
    if noise == "slopes":
        return from_slopes(slopes(made, random))
    one = np.ones(len(made.wo))
    values = noisy(made.exact, made.wo, 0.0 if noise == "alone" else made.floor, random.normal(size=len(one)))
    source = Source("synthetic", "none", "")
    data = Reflectance(made.wi, made.wo, values[:, None], one, one > 0, ("brdf",), source)
    return from_reflectance(data, Surface(), min_cosine=0.05, most=4096)


def slopes(made: Maker, random: np.random.Generator, count: int = 8192) -> Slopes:
    """Independent slopes with GGX's tail: a normal over the root of an exponential variable."""
    mean, scatter = TRUTH[made.model.name]
    normal = random.normal(size=(count, 2)) @ np.linalg.cholesky(scatter).T / math.sqrt(2)
    return Slopes(normal / np.sqrt(random.exponential(size=(count, 1))) + mean, np.arange(count) % TILES**2, 0)


def fits(made: Maker, noise: str, ladder: list[Model], trials: int, key: list[int]) -> Iterator[tuple[Fit, ...]]:
    for start in range(0, trials, BATCH):
        several = [problem(made, noise, [*key, k]) for k in range(start, min(start + BATCH, trials))]
        yield from fit_many(several, ladder, [{}] * len(several))


CASES = (
    *(("floor", shape) for shape in TRUTH),
    ("floor", "ellipsoid beckmann"),
    ("floor", "ellipsoid student_t"),
    ("slopes", "ellipsoid"),
    ("alone", "isotropic"),
)
TITLES = {"floor": "", "slopes": ", slopes", "alone": ", noise of f alone"}


def intervals(trials: int, seed: int, only: str | None) -> Iterator[str]:
    yield "| made by | parameter | bias / error of a fit | bias / its own error | intervals that hold it | all biases 0: p |"
    yield "|---|---|---|---|---|---|"
    for number, (noise, name) in enumerate(case for case in CASES if only in (None, case[1])):
        made = maker(MODELS[name])
        found = [each for (each,) in fits(made, noise, [made.model], trials, [seed, number])]
        # An isotropic model's two alphas are one.
        free = [int(k) for k in np.flatnonzero(found[0].space.moved) if k != 1 or not name.startswith("isotropic")]
        names = [parameters.names(("brdf",))[k] for k in free]
        off = np.array([each.theta[free] - made.theta[free] for each in found])
        held = np.mean([covered(each, made.theta, free, names) for each in found], axis=0)
        spread = off.std(axis=0, ddof=1)
        mean = off.mean(axis=0)
        for k, parameter in enumerate(names):
            yield (
                f"| {name}{TITLES[noise]} | {parameter} | {mean[k] / spread[k]:+.3f} | "
                f"{mean[k] / spread[k] * math.sqrt(trials):+.2f} | {100 * held[k]:.1f} % | {hotelling(off) if not k else ''} |"
            )


def covered(fit: Fit, theta: np.ndarray, free: list[int], names: list[str]) -> list[bool]:
    ends = [[parameters.from_user(name, end) for end in fit.intervals[name]] for name in names]
    return [low <= theta[k] <= high for k, (low, high) in zip(free, ends, strict=True)]


def hotelling(off: np.ndarray) -> str:
    """The probability of a mean as far from 0 in any direction, were all biases 0."""
    n, p = off.shape
    mean = off.mean(axis=0)
    square = n * mean @ np.linalg.solve(np.atleast_2d(np.cov(off.T)), mean)
    return f"{scipy.stats.f.sf(square * (n - p) / (p * (n - 1)), p, n - p):.2f}"


def choice(trials: int, seed: int, only: str | None) -> Iterator[str]:
    ladder = parameters.ladder(parameters.SHAPES, TAILS)
    yield f"| made by, of {trials} | chosen: that model | a smaller one that it holds | another |"
    yield "|---|---|---|---|"
    for number, name in enumerate(name for name in TRUTH if only in (None, name)):
        made = maker(MODELS[name])
        chosen = [chosen_of(each) for each in fits(made, "floor", ladder, trials, [seed, number])]
        smaller = [each != name and holds(name, each) for each in chosen]
        others = {each: chosen.count(each) for each in chosen if each != name and not holds(name, each)}
        said = ", ".join(f"{each}: {count}" for each, count in sorted(others.items(), key=lambda item: -item[1]))
        yield f"| {name} | {chosen.count(name)} | {sum(smaller)} | {said or 0} |"


def holds(large: str, small: str) -> bool:
    """Is the second model a case of the first?"""
    shapes = list(TRUTH)
    (shape, _, tail), (other, _, its_tail) = large.partition(" "), small.partition(" ")
    return shapes.index(other) <= shapes.index(shape) and its_tail in ("", tail)


def chosen_of(ladder: tuple[Fit, ...]) -> str:
    names, losses, blocks = zip(*((fit.model.name, fit.held_out, fit.held_out_blocks) for fit in ladder), strict=True)
    return selection.choose(names, np.stack(losses), blocks=np.stack(blocks))


SKEWS = (0.0, 0.001, 0.002, 0.003, 0.004, 0.006, 0.008)


def skew(trials: int, seed: int, _) -> Iterator[str]:
    ladder = parameters.ladder(parameters.SHAPES, ["ggx"])
    yield "| mean slope | in its standard errors | ellipsoid chosen |"
    yield "|---|---|---|"
    for number, size in enumerate(SKEWS):
        made = maker(MODELS["ellipsoid"], (0.8 * size, -0.6 * size))
        found = list(fits(made, "floor", ladder, trials, [seed, number]))
        error = math.sqrt(np.mean([each[-1].covariance[3, 3] + each[-1].covariance[4, 4] for each in found]) / 2)
        share = np.mean([chosen_of(each) == "ellipsoid" for each in found])
        yield f"| {size:g} | {size / error:.1f} | {100 * share:.0f} % |"


PARTS = {"intervals": intervals, "choice": choice, "skew": skew}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("--trials", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", metavar="MODEL", help="of the models that make the data")
    parser.add_argument("--page", type=Path, help="write the table into this page too")
    given = parser.parse_args()
    lines = []
    for line in PARTS[given.part](given.trials, given.seed, given.only):
        print(line, flush=True)
        lines.append(line)
    if given.page:
        write_part(given.page, f"{given.part}: experiments/fit_recovery.py", "\n".join([*lines, ""]))


if __name__ == "__main__":
    main()
