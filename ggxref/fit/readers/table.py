"""Text tables: `#` comments, then rows of four angles in degrees and the BRDF [1/sr] in one or more bands.

Columns are separated by blanks or commas. A last comment line with as many words as columns, or a first row of words,
names them: `zenith_i`, `azimuth_i`, `zenith_o`, `azimuth_o` in any order, then the bands. Under other names the angles
are the first four columns, in that order: some files call the zenith phi, others theta.
"""

import math
from itertools import islice

import numpy as np

from ggxref.errors import InputError
from ggxref.fit.data import Reflectance, Source, direction

ANGLES = ("zenith_i", "azimuth_i", "zenith_o", "azimuth_o")
FEWEST_ROWS = 8


def recognise(content: bytes) -> bool:
    """Text with a number first in the first or the second row that is no comment, and at least five words in it."""
    if b"\0" in content[: 2**16]:
        return False
    lines = (_words(line) for line in content[: 2**16].decode("latin-1").splitlines())
    rows = islice((words for words in lines if words and not words[0].startswith("#")), 2)
    return any(len(words) > len(ANGLES) and _is_number(words[0]) for words in rows)


def parse(content: bytes, source: Source) -> Reflectance:
    names, numbers, lines = _rows(content, source.path)
    order = [names.index(name) for name in ANGLES] if set(ANGLES) <= set(names) else [0, 1, 2, 3]
    degrees = numbers[:, order]
    bands = [k for k in range(numbers.shape[1]) if k not in order]
    values = numbers[:, bands]
    _check_values(values, [names[k] for k in bands], lines, source.path)
    _check_angles(degrees, lines, source.path)
    zenith_i, azimuth_i, zenith_o, azimuth_o = np.radians(degrees).T
    on_horizon = (np.abs(degrees[:, 0]) == 90) | (np.abs(degrees[:, 2]) == 90)
    return Reflectance(
        wi=direction(zenith_i, azimuth_i),
        wo=direction(zenith_o, azimuth_o),
        values=values,
        weights=np.ones(len(values)),
        mask=~on_horizon,
        bands=tuple(names[k] for k in bands),
        source=source,
        excluded={"on the horizon": int(on_horizon.sum())},
    )


def _words(line: str) -> list[str]:
    return line.replace(",", " ").split()


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _rows(content: bytes, path: str) -> tuple[list[str], np.ndarray, list[int]]:
    """Column names, the numbers (rows, columns), and the line of each row."""
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text at byte {error.start}") from error
    comment, names, rows, lines = [], [], [], []
    for number, line in enumerate(text.splitlines(), 1):
        words = _words(line)
        if not words:
            continue
        if words[0].startswith("#"):
            comment = comment if rows else _words(line.replace("#", " "))
            continue
        try:
            row = [float(word) for word in words]
        except ValueError as error:
            if rows or names:
                raise InputError(f"{path} line {number}: {error}; need a number in each column") from error
            names = words
            continue
        if rows and len(row) != len(rows[0]):
            raise InputError(f"{path} line {number}: {len(row)} columns where the rows above have {len(rows[0])}")
        rows.append(row)
        lines.append(number)
    if len(rows) < FEWEST_ROWS or len(rows[0]) <= len(ANGLES):
        columns = f" of {len(rows[0])} columns" if rows else ""
        raise InputError(
            f"{path}: no measurement: {len(rows)} rows of numbers{columns}; need at least {FEWEST_ROWS} rows of four "
            "angles [degrees] and a BRDF value [1/sr]"
        )
    names = names or comment
    if len(names) != len(rows[0]):
        names = [*ANGLES, *(f"band {k}" for k in range(len(rows[0]) - len(ANGLES)))]
    return names, np.array(rows), lines


def _check_values(values: np.ndarray, names: list[str], lines: list[int], path: str) -> None:
    bad = ~(np.isfinite(values) & (values >= 0))
    if bad.any():
        row, band = np.argwhere(bad)[0]
        others = f" ({bad.sum() - 1} more such values)" if bad.sum() > 1 else ""
        raise InputError(
            f"{path} line {lines[row]}: {names[band]} = {values[row, band]:g}; "
            f"a BRDF is finite and not negative{others}"
        )
    if not values.any(axis=0).all():
        raise InputError(f"{path}: {names[int(np.argmin(values.any(axis=0)))]} is 0 in every row; nothing to fit")


def _check_angles(degrees: np.ndarray, lines: list[int], path: str) -> None:
    for column, name in enumerate(ANGLES):
        angle = degrees[:, column]
        limit, why = (90, "is below the horizon") if column % 2 == 0 else (360, "is no azimuth in degrees")
        bad = ~(np.abs(angle) <= limit)
        if bad.any():
            row = int(np.argmax(bad))
            raise InputError(
                f"{path} line {lines[row]}: {name} = {angle[row]:g} {why}; need -{limit} to {limit} degrees"
            )
    # Radians pass every range above; but no goniometer keeps all its zeniths under 1.6 and its azimuths under 6.3 degrees.
    zenith, azimuth = np.abs(degrees[:, ::2]).max(), np.abs(degrees[:, 1::2]).max()
    if zenith <= math.pi / 2 + 1e-3 and azimuth <= 2 * math.pi + 1e-3:
        raise InputError(
            f"{path}: no zenith above {zenith:.4g} and no azimuth above {azimuth:.4g}: "
            "these look like radians; need degrees"
        )
