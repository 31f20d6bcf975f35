"""Figures of a fit: lobes per incident direction, or the slope density with its contours, fit for greyscale print; and their companions."""

import io
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ggxref.errors import InputError
from ggxref.fit import models, solver
from ggxref.fit.data import Reflectance
from ggxref.fit.fitting import Fit, Ladder
from ggxref.fit.models import Surface

SUFFIXES = (".pdf", ".png", ".svg")
MEASURED = "0.55"
CONTOUR = "#3b6fb6"
STYLES: tuple[dict[str, Any], ...] = ({"color": "black", "ls": "-"}, {"color": "#c1440e", "ls": "--"})
"""Black and a vermilion of middle lightness, told apart by their dashes too."""
MOST_PANELS = 12


def check(path: Path) -> None:
    """That a figure can be drawn to `path`; to be asked before the fit."""
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: no figure format; need a name that ends in {', '.join(SUFFIXES)}")


def draw(ladder: Ladder, path: Path) -> tuple[dict[Path, bytes], str]:
    """What to write: the figure of that name, of reflectance with the residual map and the lit sphere beside it; and why one is missing."""
    if not isinstance(ladder.measurement, Reflectance):
        return {path: _encoded(_slopes(ladder), path.suffix)}, ""
    from ggxref.fit import residual_map, sphere

    drawn = {"": _lobes(ladder), "-residuals": residual_map.draw(ladder)}
    missing = sphere.unseen(ladder)
    if not missing:
        drawn["-sphere"] = sphere.draw(ladder)
    return {path.with_stem(path.stem + name): _encoded(each, path.suffix) for name, each in drawn.items()}, missing


def _encoded(figure: Figure, suffix: str) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format=suffix.removeprefix(".").lower(), dpi=200)
    return stream.getvalue()


def shown(ladder: Ladder) -> list[Fit]:
    """The model chosen, and to compare it with the smallest, or where that is the one chosen, the largest."""
    smallest, largest = ladder.fits[0], ladder.fits[-1]
    other = largest if ladder.best is smallest else smallest
    return [ladder.best] if other is ladder.best else [ladder.best, other]


def _lobes(ladder: Ladder) -> Figure:
    (wi, wo, wm, measured, _), surface = ladder.problem.samples, ladder.problem.surface or Surface()
    directions = incident(wi)
    figure, panels = grid(len(directions), 1.75)
    handles = []
    for axes, direction in zip(panels, directions, strict=False):
        members = np.abs(wi.T - direction).max(axis=1) < 1e-5
        angle = _signed_zenith(wo[:, members], direction)
        along = np.argsort(angle)
        handles = axes.plot(angle, measured[:, members].T, ".", ms=2, mew=0, color=MEASURED, label="measured")[:1]
        for fit, style in zip(shown(ladder), STYLES, strict=False):
            values = model(fit, surface, wi[:, members], wo[:, members], wm[:, members])
            handles += axes.plot(angle[along], values[:, along].T, lw=1, label=fit.model.name, **style)[:1]
        axes.set_title(zenith_title(direction), fontsize=8)
        axes.axvline(math.degrees(math.acos(min(direction[2], 1))), color="0.8", lw=0.6, zorder=0)
        axes.set(yscale="log", xlim=(-90, 90), xticks=[-90, -45, 0, 45, 90])
        axes.tick_params(labelsize=7)
    figure.supxlabel(r"outgoing zenith $\theta_o$ [degrees], positive on the mirror's side", fontsize=8)
    figure.supylabel("BRDF [1/sr]", fontsize=8)
    figure.legend(
        handles=handles, loc="outside upper center", ncols=len(handles), fontsize=8, frameon=False, markerscale=3
    )
    return figure


def incident(wi: np.ndarray) -> np.ndarray:
    """The incident directions (k, 3) that have a panel, of `wi` (3, n), steepest first."""
    order = np.argsort(-wi[2], kind="stable")
    directions, first = np.unique(np.round(wi.T[order], 6), axis=0, return_index=True)
    return directions[np.argsort(first)][:MOST_PANELS]


def grid(count: int, height: float) -> tuple[Figure, np.ndarray]:
    """A figure of `count` panels in rows of four, `height` inches each, the last row not always full."""
    columns = min(4, count)
    rows = math.ceil(count / columns)
    figure = Figure(figsize=(7.0, 1.0 + height * rows), layout="constrained")
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for k in range(count, len(panels)):
        panels[k].set_visible(False)
        panels[k - columns].tick_params(labelbottom=True)
    return figure, panels


def zenith_title(direction: np.ndarray) -> str:
    return rf"$\theta_i = {math.degrees(math.acos(min(direction[2], 1))):.4g}°$"


def model(fit: Fit, surface: Surface, wi: np.ndarray, wo: np.ndarray, wm: np.ndarray) -> np.ndarray:
    """The fitted BRDF (bands, n) at directions (3, n)."""
    with solver.float64():
        return models.brdfs(fit.theta, wi, wo, wm, replace(surface, tail=fit.tail))


