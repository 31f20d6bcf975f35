"""Fit the models to a measurement, and say which is the smallest that suffices."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ggxref.fit import likelihood, lobes, parameters, selection
from ggxref.fit.data import Heights, Reflectance
from ggxref.fit.found import Found
from ggxref.fit.parameters import Model, Space
from ggxref.fit.preparation import AUTO, Options, Prepared, prepare
from ggxref.fit.problem import Problem
from ggxref.fit.uncertainty import Spread, spread

SETTLED = 0.01
"""Standard errors: a minimum is found when the Newton step that is left is shorter."""
IN_VALLEY = 0.2
"""Share of the largest entry of a valley's direction from which a parameter is named."""
COMPILED = 2e5
"""Samples below which compiling a formula of its own for GGX's tail takes longer than it saves."""


@dataclass(frozen=True)
class Fit:
    """One model's minimum.

    - `tail`: the formula used. `space`: the model's free directions, `identified` those that did not run to a bound.
    - `theta`: (p,), see `parameters`; `covariance` of θ, (p, p).
    - `values`, `errors`: of the parameters and of what follows from them, by name, in the user's terms.
    - `loss`: the mean that was minimised; `held_out`: the same on each fold, fitted without it, and `held_out_blocks` on each block.
    - `log_rmse`: of reflectance, over positive samples; NaN for slopes.
    - `agreeing`: how many starts, of how many, found this minimum. `trouble`: why the fit cannot be relied on, or "".
    """

    model: Model
    tail: str
    space: Space
    identified: Space
    theta: np.ndarray
    covariance: np.ndarray
    values: dict[str, float]
    errors: dict[str, float]
    loss: float
    held_out: np.ndarray
    held_out_blocks: np.ndarray
    bic: float
    log_rmse: float
    agreeing: tuple[int, int]
    intervals: dict[str, tuple[float, float]]
    correlation: np.ndarray
    at_bound: tuple[str, ...]
    residuals: np.ndarray
    trouble: str


@dataclass(frozen=True)
class Ladder:
    """The fitted models, smallest first. `chosen`: the smallest that suffices, or the one that was asked for."""

    measurement: Reflectance | Heights
    problem: Problem
    fits: tuple[Fit, ...]
    chosen: str

    @property
    def best(self) -> Fit:
        return next(fit for fit in self.fits if fit.model.name == self.chosen)


def fit(
    measurement: Reflectance | Heights,
    *,
    model: str = AUTO,
    tail: str = AUTO,
    masking: str = "height_correlated",
    fresnel: str = "schlick",
    fixed: Mapping[str, float] | None = None,
    min_cosine: float = 0.05,
    samples: int = 4096,
    degree: int = 1,
    slopes: str = "central",
    smooth: float = 0.0,
    tolerance: float | None = None,
) -> Ladder:
    """Fit every model of these shapes and tails, and choose the smallest that suffices.

    - `model`: shapes, separated by commas: isotropic, anisotropic, rotated, ellipsoid; "auto" is all.
    - `tail`: ggx, beckmann, student_t, separated by commas; "auto" is ggx and student_t.
    - `masking`: height_correlated, separable or v_cavity; `fresnel`: schlick or conductor. Of reflectance.
    - `fixed`: values of parameters to hold, by name (`alpha_x`, `f0`, `diffuse`, …; `alpha` is both).
    - `min_cosine`: reflectance uses samples whose cosines with the normal exceed it.
    - `samples`: of reflectance, at most; more are thinned evenly.
    - `degree`: of the polynomial that levels a height field; `slopes`: central, cell or facet, the differences taken of it;
      `smooth`: metres, the cutoff of a Gaussian filter before that, 0 for none.
    - `tolerance`: the smallest model within this held-out loss of the best is chosen; without it, within one standard error.
    """
    given = Options(
        model=model,
        tail=tail,
        masking=masking,
        fresnel=fresnel,
        fixed=fixed or {},
        min_cosine=min_cosine,
        samples=samples,
        degree=degree,
        slopes=slopes,
        smooth=smooth,
        tolerance=tolerance,
    )
    return fit_prepared([prepare(measurement, given)])[0]


