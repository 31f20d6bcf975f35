"""A fit for people, as tables on a terminal, and for machines, as JSON."""

import math
from importlib.metadata import version

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from ggxref.fit import identification, models, parameters, selection, solver
from ggxref.fit.data import Heights
from ggxref.fit.fitting import Fit, Ladder

Intervals = dict[str, tuple[float, float]]

DEGREES = ("rotation",)


def tables(ladder: Ladder, intervals: Intervals | None = None) -> RenderableType:
    """What was fitted, the ladder of models, and the chosen model's parameters, with these intervals or the fit's own."""
    source, best = ladder.measurement.source, ladder.best
    parts: list[RenderableType] = [Text(f"{source.path} ({source.format})", style="bold")]
    parts += [Text(f"  {note}") for note in ladder.problem.notes]
    parts += ["", _ladder(ladder), ""]
    if len(ladder.fits) > 1:
        parts += [Text(f"Smallest model that suffices: {best.model.name}", style="bold"), ""]
    parts.append(_parameters(best, intervals or best.intervals))
    parts += [Text(f"{fit.model.name}: {fit.trouble}", style="bold") for fit in ladder.fits if fit.trouble]
    parts += [Text(sentence, style="bold") for sentence in identification.warnings(ladder)]
    if best.agreeing[0] == 1:
        parts.append(
            Text(f"Only one of {best.agreeing[1]} starts ended here: there may be a better minimum", style="bold")
        )
    return Group(*parts)


def excess(ladder: Ladder, fit: Fit) -> tuple[float, float]:
    """Held-out loss above that of the model that has least of it, and the standard error of the difference."""
    least = min(ladder.fits, key=lambda other: other.held_out.mean())
    difference = fit.held_out - least.held_out
    error = selection.standard_error(difference, fit.held_out_blocks - least.held_out_blocks)
    return float(difference.mean()), error


def _ladder(ladder: Ladder) -> Table:
    heights = isinstance(ladder.measurement, Heights)
    table = _table("Models, smallest first; the loss is per sample, on folds that the fit did not see", "model")
    quality = "log-likelihood" if heights else "log-RMSE"
    for column in ("free", quality, "loss", "above the best", "ΔBIC"):
        table.add_column(column, justify="right", no_wrap=True)
    least = min(fit.bic for fit in ladder.fits)
    for fit in ladder.fits:
        above, error = excess(ladder, fit)
        table.add_row(
            fit.model.name,
            str(fit.space.size),
            f"{-fit.loss if heights else fit.log_rmse:.4f}",
            f"{fit.held_out.mean():.4f}",
            f"{above:.2g} ± {error:.1g}" if above else "",
            f"{fit.bic - least:.1f}",
        )
    return table


def _table(title: str, names: str) -> Table:
    """A plain table, so far with its column of names."""
    table = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False)
    table.add_column(names, no_wrap=True)
    return table


def _parameters(fit: Fit, intervals: Intervals) -> Table:
    table = _table(f"Parameters, {fit.model.name}", "parameter")
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("std. error", justify="right", no_wrap=True)
    table.add_column("95 % interval", justify="right", no_wrap=True)
    table.add_column("meaning")
    for name, value, error, free in rows(fit):
        unit = 180 / math.pi if name in DEGREES else 1.0
        shown = _number(error * unit) if free else "held"
        low, high = intervals["alpha_x" if name == "alpha" else name]
        between = f"{_number(low * unit)} to {_number(high * unit)}" if free and error else ""
        table.add_row(name, _number(value * unit), shown, between, MEANING[name.partition(" ")[0]])
    return table