def _signed_zenith(wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """Zenith of wo in degrees, negative on the side of wi."""
    zenith = np.degrees(np.arccos(np.clip(wo[2], -1, 1)))
    return np.where(wo[0] * wi[0] + wo[1] * wi[1] > 0, -zenith, zenith)


BINS = 161
WINDOW = 0.97
"""The window shows this share of the slopes along each axis; the rest of the tails would shrink the lobe to a dot."""


def _slopes(ladder: Ladder) -> Figure:
    slopes = ladder.problem.samples[0]
    edges = [np.linspace(-1, 1, BINS + 1) * np.quantile(np.abs(axis), WINDOW) for axis in slopes]
    centres = [(edge[1:] + edge[:-1]) / 2 for edge in edges]
    area = np.diff(edges[0])[0] * np.diff(edges[1])[0]
    measured = np.histogram2d(*slopes, bins=edges)[0] / slopes.shape[1] / area
    grid = np.stack(np.meshgrid(*centres, indexing="ij"))
    fitted = [(fit, _density(fit, grid)) for fit in shown(ladder)]
    figure = Figure(figsize=(7.0, 3.4), layout="constrained")
    density, cuts = figure.subplots(1, 2, width_ratios=(1.2, 1))
    _contours(figure, density, centres, measured, fitted)
    _marginals(cuts, centres, measured, fitted)
    for axes in (density, cuts):
        axes.xaxis.label.set_size(8)
        axes.yaxis.label.set_size(8)
        axes.tick_params(labelsize=7)
    handles = [Line2D([], [], color=CONTOUR, lw=0.8), Line2D([], [], color=MEASURED, ls="", marker=".")]
    handles += [Line2D([], [], lw=1, **style) for _, style in zip(fitted, STYLES, strict=False)]
    labels = ["measured (contours)", "measured (marginals)", *(fit.model.name for fit, _ in fitted)]
    figure.legend(handles, labels, loc="outside upper center", ncols=len(handles), fontsize=8, frameon=False)
    return figure


def _density(fit: Fit, grid: np.ndarray) -> np.ndarray:
    with solver.float64():
        return models.slope_densities(fit.theta, grid.reshape(2, -1), fit.tail).reshape(grid.shape[1:])


DECADES = (2.0, 1.5, 1.0, 0.5, 0.2)
"""Below the measured peak: where the contours are."""


def _contours(figure: Figure, axes: Axes, centres, measured, fitted) -> None:
    smooth = _smooth(measured)
    top = math.log10(smooth.max())
    levels = top - np.array(DECADES)
    shade = np.log10(np.maximum(measured, 10 ** (top - 3))).T
    # The darkest shade stays light enough for lines to be seen on it.
    image = axes.pcolormesh(*centres, shade, cmap="Greys", vmin=top - 3, vmax=top + 3, rasterized=True)
    lines = {"levels": levels, "linewidths": 1.0}
    for (_, density), style in reversed(list(zip(fitted, STYLES, strict=False))):
        axes.contour(*centres, np.log10(density).T, colors=style["color"], linestyles=style["ls"], **lines)
    axes.contour(*centres, np.log10(smooth).T, colors=CONTOUR, linestyles="-", levels=levels, linewidths=0.7)
    axes.set(xlabel="slope along x", ylabel="slope along y")
    bar = figure.colorbar(image, ax=axes, boundaries=np.linspace(top - 3, top, 128), ticks=np.arange(-9, 9))
    bar.set_label(r"$\log_{10}$ of the measured slope density", fontsize=8)
    bar.ax.tick_params(labelsize=7)


def _smooth(histogram: np.ndarray) -> np.ndarray:
    """The histogram blurred over two bins, and nowhere 0: contours of the raw counts would be all noise."""
    kernel = np.exp(-0.5 * (np.arange(-6, 7) / 2.0) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        histogram = np.apply_along_axis(np.convolve, axis, histogram, kernel, "same")
    return np.maximum(histogram, histogram.max() * 1e-6)


APART = 1e-2
"""Factor between the two marginals, so that they share a panel and do not cross."""


def _marginals(axes: Axes, centres, measured, fitted) -> None:
    """Densities along x and, further down, along y, each summed over the window along the other axis."""
    for k, name in enumerate("xy"):
        factor = np.diff(centres[1 - k])[0] * APART**k
        sums = measured.sum(axis=1 - k) * factor
        axes.plot(centres[k], sums, ".", ms=2.5, mew=0, color=MEASURED)
        for (_, density), style in zip(fitted, STYLES, strict=False):
            axes.plot(centres[k], density.sum(axis=1 - k) * factor, lw=1, **style)
        note = f"along {name}" + (f", times {APART:g}" if k else "")
        axes.annotate(note, (centres[k][np.argmax(sums)], sums.max() * 1.5), ha="center", fontsize=8)
    axes.set(yscale="log", xlabel="slope", ylabel="slope density, other axis summed")
    axes.set_ylim(top=axes.get_ylim()[1] * 2)
