"""What `choose` found: tables for people, JSON for programs, figures."""

import math
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from ggxref.scene import image
from ggxref.scene.build import Choice
from ggxref.scene.choose import DEARER, Result, Sampler, Step
from ggxref.scene.compare import Deviation
from ggxref.scene.search import AXES


@dataclass(frozen=True)
class Up:
    """One step up an axis from what was chosen: the deviations and nanoseconds before and after, each alone."""

    material: str
    axis: str
    option: str
    richer: str
    deviation: Deviation
    left: Deviation
    ns: float
    richer_ns: float


def steps_up(result: Result) -> list[Up]:
    """What each step up from the chosen would buy, and cost."""
    found = []
    for at in result.steps:
        if getattr(result.chosen[at.material], at.axis) != at.option:
            continue
        every = AXES[at.axis]
        richer = every[every.index(at.option) + 1]
        own = [s for s in result.steps if (s.material, s.axis, s.option) == (at.material, at.axis, richer)]
        left, ns = (own[0].deviation, own[0].ns) if own else (Deviation(0.0, 0.0), result.costs[at.material])
        found.append(Up(at.material, at.axis, at.option, richer, at.deviation, left, at.ns, ns))
    return found


def wasted(result: Result) -> dict[str, float]:
    """Per material, the share of the richest's time at equal noise that the chosen formulas do not need."""
    needed = {each.material: each.effort for each in result.samplers if _is_chosen(result, each)}
    same = {name for name, choice in result.chosen.items() if choice == result.richest[name]}
    return {name: 0.0 if name in same else 1 - effort / result.costs[name] for name, effort in needed.items()}


def _is_chosen(result: Result, each: Sampler) -> bool:
    return result.chosen[each.material].sampler == each.sampler


def _percent(deviation: Deviation) -> str:
    if not math.isfinite(deviation.value):
        return "not finite"
    return f"{100 * deviation.value:.2f} ± {100 * deviation.error:.2f}"


def tables(result: Result) -> RenderableType:
    """The choice, what each option costs and loses, the samplers, and the whole."""
    title = f"{result.scene.title}: within {100 * result.tolerance:g} % of the richest"
    parts = [Text(title), _choice(result), _steps(result), _ups(result), _samplers(result), Text(_verdict(result))]
    return Group(*(each for part in parts for each in (part, "")))


