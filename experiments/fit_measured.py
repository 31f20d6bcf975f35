"""Which model suffices for each real measurement, what the next one up would buy, and where none fits. Writes docs/fitting.md's tables.

GGXREF_DATA=../shared/data python experiments/fit_measured.py docs/fitting.md
"""

import os
import sys
from pathlib import Path

from part import write_part

from ggxref.errors import InputError
from ggxref.fit import fit, identification, read
from ggxref.fit.fitting import Fit, Ladder

FILES = ("merl/*.csv", "starlink/*.csv", "rgl/*.bsdf", "height/*")
LEVELS = {"sample-land.x3p": 2}


def shown(best: Fit) -> str:
    alpha = f"α {best.values['alpha_1']:.3g}"
    if best.values["anisotropy"] > 1.001:
        alpha += f" × {best.values['alpha_2']:.3g}"
    gamma = f", γ {best.values['gamma']:.3g} ± {best.errors['gamma']:.1g}" if best.model.tail == "student_t" else ""
    mean = (
        f", mean slope {best.values['mean_slope']:.3g} ± {best.errors['mean_slope']:.1g}"
        if best.values["mean_slope"]
        else ""
    )
    return alpha + gamma + mean


def row(ladder: Ladder) -> str:
    best = ladder.best
    larger = next((each for each in ladder.fits if each.space.size > best.space.size), None)
    gain = f"{larger.model.name}: {(best.held_out - larger.held_out).mean():+.2g}" if larger else "none larger"
    quality = f"{best.log_rmse:.3f}" if ladder.problem.surface else f"{-best.loss:.4f}"
    warnings = "; ".join([*([best.trouble] if best.trouble else []), *identification.warnings(ladder)])
    return f"| {Path(ladder.measurement.source.path).name} | {best.model.name} | {quality} | {shown(best)} | {gain} | {warnings} |"


def detail(ladder: Ladder) -> list[str]:
    """Every model's error or likelihood, in one row."""
    quality = [f"{fit.log_rmse:.3f}" if ladder.problem.surface else f"{-fit.loss:.4f}" for fit in ladder.fits]
    cells = {fit.model.name: value for fit, value in zip(ladder.fits, quality, strict=True)}
    shapes = ("isotropic", "anisotropic", "rotated", "ellipsoid")
    names = [*shapes, *(f"{shape} student_t" for shape in shapes)]
    return [
        f"| {Path(ladder.measurement.source.path).name} | " + " | ".join(cells.get(name, "") for name in names) + " |"
    ]


def main(page: Path) -> None:
    folder = Path(os.environ.get("GGXREF_DATA", "../shared/data"))
    files = [path for pattern in FILES for path in sorted(folder.glob(pattern))]
    if not files:
        raise InputError(f"no measurement under {folder}: set GGXREF_DATA")
    ladders = []
    for path in files:
        ladders.append(fit(read(path), degree=LEVELS.get(path.name, 1)))
        print(row(ladders[-1]), flush=True)
    table = [
        "| file | smallest model that suffices | log-RMSE, or mean log-likelihood | shape | next one up: held-out gain | what the fit says |",
        "|" + "---|" * 6,
    ]
    every = [
        "| file | isotropic | anisotropic | rotated | ellipsoid | isotropic γ | anisotropic γ | rotated γ | ellipsoid γ |",
        "|" + "---|" * 9,
    ]
    for ladder in ladders:
        table.append(row(ladder))
        every += detail(ladder)
    write_part(page, "measured: experiments/fit_measured.py", "\n".join([*table, "", *every, ""]))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
