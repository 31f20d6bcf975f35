"""Fits to measurements: readers, models, solver, standard errors, selection of the smallest model that suffices."""

from ggxref.fit.fitting import Fit as Fit
from ggxref.fit.fitting import Ladder as Ladder
from ggxref.fit.fitting import fit as fit
from ggxref.fit.readers import read as read
