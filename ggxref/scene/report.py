"""What `choose` found: tables for people, JSON for programs, figures."""

import math
from importlib.metadata import version

import numpy as np
from matplotlib.figure import Figure
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from ggxref.scene import image
from ggxref.scene.build import Choice
from ggxref.scene.choose import AXES, Result, Step
from ggxref.scene.compare import Deviation


def _percent(deviation: Deviation) -> str:
    return f"{100 * deviation.value:.2f} ± {100 * deviation.error:.2f}"


def tables(result: Result) -> RenderableType:
    """The choice, what each option costs and loses, the samplers, and the whole."""
    parts: list[RenderableType] = [Text(f"{result.scene.title}: within {100 * result.tolerance:g} % of the richest")]
    parts += ["", _choice(result)]
    if result.steps:
        parts += ["", _steps(result)]
    else:
        parts += [
            "",
            Text("The plainest of everything is within the tolerance: no option needed a picture of its own."),
        ]
    parts += ["", _samplers(result), "", Text(_verdict(result))]
    return Group(*parts)


def _grid(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for column in columns:
        table.add_column(column, justify="right" if column[-1] in "%s" and column != "axis" else "left")
    return table


def _choice(result: Result) -> Table:
    table = _grid("Chosen (more than is needed today)", "material", *AXES, "sampler", "deviation %")
    for name, deviation in result.deviations.items():
        chosen, richest = result.chosen[name], result.richest[name]
        cells = [_change(chosen, richest, key) for key in (*AXES, "sampler")]
        diffuse = not any(each.material == name for each in result.samplers)
        table.add_row(name, *(["-"] * len(cells) if diffuse else cells), _percent(deviation))
    return table


def _change(chosen: Choice, richest: Choice, key: str) -> str:
    now, was = getattr(chosen, key), getattr(richest, key)
    return now if now == was else f"{now} ({was})"


def _verdict_on(result: Result, step: Step) -> str:
    if getattr(result.chosen[step.material], step.axis) == step.option:
        return "<- chosen"
    return "within, alone" if step.deviation.most < result.tolerance else "beyond"


def _steps(result: Result) -> Table:
    columns = "material", "axis", "option", "deviation %", "formulas ns", ""
    table = _grid("One option at a time, the rest the richest: what a step up from it buys", *columns[:-1])
    table.add_column("")
    for step in sorted(result.steps, key=lambda step: step.material):
        cells = step.material, step.axis, step.option, _percent(step.deviation), f"{step.ns:.0f}"
        table.add_row(*cells, _verdict_on(result, step))
    return table


def _samplers(result: Result) -> Table:
    table = _grid("Samplers of the chosen models", "material", "sampler", "formulas ns", "variances", "product ns")
    for each in result.samplers:
        chosen = result.chosen[each.material].sampler == each.sampler
        product = f"{each.ns * each.noise:.0f}{' <-' if chosen else ''}"
        table.add_row(each.material, each.sampler, f"{each.ns:.0f}", f"{each.noise:.3f}", product)
    return table


def _verdict(result: Result) -> str:
    ns = {name: each.ns_per_sample for name, each in result.pictures.items()}
    return (
        f"Whole picture: {ns['richest']:.0f} ns a sample with the richest, {ns['chosen']:.0f} with the chosen; "
        f"{result.faster:.2f} times faster at equal noise."
    )


def document(result: Result) -> dict:
    """Everything in the tables, and what is needed to repeat them."""
    return {
        "schema": "ggxref-choose-1",
        "versions": {name: version(name) for name in ("ggxref", "jax", "numpy")},
        "scene": str(result.scene.path),
        "tolerance": result.tolerance,
        "materials": {
            name: {
                "richest": _record(result.richest[name]),
                "chosen": _record(result.chosen[name]),
                "deviation": _deviation(result.deviations.get(name)),
            }
            for name in result.chosen
        },
        "steps": [
            {
                "material": s.material,
                "axis": s.axis,
                "option": s.option,
                "ns": s.ns,
                "deviation": _deviation(s.deviation),
            }
            for s in result.steps
        ],
        "samplers": [vars(each) for each in result.samplers],
        "ns_per_sample": {name: each.ns_per_sample for name, each in result.pictures.items()},
        "faster": result.faster,
    }


def _record(choice: Choice) -> dict:
    return {key: getattr(choice, key) for key in (*AXES, "sampler")}


def _deviation(deviation: Deviation | None) -> dict | None:
    return None if deviation is None else {"value": deviation.value, "standard_error": deviation.error}


def figure(result: Result) -> bytes:
    """Cost against deviation of every option, above the pictures side by side: PNG."""
    plot = Figure(figsize=(9, 6), layout="constrained")
    grid = plot.add_gridspec(2, 3, height_ratios=[1.2, 1])
    axes = plot.add_subplot(grid[0, :])
    marks = dict(zip(AXES, "osd", strict=True))
    for step in result.steps:
        deviation = 100 * max(step.deviation.value, 1e-5)
        axes.errorbar(deviation, step.ns, xerr=100 * step.deviation.error, fmt=marks[step.axis], color="0.3", ms=4)
        axes.annotate(f"{step.material}: {step.option}", (deviation, step.ns), fontsize=6, xytext=(3, 3),
                      textcoords="offset points")  # fmt: skip
    axes.axvline(100 * result.tolerance, color="tab:red", lw=1)
    axes.set(
        xscale="symlog", xlabel="deviation from the richest [%]; the line is the tolerance", ylabel="formulas [ns]"
    )
    richest, chosen = result.pictures["richest"].mean, result.pictures["chosen"].mean
    mean = richest.mean()
    pictures = {"richest": richest, "chosen": chosen, "(chosen - richest) / mean": (chosen - richest) / mean}
    for k, (name, picture) in enumerate(pictures.items()):
        panel = plot.add_subplot(grid[1, k])
        if "-" in name:
            reach = max(10 * result.tolerance, 0.01) if math.isfinite(result.tolerance) else 1
            panel.imshow(picture, cmap="RdBu", vmin=-reach, vmax=reach)
            name += f", ±{100 * reach:g} %"
        else:
            panel.imshow(image.to_bytes(np.asarray(picture)), cmap="gray", vmin=0, vmax=255)
        panel.set_title(name, fontsize=8)
        panel.set_axis_off()
    return image.figure_bytes(plot)
