"""Fit the models to a measurement, and say which is the smallest that suffices."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from ggxref.errors import InputError
from ggxref.fit import models, objectives, selection, solver
from ggxref.fit.data import Heights, Reflectance
from ggxref.fit.models import Space
from ggxref.fit.problem import Problem, from_reflectance, from_surface
from ggxref.fit.uncertainty import Curvature, Spread, curvature, spread

SETTLED = 0.01
"""Standard errors: a minimum is found when the Newton step that is left is shorter."""
AGREE = 1e-5
"""Starts agree when their losses, of order 1, do."""


@dataclass(frozen=True)
class Fit:
    """One model's minimum.

    - `space`: its free directions; `theta`: (p,), see `models`; `covariance` of θ, (p, p).
    - `values`, `errors`: of the parameters and of what follows from them, by name, in the user's terms.
    - `loss`: the mean that was minimised; `held_out`: the same on each fold, fitted without it.
    - `log_rmse`: of reflectance, over positive samples; NaN for slopes.
    - `agreeing`: how many starts, of how many, found this minimum. `trouble`: why the fit cannot be relied on, or "".
    """

    model: str
    space: Space
    theta: np.ndarray
    covariance: np.ndarray
    values: dict[str, float]
    errors: dict[str, float]
    loss: float
    held_out: np.ndarray
    bic: float
    log_rmse: float
    agreeing: tuple[int, int]
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
        return next(fit for fit in self.fits if fit.model == self.chosen)


def fit(
    measurement: Reflectance | Heights,
    *,
    model: str = "auto",
    fixed: Mapping[str, float] | None = None,
    min_cosine: float = 0.05,
    degree: int = 1,
) -> Ladder:
    """Fit `model`, or with "auto" every model, and choose.

    - `fixed`: values of parameters to hold, by name (`alpha_x`, `f0`, `diffuse`, …; `alpha` is both).
    - `min_cosine`: reflectance uses samples whose cosines with the normal exceed it.
    - `degree`: of the polynomial that levels a height field.
    """
    _check(min_cosine, degree, model)
    if isinstance(measurement, Reflectance):
        problem = from_reflectance(measurement, min_cosine=min_cosine)
    else:
        problem = from_surface(measurement, degree=degree)
    held = _fixed(fixed or {}, problem.parameters)
    fits = fit_models(problem, _wanted(model, problem, held), held)
    sound = [fit for fit in fits if not fit.trouble] or fits
    chosen = selection.choose([fit.model for fit in sound], np.stack([fit.held_out for fit in sound]))
    return Ladder(measurement, problem, fits, chosen)


def _check(min_cosine: float, degree: int, model: str) -> None:
    if not 0 <= min_cosine < 1:
        raise InputError(f"smallest cosine {min_cosine:g}; need a number from 0 to below 1")
    if not 0 <= degree <= 8:
        raise InputError(f"levelling by a polynomial of degree {degree}; need 0 (the mean), 1 (a plane), up to 8")
    if model != "auto" and model not in models.MODELS:
        raise InputError(f"model {model!r}; need auto or one of {', '.join(models.MODELS)}")


def _wanted(model: str, problem: Problem, held: Mapping[str, float]) -> list[str]:
    """The models to fit: all that hold what is held, or the one that was asked for."""
    can = [name for name, groups in problem.models.items() if models.admits(groups, held)]
    if model == "auto" and can:
        return can
    if model in can:
        return [model]
    if model in problem.models or model == "auto":
        what = ", ".join(name for name in held if name in models.SHAPE)
        raise InputError(f"model {model!r} cannot hold these values of {what}")
    raise InputError(
        f"model {model!r}: this data cannot tell it from a smaller one; need {' or '.join(problem.models)}"
    )


def _fixed(fixed: Mapping[str, float], parameters: tuple[str, ...]) -> dict[str, float]:
    """θ's entries for the user's values; `alpha` is short for both alphas, `f0` for all bands' F0."""
    entries: dict[str, float] = {}
    for name, value in fixed.items():
        members = [known for known in parameters if known == name or known.startswith((f"{name}_", f"{name} "))]
        if not members:
            raise InputError(f"no parameter {name!r} to fix; this data has {', '.join(parameters)}")
        entries |= {member: models.from_user(member, value) for member in members}
    return entries


