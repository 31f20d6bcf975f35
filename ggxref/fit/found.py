"""What a solver hands over of one model and one problem."""

from typing import NamedTuple

import numpy as np

from ggxref.fit.parameters import Space
from ggxref.fit.uncertainty import Curvature


class Found(NamedTuple):
    """The best of a model's minima.

    - `space`: the directions that are free there, without those that ran to a bound. `theta`: (p,).
    - `loss` there, and `met`: whether the solver met its tolerance; `agreeing`: how many starts, of how many, ended there.
    - `at`: the curvature there. `held_out`: (folds,), the mean loss on each fold at the minimum of the others;
      `held_out_blocks`: (blocks,), there on each block.
    - `residuals`: (n, bands), |log(f̂/f)|, NaN where f is not positive; of slopes empty.
    """

    theta: np.ndarray
    loss: float
    met: bool
    space: Space
    agreeing: tuple[int, int]
    at: Curvature
    held_out: np.ndarray
    held_out_blocks: np.ndarray
    residuals: np.ndarray