def fit_prepared(several: Sequence[Prepared]) -> list[Ladder]:
    """The ladders of problems of one kind."""
    found = fit_many([each.problem for each in several], several[0].wanted, [each.held for each in several])
    ladders = []
    for each, fits in zip(several, found, strict=True):
        sound = [fit for fit in fits if not fit.trouble] or fits
        losses, blocks = (
            np.stack(part) for part in zip(*((fit.held_out, fit.held_out_blocks) for fit in sound), strict=True)
        )
        chosen = selection.choose([fit.model.name for fit in sound], losses, each.tolerance, blocks)
        ladders.append(Ladder(each.measurement, each.problem, fits, chosen))
    return ladders


def fit_models(problem: Problem, wanted: Sequence[Model], fixed: Mapping[str, float]) -> tuple[Fit, ...]:
    """Every wanted model, with its standard errors and its loss on each fold fitted without it."""
    return fit_many([problem], wanted, [fixed])[0]


def fit_many(
    problems: Sequence[Problem], wanted: Sequence[Model], fixed: Sequence[Mapping[str, float]]
) -> list[tuple[Fit, ...]]:
    """`fit_models` of several problems with the same parameters, side by side where they are of reflectance."""
    # GGX is the Student-t tail held at γ = 2: where both are wanted of little data, one compiled formula serves them. After
    # the first, a model starts from a third as many places, and from the model before it, which it mostly holds.
    little = sum(problem.size for problem in problems) < COMPILED and problems[0].surface is not None
    shared = little and any(model.tail == "student_t" for model in wanted)
    bank = lobes.bank(list(problems)) if problems[0].surface else None
    fits: list[list[Fit]] = [[] for _ in problems]
    for model in wanted:
        tail = "student_t" if shared and model.tail == "ggx" else model.tail
        spaces = [
            parameters.space(model.groups, problem.parameters, held, problem.scale)
            for problem, held in zip(problems, fixed, strict=True)
        ]
        starts = [problem.starts[:: 3 if fits[0] else 1] for problem in problems]
        smaller = [so_far[-1].theta for so_far in fits] if fits[0] else None
        if bank:
            found = lobes.solve(bank, tail, spaces, starts, smaller)
        else:
            every = [np.vstack(each) for each in zip(starts, smaller, strict=True)] if smaller else starts
            found = [likelihood.solve(*each) for each in zip(problems, [tail] * len(fits), spaces, every, strict=True)]
        for problem, space, each, so_far in zip(problems, spaces, found, fits, strict=True):
            so_far.append(_fit(problem, model, tail, space, each))
    return [tuple(each) for each in fits]


def _fit(problem: Problem, model: Model, tail: str, space: Space, found: Found) -> Fit:
    wide = spread(found.at, found.space)
    at_bound = parameters.at_bounds(space, found.theta, problem.parameters)
    values, errors = parameters.report(found.theta, wide.covariance, problem.parameters)
    return Fit(
        model=model,
        tail=tail,
        space=space,
        identified=found.space,
        theta=found.theta,
        covariance=wide.covariance,
        values=values,
        errors=errors,
        loss=found.loss,
        held_out=found.held_out,
        held_out_blocks=found.held_out_blocks,
        bic=selection.bic(problem, found.loss, space.size),
        log_rmse=float(np.sqrt(np.nanmean(found.residuals**2))) if problem.surface else math.nan,
        agreeing=found.agreeing,
        intervals=parameters.intervals(found.theta, wide.covariance, problem.parameters, len(found.at.scores)),
        correlation=wide.correlation,
        at_bound=tuple(at_bound),
        residuals=found.residuals,
        trouble=_trouble(found.met, wide, problem.parameters),
    )


def _trouble(found: bool, wide: Spread, names: tuple[str, ...]) -> str:
    if wide.valley.any():
        together = ", ".join(np.array(names)[wide.valley > IN_VALLEY * wide.valley.max()])
        return f"not identified: the loss does not change along a line in {together}"
    if not wide.newton <= SETTLED:
        return f"not converged: the next Newton step is {wide.newton:.2g} standard errors long"
    return "" if found else "not converged: the solver used up its steps"
