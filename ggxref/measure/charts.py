"""Draw the tables: greyscale-safe, for print. One figure a kind; no measurement happens here."""

import matplotlib

matplotlib.use("Agg")

from collections.abc import Callable
from io import BytesIO, StringIO

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from ggxref.measure.tables import Rows
from ggxref.measure.variants import QUANTITIES

STYLE: dict = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "legend.fontsize": 7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "svg.fonttype": "none",
    "svg.hashsalt": "ggxref",
}
MARKERS = "osD^v<>Pxh*"
LINES = ["-", "--", ":", "-."]


def _unique(rows: Rows, key: str) -> list:
    return list(dict.fromkeys(r[key] for r in rows))


def _log_text(value) -> str:
    if not np.isfinite(value):
        return "NaN"
    return f"{value:.2g}" if value < 100 else f"{value:.0e}".replace("e+0", "e")


def accuracy(rows: Rows, caption: str) -> Figure:
    """Largest error of each public function in each region, float32."""
    rows = [r for r in rows if r["dtype"] == "f32"]
    names, regions = _unique(rows, "quantity"), _unique(rows, "region")
    grid = np.full((len(names), len(regions)), np.nan)
    for r in rows:
        grid[names.index(r["quantity"]), regions.index(r["region"])] = r["worst"]
    figure, ax = plt.subplots(figsize=(7.2, 0.21 * len(names) + 1.2), layout="constrained")
    shade = np.log10(np.clip(np.where(np.isfinite(grid), grid, 1e7), 0.5, 1e7))
    image = ax.imshow(shade, cmap="Greys", vmin=-0.3, vmax=9, aspect="auto")
    for i, j in np.ndindex(grid.shape):
        ink = "white" if shade[i, j] > 4.5 else "black"
        ax.text(j, i, _log_text(grid[i, j]), ha="center", va="center", color=ink, fontsize=6)
    image.set_clim(-0.3, 9)
    units = {r["quantity"]: r["unit"] for r in rows}
    ax.set_yticks(range(len(names)), [f"{n}{' †' if units[n] != 'ulp' else ''}" for n in names])
    ax.set_xticks(range(len(regions)), [r.replace("_", " ") for r in regions], rotation=30, ha="right")
    ax.set_title("Largest error found, float32 under jit [ULP; † norm of the direction's error in 2⁻²⁴]")
    figure.supxlabel(caption, fontsize=6)
    return figure


def speed(rows: Rows, caption: str) -> Figure:
    """Time a point against the number of points."""
    figure, ax = plt.subplots(figsize=(6.6, 3.8), layout="constrained")
    for k, name in enumerate(_unique(rows, "subject")):
        mine = sorted((r for r in rows if r["subject"] == name), key=lambda r: r["points"])
        x, y = [r["points"] for r in mine], [r["median"] for r in mine]
        low = [r["median"] - r["lower"] for r in mine]
        high = [r["upper"] - r["median"] for r in mine]
        shade = str(0.55 * (k % 3) / 2)
        ax.errorbar(
            x,
            y,
            yerr=[low, high],
            label=name.replace("_", "-"),
            marker=MARKERS[k],
            ms=4,
            lw=1,
            ls=LINES[k % 4],
            color=shade,
            elinewidth=0.6,
        )
    ax.set(xscale="log", yscale="log", xlabel="points in a call", ylabel="time a point [ns]")
    ax.set_xscale("log", base=2)
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1), frameon=False)
    ax.grid(True, which="major", lw=0.3, color="0.8")
    ax.set_title("Samplers of visible normals, float32, median and quartiles of turns")
    figure.supxlabel(caption, fontsize=6)
    return figure


def front(rows: Rows) -> Rows:
    """The rows that no other row beats in both time and error, by time."""
    kept, best = [], np.inf
    for r in sorted(rows, key=lambda r: (r["ns"], r["worst"])):
        if r["worst"] < best:
            kept.append(r)
            best = r["worst"]
    return kept


