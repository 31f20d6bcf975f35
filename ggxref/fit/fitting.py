"""Fit the models to a measurement, and say which is the smallest that suffices."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ggxref.errors import InputError
from ggxref.fit import likelihood, lobes, parameters, selection
from ggxref.fit.data import Heights, Reflectance
from ggxref.fit.found import Found
from ggxref.fit.models import Surface
from ggxref.fit.parameters import Model, Space
from ggxref.fit.problem import FEWEST, Problem, from_reflectance, from_surface
from ggxref.fit.slopes import ESTIMATORS
from ggxref.fit.uncertainty import Spread, spread

SETTLED = 0.01
"""Standard errors: a minimum is found when the Newton step that is left is shorter."""
IN_VALLEY = 0.2
"""Share of the largest entry of a valley's direction from which a parameter is named."""
COMPILED = 2e5
"""Samples below which compiling a formula of its own for GGX's tail takes longer than it saves."""
AUTO = "auto"
TAILS = ("ggx", "student_t")
"""What "auto" tries: GGX, and the tail free. Beckmann is the limit of the second; asked for, it is tried by itself."""


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


@dataclass(frozen=True)
class Options:
    """The arguments of `fit`, of which many measurements share one set."""

    model: str = AUTO
    tail: str = AUTO
    masking: str = "height_correlated"
    fresnel: str = "schlick"
    fixed: Mapping[str, float] = field(default_factory=dict)
    min_cosine: float = 0.05
    samples: int = 4096
    degree: int = 1
    slopes: str = "central"
    smooth: float = 0.0
    tolerance: float | None = None


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


class Prepared(NamedTuple):
    """A measurement made into a problem, the models to try on it, and the entries of θ that they hold."""

    measurement: Reflectance | Heights
    problem: Problem
    wanted: list[Model]
    held: dict[str, float]
    tolerance: float | None

    @property
    def kind(self) -> tuple:
        """Problems of one kind are solved side by side."""
        return self.problem.surface, self.problem.parameters, tuple(model.name for model in self.wanted)


def prepare(measurement: Reflectance | Heights, options: Options) -> Prepared:
    shapes = _choice("model", options.model, tuple(parameters.SHAPES), tuple(parameters.SHAPES))
    tails = _choice("tail", options.tail, parameters.TAILS, TAILS)
    _check(options)
    if isinstance(measurement, Reflectance):
        surface = Surface(masking=options.masking, fresnel=options.fresnel)
        problem = from_reflectance(measurement, surface, min_cosine=options.min_cosine, most=options.samples)
    else:
        problem = from_surface(measurement, degree=options.degree, estimator=options.slopes, cutoff=options.smooth)
    held = _fixed(options.fixed, problem.parameters)
    wanted = _wanted(shapes, options.model == AUTO, tails, problem, held)
    return Prepared(measurement, problem, wanted, held, options.tolerance)


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


def _check(options: Options) -> None:
    """Options that the user may give beyond their range."""
    _choice("masking", options.masking, ("height_correlated", "separable", "v_cavity"))
    _choice("fresnel", options.fresnel, tuple(parameters.FRESNEL))
    _choice("slopes", options.slopes, tuple(ESTIMATORS))
    if not 0 <= options.min_cosine < 1:
        raise InputError(f"smallest cosine {options.min_cosine:g}; need a number from 0 to below 1")
    if options.samples < FEWEST:
        raise InputError(f"at most {options.samples} samples; need at least {FEWEST}")
    if not 0 <= options.degree <= 8:
        raise InputError(
            f"levelling by a polynomial of degree {options.degree}; need 0 (the mean), 1 (a plane), up to 8"
        )
    if not 0 <= options.smooth < math.inf:
        raise InputError(f"smoothing with a cutoff of {options.smooth:g} m; need a length in metres, or 0 for none")
    if options.tolerance is not None and not 0 <= options.tolerance < math.inf:
        raise InputError(f"tolerance {options.tolerance:g}; need a loss, 0 or more")


def _choice(what: str, words: str, known: tuple[str, ...], auto: tuple[str, ...] = ()) -> tuple[str, ...]:
    """The names in `words`, separated by commas, in the order known; one alone where there is no `auto`."""
    if auto and words == AUTO:
        return auto
    given = words.split(",") if auto else [words]
    for word in given:
        if word not in known:
            raise InputError(f"{what} {word!r}; need {f'{AUTO} or ' if auto else ''}one of {', '.join(known)}")
    return tuple(name for name in known if name in given)


def _wanted(
    shapes: Sequence[str], auto: bool, tails: Sequence[str], problem: Problem, held: Mapping[str, float]
) -> list[Model]:
    """The models of these shapes and tails that can hold what is held; a shape that was asked for must be seen."""
    unseen = [] if auto else [name for name in shapes if name not in problem.shapes]
    if unseen:
        need = " or ".join(problem.shapes)
        raise InputError(f"model {unseen[0]!r}: this data cannot tell it from a smaller one; need {need}")
    groups = {name: problem.shapes[name] for name in shapes if name in problem.shapes}
    can = [model for model in parameters.ladder(groups, tails) if parameters.admits(model.groups, held)]
    if not can:
        what = ", ".join(name for name in held if name in parameters.SHAPE)
        raise InputError(f"model {', '.join(shapes)} with tail {', '.join(tails)} cannot hold these values of {what}")
    return can


def _fixed(fixed: Mapping[str, float], known: tuple[str, ...]) -> dict[str, float]:
    """θ's entries for the user's values; `alpha` is short for both alphas, `f0` for all bands' F0."""
    entries: dict[str, float] = {}
    for name, value in fixed.items():
        members = [each for each in known if each == name or each.startswith((f"{name}_", f"{name} "))]
        if not members:
            raise InputError(f"no parameter {name!r} to fix; this data has {', '.join(known)}")
        entries |= {member: parameters.from_user(member, value) for member in members}
    return entries


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
        starts = [
            np.stack([*problem.starts[:: 3 if so_far else 1], *(fit.theta for fit in so_far[-1:])])
            for problem, so_far in zip(problems, fits, strict=True)
        ]
        if bank:
            found = lobes.solve(bank, tail, spaces, starts)
        else:
            found = [likelihood.solve(*each) for each in zip(problems, [tail] * len(fits), spaces, starts, strict=True)]
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
