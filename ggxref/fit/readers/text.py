"""What readers of text share: rows of four angles and the BRDF per band, and what is wrong with them, line by line."""

import math
from typing import NamedTuple

import numpy as np

from ggxref.errors import InputError
from ggxref.fit.data import Reflectance, Source, direction

ANGLES = ("zenith_i", "azimuth_i", "zenith_o", "azimuth_o")
FEWEST_ROWS = 8


class Rows(NamedTuple):
    """`names` of the columns, empty if no row of words named them; `numbers`: (rows, columns); `lines`: where each row is."""

    names: list[str]
    numbers: np.ndarray
    lines: list[int]


def decode(content: bytes, path: str) -> str:
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text at byte {error.start}") from error


def words(line: str) -> list[str]:
    """The columns of a line, between blanks or commas."""
    return line.replace(",", " ").split()


def read_rows(text: list[str], first: int, path: str) -> Rows:
    """The rows of `text`, whose first line is line `first` of the file; `#` starts a comment."""
    names, rows, lines = [], [], []
    for number, line in enumerate(text, first):
        columns = words(line)
        if not columns or columns[0].startswith("#"):
            continue
        try:
            row = [float(word) for word in columns]
        except ValueError as error:
            if rows or names:
                raise InputError(f"{path} line {number}: {error}; need a number in each column") from error
            names = columns
            continue
        if rows and len(row) != len(rows[0]):
            raise InputError(f"{path} line {number}: {len(row)} columns where the rows above have {len(rows[0])}")
        rows.append(row)
        lines.append(number)
    if len(rows) < FEWEST_ROWS or len(rows[0]) <= len(ANGLES):
        columns = f" of {len(rows[0])} columns" if rows else ""
        raise InputError(
            f"{path}: no measurement: {len(rows)} rows of numbers{columns}; need at least {FEWEST_ROWS} rows of four "
            "angles and a BRDF value [1/sr]"
        )
    return Rows(names, np.array(rows), lines)


def reflectance(rows: Rows, names: list[str], source: Source, unit: float) -> Reflectance:
    """The measurement in these rows; `names` of the columns. `unit`: radians of the file's angles' unit."""
    if len(names) != rows.numbers.shape[1]:
        names = [*ANGLES, *(f"band {k}" for k in range(rows.numbers.shape[1] - len(ANGLES)))]
    order = [names.index(name) for name in ANGLES] if set(ANGLES) <= set(names) else [0, 1, 2, 3]
    angles = rows.numbers[:, order]
    bands = [k for k in range(len(names)) if k not in order]
    values = rows.numbers[:, bands]
    _check_values(values, [names[k] for k in bands], rows.lines, source.path)
    _check_angles(angles, unit, rows.lines, source.path)
    wi, wo = (direction(*(angles[:, k : k + 2] * unit).T) for k in (0, 2))
    # The cosine of 90 degrees rounds to 6e-17.
    on_horizon = np.abs(angles[:, ::2]).max(axis=1) * unit >= math.pi / 2 - 1e-9
    return Reflectance(
        wi=wi,
        wo=wo,
        values=values,
        weights=np.ones(len(values)),
        mask=~on_horizon,
        bands=tuple(names[k] for k in bands),
        source=source,
        counts={"left out: on the horizon": int(on_horizon.sum())},
    )


def _check_values(values: np.ndarray, names: list[str], lines: list[int], path: str) -> None:
    bad = ~(np.isfinite(values) & (values >= 0))
    if bad.any():
        row, band = np.argwhere(bad)[0]
        others = f" ({bad.sum() - 1} more such values)" if bad.sum() > 1 else ""
        raise InputError(
            f"{path} line {lines[row]}: {names[band]} = {values[row, band]:g}; a BRDF is finite and not negative{others}"
        )
    if not values.any(axis=0).all():
        raise InputError(f"{path}: {names[int(np.argmin(values.any(axis=0)))]} is 0 in every row; nothing to fit")


def _check_angles(angles: np.ndarray, unit: float, lines: list[int], path: str) -> None:
    _check_unit(np.abs(angles), unit, path)
    name_of_unit = "radians" if unit == 1 else "degrees"
    for column, name in enumerate(ANGLES):
        angle = angles[:, column]
        limit, why = (math.pi / 2, "is below the horizon") if column % 2 == 0 else (2 * math.pi, "is no azimuth")
        # Goniometers print four digits, and a right angle in four digits may exceed it.
        bad = ~(np.abs(angle) * unit <= limit + 1e-4)
        if bad.any():
            row = int(np.argmax(bad))
            raise InputError(
                f"{path} line {lines[row]}: {name} = {angle[row]:g} {why}; need -{limit / unit:.4g} to {limit / unit:.4g} {name_of_unit}"
            )


def _check_unit(sizes: np.ndarray, unit: float, path: str) -> None:
    """That the angles, `sizes` without their signs, are not in the other unit."""
    zenith, azimuth = sizes[:, ::2].max(), sizes[:, 1::2].max()
    said = f"{path}: zeniths up to {zenith:.4g} and azimuths up to {azimuth:.4g}"
    # Radians pass every range of degrees; but no goniometer keeps its zeniths under 1.6 and its azimuths under 6.3 degrees.
    if unit != 1 and zenith <= math.pi / 2 + 1e-3 and azimuth <= 2 * math.pi + 1e-3:
        raise InputError(f"{said}: these look like radians; need degrees")
    # A single angle beyond the range of radians is a bad line; half the zeniths beyond it are another unit.
    beyond = np.count_nonzero(sizes[:, ::2].max(axis=1) > math.pi / 2 + 1e-3)
    if unit == 1 and 2 * beyond >= len(sizes) and zenith <= 90 and azimuth <= 360:
        raise InputError(f"{said}: these look like degrees; need radians")