def _within(worst: float) -> float:
    """An error as it is drawn: infinite and vanishing ones at the ends."""
    return min(max(worst, 1e-9), 1e12)


def pareto(rows: Rows, caption: str) -> Figure:
    """Error against time for every form of every quantity, the front drawn."""
    names = _unique(rows, "quantity")
    figure, axes = plt.subplots(3, -(-len(names) // 3), figsize=(12.5, 12), layout="constrained")
    for ax, name in zip(axes.flat, names, strict=False):
        mine = [r for r in rows if r["quantity"] == name]
        edge = front(mine)
        ax.step([r["ns"] for r in edge], [_within(r["worst"]) for r in edge], where="post", color="0.6", lw=1)
        for k, r in enumerate(mine):
            ax.plot(
                r["ns"],
                _within(r["worst"]),
                MARKERS[k],
                color="black",
                ms=6,
                mfc="black" if r in edge else "white",
                label=r["variant"] + (" (approximate)" if r["approximate"] else ""),
            )
        ax.set(xscale="log", yscale="log", xlabel="time [ns a point]", ylabel="largest error [float32 ULP]")
        ax.set_title(QUANTITIES[name].label)
        low, high = min(r["ns"] for r in mine), max(r["ns"] for r in mine)
        ax.set_xlim(low / 1.6, high * 1.6)
        ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 20 * low else (1,)))
        ax.xaxis.set_major_formatter("{x:g}")
        ax.xaxis.set_minor_formatter("")
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), frameon=False, fontsize=6.5, ncol=2, columnspacing=1)
        ax.grid(True, which="major", lw=0.3, color="0.85")
    for ax in list(axes.flat)[len(names) :]:
        ax.set_axis_off()
    figure.suptitle("Time against the largest error found in all regions; filled marks are on the front", fontsize=9)
    figure.supxlabel(caption, fontsize=6)
    return figure


def _map(ax, rows, key, limits, labels):
    first, second = (np.array(sorted({r[k] for r in rows})) for k in ("first", "second"))
    grid, fault = (np.full((len(second), len(first)), np.nan) for _ in range(2))
    for r in rows:
        at = np.searchsorted(second, r["second"]), np.searchsorted(first, r["first"])
        grid[at], fault[at] = r[key], r.get("fault", 0.0)
    image = ax.imshow(grid, origin="lower", aspect="auto", cmap="Greys", vmin=limits[0], vmax=limits[1])
    for i, j in zip(*np.nonzero(fault > 0), strict=True):
        dark = grid[i, j] > (limits[0] + limits[1]) / 2
        ax.plot(j, i, "x", color="white" if dark else "black", ms=2.5, mew=0.6)
    for axis, values in ((ax.xaxis, first), (ax.yaxis, second)):
        ticks = np.unique(np.linspace(0, len(values) - 1, 4).astype(int))
        axis.set_ticks(ticks, [f"{values[t]:.2g}" if values[t] < 80 else f"{values[t]:g}"[:6] for t in ticks])
    ax.set(xlabel=labels[0], ylabel=labels[1])
    return image


PLANES = {
    "alpha-theta": ("α", "θ [°]"),
    "alpha-ratio": ("α", "αx/αy"),
    "skew-theta": ("mean slope |e|", "θ [°]"),
}


def _lines(rows: Rows, line: tuple[str, ...], columns: int) -> list[list[tuple[str, Rows]]]:
    """Panels by lines: all variants of one `line` side by side, broken after so many columns."""
    grouped: dict[tuple, dict[str, Rows]] = {}
    for r in rows:
        grouped.setdefault(tuple(r[k] for k in line), {}).setdefault(r["variant"], []).append(r)
    lines = []
    for key, panels in grouped.items():
        named = [(f"{str(key[0]).replace('_', '-')}: {variant}", mine) for variant, mine in panels.items()]
        lines += [named[i : i + columns] for i in range(0, len(named), columns)]
    return lines


