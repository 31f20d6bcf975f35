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
    return [f"no model here fits: the values are off by a factor of {math.exp(fit.log_rmse):.3g}, e to the log-RMSE"]


def _rotation(fit: Fit) -> list[str]:
    if not fit.space.moved[2]:
        return []
    over, error = fit.values["anisotropy"] - 1, fit.errors["anisotropy"]
    if over > CLEAR * error:
        return []
    return [f"rotation undetermined: alpha_1 ≈ alpha_2 (their ratio is {1 + over:.4g} ± {error:.1g})"]


def _bounds(fit: Fit) -> list[str]:
    """One sentence for all that ran to the same end."""
    ran: dict[str, list[str]] = {}
    for name in fit.at_bound:
        ran.setdefault(END.get(name.partition(" ")[0], "its end"), []).append(name)
    return [f"{', '.join(names)} ran to {end}: held there, without a standard error" for end, names in ran.items()]


def _ties(ladder: Ladder, fit: Fit) -> list[str]:
    names, correlation = ladder.problem.parameters, fit.correlation
    # Parameters of one group move as one, which is no finding.
    one = [np.flatnonzero(column) for column in fit.space.basis.T]
    alone = [members[0] for members in one if len(members)]
    tied = [
        f"{names[i]} and {names[j]} ({correlation[i, j]:.3f})"
        for a, i in enumerate(alone)
        for j in alone[a + 1 :]
        if abs(correlation[i, j]) > TIED
    ]
    return [f"hard to tell apart, by their correlation: {', '.join(tied)}"] if tied else []