MEANING = {
    "alpha": "roughness",
    "alpha_x": "roughness along x: C[0][0], slopes' scatter = C Cᵀ",
    "alpha_y": "C[1][1]: roughness along y where shear = 0",
    "shear": "C[1][0]",
    "mean_x": "mean slope along x",
    "mean_y": "mean slope along y",
    "gamma": "tail: 2 is GGX, larger is shorter, infinite Beckmann",
    "eta": "refractive index, real part",
    "k": "refractive index, imaginary part",
    "f0": "reflectance at normal incidence",
    "diffuse": "albedo of the diffuse term",
    "alpha_1": "roughness along the rougher axis",
    "alpha_2": "roughness across it",
    "anisotropy": "alpha_1 / alpha_2",
    "rotation": "azimuth of the rougher axis, degrees",
    "mean_slope": "length of the mean slope",
}


def rows(fit: Fit) -> list[tuple[str, float, float, bool]]:
    """Name, value, standard error and whether it was free: of what the model moves or the user held, and what follows."""
    free = {name: bool(moved) for name, moved in zip(fit.values, fit.space.moved, strict=False)}
    names = [name for name in free if free[name] or (name != "gamma" and fit.values[name])]
    circular = not free["shear"] and np.array_equal(fit.space.basis[0], fit.space.basis[1])
    if not circular:
        names += [name for name in parameters.DERIVED if name.startswith("a") or free["shear"]]
    if free["mean_x"] and free["mean_y"] and "mean_slope" not in names:
        names.append("mean_slope")
    if circular:
        names.remove("alpha_y")
    label = {"alpha_x": "alpha"} if circular else {}
    return [(label.get(name, name), fit.values[name], fit.errors[name], free.get(name, True)) for name in names]


def _number(value: float) -> str:
    return "-" if not math.isfinite(value) else f"{value:.4g}"


def document(ladder: Ladder, options: dict, intervals: Intervals | None = None) -> dict:
    """Everything to read the fit by program, and to repeat it. Angles in radians; what has no value is null."""
    source = ladder.measurement.source
    libraries = ("ggxref", "jax", "optimistix", "numpy")
    return {
        "schema": "ggxref-fit-1",
        "versions": {name: version(name) for name in libraries},
        "source": {"path": source.path, "format": source.format, "sha256": source.sha256},
        "kind": "heights" if isinstance(ladder.measurement, Heights) else "reflectance",
        "options": options,
        "samples": ladder.problem.size,
        "notes": list(ladder.problem.notes),
        "chosen": ladder.chosen,
        "warnings": identification.warnings(ladder),
        "models": [_model(ladder, fit) for fit in ladder.fits],
        "bootstrap": intervals and {name: [_null(end) for end in ends] for name, ends in intervals.items()},
    }


def _model(ladder: Ladder, fit: Fit) -> dict:
    above, error = excess(ladder, fit)
    return {
        "model": fit.model.name,
        "converged": not fit.trouble,
        "trouble": fit.trouble,
        "starts": {"agreeing": fit.agreeing[0], "of": fit.agreeing[1]},
        "free": fit.space.size,
        "parameters": {
            name: {
                "value": _null(value),
                "standard_error": _null(error),
                "interval": [_null(end) for end in fit.intervals["alpha_x" if name == "alpha" else name]],
                "free": free,
            }
            for name, value, error, free in rows(fit)
        },
        "A": shape_matrix(fit),
        "theta": {
            "names": list(ladder.problem.parameters),
            "values": [_null(value) for value in fit.theta.tolist()],
            "free": fit.space.moved.tolist(),
            "covariance": fit.covariance.tolist(),
            "correlation": fit.correlation.tolist(),
            "at_bound": list(fit.at_bound),
        },
        "loss": fit.loss,
        "log_rmse": _null(fit.log_rmse),
        "held_out": {"folds": fit.held_out.tolist(), "above_best": above, "standard_error": error},
        "bic": fit.bic,
    }


def shape_matrix(fit: Fit) -> list[list[float | None]]:
    with solver.float64():
        return [[_null(entry) for entry in row] for row in models.shape_matrix(fit.theta).tolist()]


def _null(value: float) -> float | None:
    return value if math.isfinite(value) else None
