"""Map over angles of what a fit leaves: the logarithm of fitted over measured, both times cos θo and above the noise floor."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ggxref.fit import figures, parameters
from ggxref.fit.fitting import Fit, Ladder
from ggxref.fit.models import Surface

COLOURS = "PuOr_r"
SHOWN = 0.98
"""The colours' ends hold this share of the residuals; the few beyond have the end's colour."""
LEAST = math.log10(1.1)


def residuals(ladder: Ladder, fit: Fit) -> np.ndarray:
    """(n,): log₁₀ of (f̂ cosθo + ε)/(f cosθo + ε), the mean over bands. The fit's own residual, with its sign."""
    wi, wo, wm, measured, noise = ladder.problem.samples
    model = figures.model(fit, ladder.problem.surface or Surface(), wi, wo, wm)
    return np.log10((model * wo[2] + noise) / (measured * wo[2] + noise)).mean(axis=0)


def draw(ladder: Ladder) -> Figure:
    """A panel per incident direction, or of data in one plane, whose maps are lines, one per model."""
    plane = ladder.problem.shapes is parameters.IN_PLANE
    fits = figures.shown(ladder) if plane else [ladder.best]
    left = [residuals(ladder, fit) for fit in fits]
    end = max(LEAST, *(float(np.quantile(np.abs(each), SHOWN)) for each in left))
    style = {"cmap": COLOURS, "vmin": -end, "vmax": end, "linewidths": 0.8 if plane else 0, "rasterized": True}
    figure = _lines(ladder, fits, left, style) if plane else _discs(ladder, left[0], style)
    points = figure.axes[0].collections[0]
    bar = figure.colorbar(points, ax=figure.axes, extend="both", aspect=30, shrink=0.9)
    bar.set_label(r"$\log_{10}$ of fitted over measured", fontsize=8)
    bar.ax.tick_params(labelsize=7)
    return figure


def _lines(ladder: Ladder, fits: list[Fit], left: list[np.ndarray], style: dict) -> Figure:
    wi, wo = ladder.problem.samples[:2]
    zenith = np.degrees(np.arccos(wi[2]))
    angle = np.where(wo[0] * wi[0] > 0, -1, 1) * np.degrees(np.arccos(np.clip(wo[2], -1, 1)))
    figure = Figure(figsize=(7.0, 0.9 + 1.6 * len(fits)), layout="constrained")
    panels = figure.subplots(len(fits), 1, sharex=True, squeeze=False).ravel()
    for axes, fit, each in zip(panels, fits, left, strict=True):
        axes.scatter(angle, zenith, c=each, s=90, marker="|", **style)
        axes.plot(*[np.unique(np.round(zenith, 6))] * 2, "o", ms=4, mfc="none", mec="black", mew=0.7)
        axes.set_title(f"{fit.model.name}; circles: mirror direction", fontsize=8)
        axes.set(xlim=(-90, 90), ylim=(0, 90), xticks=[-90, -45, 0, 45, 90], yticks=[0, 30, 60, 90])
        axes.tick_params(labelsize=7)
    figure.supxlabel(r"outgoing zenith $\theta_o$ [degrees], positive on the mirror's side", fontsize=8)
    figure.supylabel(r"incident zenith $\theta_i$ [degrees]", fontsize=8)
    return figure


def _discs(ladder: Ladder, left: np.ndarray, style: dict) -> Figure:
    wi, wo = ladder.problem.samples[:2]
    directions = figures.incident(wi)
    figure, panels = figures.grid(len(directions), 1.4)
    for axes, direction in zip(panels, directions, strict=False):
        members = np.abs(wi.T - direction).max(axis=1) < 1e-5
        axes.scatter(*_place(wo[:, members]), c=left[members], s=4, **style)
        axes.plot(*_place(np.array([[-direction[0]], [-direction[1]], [direction[2]]])), "k+", ms=5, mew=0.7)
        _horizon(axes)
        axes.set_title(figures.zenith_title(direction), fontsize=8)
    figure.suptitle(
        f"{ladder.best.model.name}: outgoing directions, zenith as radius, rings each 30°; +: mirror direction",
        fontsize=8,
    )
    return figure


def _place(w: np.ndarray) -> np.ndarray:
    """(2, n): a direction's zenith in degrees as radius, at its azimuth."""
    length = np.hypot(w[0], w[1])
    zenith = np.degrees(np.arctan2(length, w[2]))
    return zenith * w[:2] / np.where(length > 0, length, 1)


def _horizon(axes: Axes) -> None:
    turn = np.linspace(0, 2 * math.pi, 181)
    for zenith in (30, 60, 90):
        axes.plot(zenith * np.cos(turn), zenith * np.sin(turn), color="0.6", lw=0.8 if zenith == 90 else 0.3, zorder=0)
    axes.set(xlim=(-93, 93), ylim=(-93, 93), aspect="equal")
    axes.set_axis_off()