def fit_models(problem: Problem, wanted: list[str], fixed: Mapping[str, float]) -> tuple[Fit, ...]:
    """Every wanted model from every start, then its standard errors and its loss on each fold fitted without it."""
    spaces = [models.space(problem.models[name], problem.parameters, fixed, problem.scale) for name in wanted]
    with solver.float64():
        samples = tuple(jnp.asarray(array) for array in problem.samples)
        found = _from_starts(problem, samples, spaces)
        theta = np.stack([each.theta for each in found])
        at = [curvature(problem, samples, *each) for each in zip(theta, spaces, strict=True)]
        held_out = selection.held_out(problem, samples, spaces, theta, at)
        return tuple(_fit(problem, samples, *parts) for parts in zip(wanted, spaces, found, at, held_out, strict=True))


class Found(NamedTuple):
    """The best of a model's minima: θ, its loss, whether the solver met its tolerance, and how many starts ended there."""

    theta: np.ndarray
    loss: float
    met: bool
    agreeing: int


def _from_starts(problem: Problem, samples: tuple, spaces: list[Space]) -> list[Found]:
    """Each model's best minimum from all starts."""
    lanes = [(space.held, space.basis, space.coordinates(start)) for space in spaces for start in problem.starts]
    held, basis, start = (np.stack(column) for column in zip(*lanes, strict=True))
    minima = solver.minimise(problem.objective, samples, held, basis, start, [problem.weights] * len(lanes))
    weights = jnp.asarray(problem.weights)
    losses = [solver.mean_loss(problem.objective, jnp.asarray(row), samples, weights) for row in minima.theta]
    # A start that ran off to where the loss is no number has not found a minimum.
    each = np.nan_to_num(np.array(losses), nan=math.inf).reshape(len(spaces), -1)
    found = []
    for k, loss in enumerate(each):
        best = int(np.argmin(loss))
        row = k * len(loss) + best
        agreeing = int(np.sum(loss <= loss[best] + AGREE))
        found.append(Found(np.asarray(minima.theta[row]), float(loss[best]), bool(minima.found[row]), agreeing))
    return found


def _fit(problem: Problem, samples, model: str, space: Space, found: Found, at: Curvature, held_out) -> Fit:
    wide = spread(at, space.basis)
    values, errors = models.report(found.theta, wide.covariance, problem.parameters)
    return Fit(
        model=model,
        space=space,
        theta=found.theta,
        covariance=wide.covariance,
        values=values,
        errors=errors,
        loss=found.loss,
        held_out=held_out,
        bic=selection.bic(problem, found.loss, space.size),
        log_rmse=_log_rmse(problem, samples, found.theta),
        agreeing=(found.agreeing, len(problem.starts)),
        trouble=_trouble(found.met, wide),
    )


def _log_rmse(problem: Problem, samples: tuple, theta: np.ndarray) -> float:
    """Root mean square of log(f̂/f) over the positive samples; NaN for slopes."""
    if problem.objective is not objectives.REFLECTANCE:
        return math.nan
    *directions, measured, _ = samples
    model, measured = models.brdfs(theta, *directions), np.asarray(measured)
    positive = measured > 0
    return float(np.sqrt(np.mean(np.log(model[positive] / measured[positive]) ** 2)))


def _trouble(found: bool, wide: Spread) -> str:
    if not wide.point:
        return "some parameters are not identified: the minimum is a valley"
    if not wide.newton <= SETTLED:
        return f"not converged: the next Newton step is {wide.newton:.2g} standard errors long"
    return "" if found else "not converged: the solver used up its steps"