def _grid(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for column in columns:
        right = column.endswith(("%", "ns", "variances"))
        table.add_column(column, justify="right" if right else "left", no_wrap=right, overflow="fold")
    return table


def _choice(result: Result) -> Table:
    """A row an axis on which the chosen differs from the richest."""
    table = _grid(
        "Chosen, and what of today's time at equal noise is wasted",
        "material",
        "axis",
        "chosen",
        "richest",
        "deviation %",
        "wasted %",
    )
    saved = wasted(result)
    for name, deviation in result.deviations.items():
        chosen, richest = result.chosen[name], result.richest[name]
        cells = [(key, getattr(chosen, key), getattr(richest, key)) for key in (*AXES, "sampler")]
        changes = [each for each in cells if each[1] != each[2]] if name in saved else []
        first = name, _percent(deviation), f"{100 * saved[name]:.0f}" if name in saved else "-"
        for k, change in enumerate(changes or [("-", "the richest", "-")]):
            title, *numbers = first if k == 0 else ("", "", "")
            table.add_row(title, *change, *numbers)
    return table


def _verdict_on(result: Result, step: Step) -> str:
    if getattr(result.chosen[step.material], step.axis) == step.option:
        return "<- chosen"
    if step.deviation.most >= result.tolerance:
        return "beyond"
    return "dearer" if step.ns > DEARER * result.costs[step.material] else "within"


def _steps(result: Result) -> Table:
    columns = "material", "axis", "option", "deviation %", "ns", "richest ns"
    table = _grid("One option at a time, the rest the richest: deviation, nanoseconds of formulas", *columns)
    table.add_column("")
    for step in sorted(result.steps, key=lambda step: step.material):
        ns = f"{step.ns:.0f}", f"{result.costs[step.material]:.0f}"
        cells = step.material, step.axis, step.option, _percent(step.deviation), *ns
        table.add_row(*cells, _verdict_on(result, step))
    return table


def _ups(result: Result) -> Table:
    columns = "material", "from", "to", "deviation %", "then %", "ns"
    table = _grid("What each step up from the chosen would buy", *columns)
    for up in sorted(steps_up(result), key=lambda up: up.material):
        cells = up.material, up.option, up.richer, _percent(up.deviation), _percent(up.left)
        table.add_row(*cells, f"{up.richer_ns - up.ns:+.0f}")
    return table


def _samplers(result: Result) -> Table:
    columns = "material", "sampler", "formulas ns", "variances", "product ns"
    table = _grid("Samplers of the chosen models", *columns)
    table.add_column("")
    for each in result.samplers:
        mark = "<- chosen" if _is_chosen(result, each) else ""
        table.add_row(each.material, each.sampler, f"{each.ns:.0f}", f"{each.noise:.3f}", f"{each.effort:.0f}", mark)
    return table


def _verdict(result: Result) -> str:
    ns = {name: each.ns_per_sample for name, each in result.pictures.items()}
    share = 1 - 1 / result.faster
    waste = f"{100 * share:.0f} % is wasted today" if share > 0 else "nothing is wasted today"
    return (
        f"Whole picture: {ns['richest']:.0f} ns a sample with the richest, {ns['chosen']:.0f} with the chosen; "
        f"{result.faster:.2f} ± {result.faster_error:.2f} times as fast at equal noise: {waste}."
    )


def document(result: Result) -> dict:
    """Everything in the tables, and what is needed to repeat them."""
    saved = wasted(result)
    return {
        "schema": "ggxref-choose-2",
        "versions": {name: version(name) for name in ("ggxref", "jax", "numpy")},
        "scene": str(result.scene.path),
        "tolerance": result.tolerance,
        "materials": {
            name: {
                "richest": _record(result.richest[name]),
                "chosen": _record(result.chosen[name]),
                "deviation": _deviation(result.deviations.get(name)),
                "richest_ns": result.costs.get(name),
                "wasted": saved.get(name),
            }
            for name in result.chosen
        },
        "steps": [vars(each) | {"deviation": _deviation(each.deviation)} for each in result.steps],
        "steps_up": [
            vars(each) | {"deviation": _deviation(each.deviation), "left": _deviation(each.left)}
            for each in steps_up(result)
        ],
        "samplers": [vars(each) for each in result.samplers],
        "ns_per_sample": {name: each.ns_per_sample for name, each in result.pictures.items()},
        "faster": result.faster,
        "faster_standard_error": result.faster_error,
        "wasted": 1 - 1 / result.faster,
    }


def _record(choice: Choice) -> dict:
    return {key: getattr(choice, key) for key in (*AXES, "sampler")}


def _deviation(deviation: Deviation | None) -> dict | None:
    """Null where it is not finite, for which JSON has no number."""
    if deviation is None or not math.isfinite(deviation.value):
        return None
    return {"value": deviation.value, "standard_error": deviation.error}


_MARKS = dict(zip(AXES, "osD^v", strict=True))


def figure(result: Result) -> bytes:
    """Cost against deviation of every option, a panel a material, above the pictures side by side: PNG."""
    names = list(dict.fromkeys(step.material for step in result.steps))
    plot = Figure(figsize=(max(9, 2.6 * len(names)), 6), layout="constrained")
    above, below = plot.subfigures(2, 1, squeeze=False, height_ratios=[1.25, 1])[:, 0]
    panels = above.subplots(1, len(names), sharex=True, sharey=True, squeeze=False)[0]
    labels = [_speed_against_error(panel, result, name) for panel, name in zip(panels, names, strict=True)]
    panels[0].set_ylabel("formulas, times the richest's time", fontsize=8)
    handles = [Line2D([], [], marker=mark, ls="", color="0.3", ms=4, label=axis) for axis, mark in _MARKS.items()]
    above.legend(handles=handles, loc="outside upper center", ncols=len(handles), fontsize=7, frameon=False)
    above.supxlabel("deviation from the richest [%]; red line: the tolerance; filled: chosen", fontsize=8)
    _side_by_side(below, result)
    plot.draw_without_rendering()  # lays the panels out: where a label fits hangs on their size
    for panel, named in zip(panels, labels, strict=True):
        _label(panel, named)
    return image.figure_bytes(plot, dpi=130)


def _speed_against_error(panel: Axes, result: Result, name: str) -> dict[tuple[float, float], list[str]]:
    """Draws a material's panel; the options at each of its points."""
    labels: dict[tuple[float, float], list[str]] = {}
    for step in (s for s in result.steps if s.material == name and math.isfinite(s.deviation.value)):
        x, y = max(100 * step.deviation.value, 1e-3), step.ns / result.costs[name]
        chosen = getattr(result.chosen[name], step.axis) == step.option
        color, face, order = ("tab:blue", "tab:blue", 3) if chosen else ("0.3", "white", 2)
        panel.plot(x, y, _MARKS[step.axis], ms=5, color=color, mfc=face, zorder=order)
        labels.setdefault((x, y), []).append(step.option)
    panel.axhline(1, color="0.7", lw=0.8, zorder=0)
    if result.tolerance > 0:
        panel.axvline(100 * result.tolerance, color="tab:red", lw=1, zorder=0)
    panel.set(xscale="log", yscale="log")
    panel.set_xlim(5e-4, 1e3)
    panel.set_title(name, fontsize=8)
    panel.tick_params(labelsize=7, which="both")
    panel.yaxis.set_major_formatter("{x:g}")
    panel.yaxis.set_minor_formatter("{x:g}")
    return labels


_SIZE = 6.0
"""Of a label's letters, in points; one is 0.55 of it wide on average, as measured on these words."""


def _label(panel: Axes, labels: dict[tuple[float, float], list[str]]) -> None:
    """Each point's options beside it, where the panel, the marks and the labels before leave room."""
    points = 72 / panel.figure.dpi
    inside = np.array(panel.bbox.extents) * points
    at = {key: panel.transData.transform(key) * points for key in labels}
    taken = [np.array([x - 3, y - 3, x + 3, y + 3]) for x, y in at.values()]
    for key in sorted(labels, key=lambda key: -at[key][1]):
        text, (x, y) = ", ".join(labels[key]), at[key]
        width = 0.55 * _SIZE * len(text)
        places = [(side, dy) for dy in sorted(range(-70, 71), key=abs) for side in (1, -1)]
        for side, dy in places:
            left = x + 5 if side > 0 else x - 5 - width
            place = np.array([left, y + dy - _SIZE / 2, left + width, y + dy + _SIZE / 2])
            free = not any(_overlap(place, other) for other in taken)
            if free and (place[:2] >= inside[:2]).all() and (place[2:] <= inside[2:]).all():
                taken.append(place)
                break
        else:
            side, dy = 1, 0
        line = {"arrowstyle": "-", "lw": 0.4, "color": "0.6", "shrinkA": 0, "shrinkB": 2} if abs(dy) > _SIZE else None
        ha = "left" if side > 0 else "right"
        offset = {"xytext": (5 * side, dy), "textcoords": "offset points"}
        ground = {"fc": "white", "ec": "none", "pad": 0.5, "alpha": 0.8}
        panel.annotate(text, key, **offset, fontsize=_SIZE, arrowprops=line, ha=ha, va="center", bbox=ground)


def _overlap(a: np.ndarray, b: np.ndarray) -> bool:
    return bool((a[:2] < b[2:]).all() and (b[:2] < a[2:]).all())


def _side_by_side(part: SubFigure, result: Result) -> None:
    richest, chosen = (result.pictures[name].mean for name in ("richest", "chosen"))
    reach = max(10 * result.tolerance, 0.01)
    panels = part.subplots(1, 3, squeeze=False)[0]
    for panel, name, picture in zip(panels, ("richest", "chosen"), (richest, chosen), strict=False):
        panel.imshow(image.to_bytes(np.asarray(picture)), cmap="gray", vmin=0, vmax=255)
        panel.set_title(name, fontsize=8)
    panels[2].imshow((chosen - richest) / richest.mean(), cmap="RdBu", vmin=-reach, vmax=reach)
    panels[2].set_title(f"(chosen - richest) / mean, ±{100 * reach:g} %, with noise", fontsize=8)
    for panel in panels:
        panel.set_axis_off()