def _panels(lines: list[list[tuple[str, Rows]]], columns: int, key: str, limits, label: str, caption: str) -> Figure:
    size = (2.3 * columns, 2.0 * len(lines) + 0.6)
    figure, axes = plt.subplots(len(lines), columns, figsize=size, layout="constrained", squeeze=False)
    for ax in axes.flat:
        ax.set_axis_off()
    for row, panels in zip(axes, lines, strict=True):
        for ax, (title, mine) in zip(row, panels, strict=False):
            ax.set_axis_on()
            image = _map(ax, mine, key, limits, PLANES[mine[0].get("plane", "alpha-theta")])
            ax.set_title(title, fontsize=7)
    text = f"{label}\n{caption}"
    figure.colorbar(image, ax=axes, label=text, location="bottom", shrink=0.5, aspect=40, pad=0.02, extend="both")
    return figure


def stability(rows: Rows, caption: str) -> Figure:
    """Digits lost, form by form."""
    label = "log₁₀ of the error that 95 % of the points stay below [ULP; samplers: 2⁻²⁴]; × NaN or inf"
    # The library alone knows skewed shapes: one line holds all its quantities.
    skewed = [r | {"quantity": "skewed", "variant": r["quantity"]} for r in rows if r["plane"] == "skew-theta"]
    lines = _lines([r for r in rows if r["plane"] != "skew-theta"] + skewed, ("quantity", "plane"), 5)
    return _panels(lines, 5, "digits", (-0.3, 6), label, caption)


def variance(rows: Rows, caption: str) -> Figure:
    """Efficiency of every sampler relative to the cap."""
    ns = {r["sampler"]: r["ns"] for r in rows if "ns" in r and r["ns"] not in ("", None)}
    cells = [r for r in rows if r.get("variance") not in ("", None)]
    cap = {(r["first"], r["second"]): r["variance"] * ns["cap"] for r in cells if r["sampler"] == "cap"}
    made = []
    for r in cells:
        own = max(r["variance"] * ns[r["sampler"]], 1e-30)
        ratio = np.log10(cap[r["first"], r["second"]] / own)
        made.append(
            {"quantity": r["sampler"], "variant": f"{ns[r['sampler']]:.3g} ns", "plane": "alpha-theta"}
            | {"first": r["first"], "second": r["second"], "ratio": ratio}
        )
    label = "log₁₀ of 1/(variance × time) over the cap's"
    named = [[r for r in made if r["quantity"] == name] for name in _unique(made, "quantity")]
    panels = [(f"{part[0]['quantity']} ({part[0]['variant']})", part) for part in named]
    return _panels([panels[i : i + 4] for i in range(0, len(panels), 4)], 4, "ratio", (-2, 2), label, caption)


def gradient(rows: Rows, caption: str) -> Figure:
    """Error of ∂/∂α."""
    label = "log₁₀ of the relative error of ∂/∂α; × not finite"
    return _panels(_lines(rows, ("quantity",), 3), 3, "error", (-7.5, 0), label, caption)


DRAWINGS: dict[str, Callable[[Rows, str], Figure]] = {
    "accuracy": accuracy,
    "speed": speed,
    "pareto": pareto,
    "stability": stability,
    "variance": variance,
    "gradient": gradient,
}


def render(kind: str, rows: Rows, caption: str) -> dict[str, bytes | str]:
    """The chart as the files that carry it: {"png": …, "svg": …}."""
    with plt.rc_context(STYLE):
        figure = DRAWINGS[kind](rows, caption)
        png, svg = BytesIO(), StringIO()
        figure.savefig(png, format="png", dpi=110)
        figure.savefig(svg, format="svg", metadata={"Date": None})
        plt.close(figure)
    return {"png": png.getvalue(), "svg": svg.getvalue()}
