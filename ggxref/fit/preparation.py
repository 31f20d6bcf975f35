"""A measurement and what the user asks of it, made into a problem and the models to try: all that can be wrong is said here."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from ggxref.errors import InputError
from ggxref.fit import parameters
from ggxref.fit.data import Heights, Reflectance
from ggxref.fit.models import Surface
from ggxref.fit.parameters import Model
from ggxref.fit.problem import FEWEST, Problem, from_reflectance, from_surface
from ggxref.fit.slopes import ESTIMATORS

AUTO = "auto"
TAILS = ("ggx", "student_t")
"""What "auto" tries: GGX, and the tail free. Beckmann is the limit of the second; asked for, it is tried by itself."""


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
