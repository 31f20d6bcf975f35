"""What the data could not tell, in plain words."""

import math

import numpy as np

from ggxref.fit.data import Reflectance
from ggxref.fit.fitting import Fit, Ladder

CLEAR = 2.0
"""Standard errors by which a difference must exceed 0 to be seen."""
TIED = 0.95
"""Correlation from which two parameters are told apart badly."""
FITS = math.log(2)
"""Log-RMSE from which a model does not describe a measurement: it is off by a factor of 2 or more."""
END = {"f0": "0 or 1", "diffuse": "0", "gamma": "infinity, Beckmann's tail, or 3/2", "eta": "its end", "k": "its end"}


def warnings(ladder: Ladder) -> list[str]:
    """One sentence each, on the chosen model."""
    fit = ladder.best
    return [*_misfit(ladder, fit), *_rotation(fit), *_bounds(fit), *_ties(ladder, fit)]


def _misfit(ladder: Ladder, fit: Fit) -> list[str]:
    if not isinstance(ladder.measurement, Reflectance):
        return []
    if fit.log_rmse < FITS:
        return []
    return [
        f"no model here fits: the values are off by a factor of {math.exp(fit.log_rmse):.3g}, root mean square of the logarithm"
    ]


def _rotation(fit: Fit) -> list[str]:
    if not fit.space.moved[2]:
        return []
    over, error = fit.values["anisotropy"] - 1, fit.errors["anisotropy"]
    if over > CLEAR * error:
        return []
    return [f"rotation undetermined: alpha_1 ≈ alpha_2 (their ratio is {1 + over:.4g} ± {error:.1g})"]


def _bounds(fit: Fit) -> list[str]:
    return [
        f"{name} ran to {END.get(name.partition(' ')[0], 'its end')}: held there, without a standard error"
        for name in fit.at_bound
    ]


def _ties(ladder: Ladder, fit: Fit) -> list[str]:
    names, correlation = ladder.problem.parameters, fit.correlation
    # Parameters of one group move as one, which is no finding.
    one = [np.flatnonzero(column) for column in fit.space.basis.T]
    alone = [members[0] for members in one if len(members)]
    return [
        f"{names[i]} and {names[j]} are hard to tell apart: correlation {correlation[i, j]:.3f}"
        for a, i in enumerate(alone)
        for j in alone[a + 1 :]
        if abs(correlation[i, j]) > TIED
    ]
