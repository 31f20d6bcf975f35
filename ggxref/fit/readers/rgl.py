"""RGL tensor files (`.bsdf`): the adaptive goniometer measurements of Dupuy & Jakob 2018.

Little-endian. `tensor_file` and a zero byte, two bytes of version, the count of fields; per field its name, dtype, offset and shape.
Here the incident directions are in `theta_i`, `phi_i`; per incident direction an N x N grid of the unit square holds `rgb`, and the
grid's directions come from it through the inverse of the distribution `vndf`: micronormals, at which the outgoing direction
mirrors the incident one. The value is $f\\cos\\theta_o = \\mathtt{rgb}\\; D(\\omega_m) / (4\\sigma(\\omega_i))$.
"""

import math
import struct
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ggxref.errors import InputError
from ggxref.fit.data import Reflectance, Source, direction

MAGIC = b"tensor_file\0"
TYPES = [
    None,
    *(np.dtype(code) for code in ("u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8")),
]
MOST_DIMENSIONS = 8
STEEPEST = math.radians(80)
"""Incident zeniths from here on are left out: the instrument saw mostly its own edge there."""
NEEDED = {"theta_i": 1, "phi_i": 1, "ndf": 2, "sigma": 2, "vndf": 4, "rgb": 5}


def recognise(content: bytes) -> bool:
    return content.startswith(MAGIC)


def parse(content: bytes, source: Source) -> Reflectance:
    fields = read_fields(content, source.path)
    for name, dimensions in NEEDED.items():
        if name not in fields or fields[name].ndim != dimensions or not fields[name].size:
            got = f"has shape {fields[name].shape}" if name in fields else "is missing"
            raise InputError(f"{source.path}: field {name!r} {got}; need {dimensions} dimensions")
    tables = _checked(fields, source.path)
    azimuths, zeniths, grid = len(tables["phi_i"]), len(tables["theta_i"]), tables["rgb"].shape[3:]
    for name in ("vndf", "rgb"):
        if tables[name].shape[:2] != (azimuths, zeniths):
            raise InputError(
                f"{source.path}: field {name!r} of shape {tables[name].shape} does not fit {azimuths} x {zeniths} directions"
            )
    parts = [_lobe(tables, a, z, grid) for a in range(azimuths) for z in range(zeniths)]
    wi, wo, values = (np.concatenate(column) for column in zip(*parts, strict=True))
    steep = wi[:, 2] <= math.cos(STEEPEST)
    below = wo[:, 2] <= 0
    negative = (values < 0).any(axis=1)
    return Reflectance(
        wi=wi,
        wo=wo,
        values=values,
        weights=np.ones(len(wi)),
        mask=~(steep | below),
        bands=("r", "g", "b")[: values.shape[1]],
        source=source,
        counts={
            f"left out: incident zenith from {math.degrees(STEEPEST):g}° on": int(steep.sum()),
            "left out: below the horizon": int((below & ~steep).sum()),
            "taken as 0: negative in a band": int((negative & ~steep & ~below).sum()),
        },
    )


LARGEST = 1e30
"""Of any value: the largest mirror's density has 1e10, and squares of what is larger overflow."""


def _checked(fields: dict[str, np.ndarray], path: str) -> dict[str, np.ndarray]:
    """The needed fields in float64, each within what it can mean."""
    with np.errstate(all="ignore"):
        tables = {name: np.asarray(fields[name]).astype(np.float64) for name in NEEDED}
    limits = {
        "theta_i": (0, math.pi / 2 + 1e-4),
        "phi_i": (-7, 7),
        "rgb": (-LARGEST, LARGEST),
        "sigma": (1e-6, LARGEST),
    }
    for name, table in tables.items():
        low, high = limits.get(name, (0, LARGEST))
        if not ((table >= low) & (table <= high)).all():
            bad = table[~((table >= low) & (table <= high))][0]
            raise InputError(
                f"{path}: field {name!r} holds {bad:g}, which is not finite or not from {low:g} to {high:g}"
            )
        if name in ("ndf", "sigma", "vndf") and min(table.shape[-2:]) < 2:
            raise InputError(f"{path}: field {name!r} has shape {table.shape}; need 2 or more nodes an axis")
    return tables


class _Axis(NamedTuple):
    """Where points lie in a grid of nodes at 0, 1/(n − 1), …, 1: the cell, and the fraction of it."""

    cell: np.ndarray
    fraction: np.ndarray


def read_fields(content: bytes, path: str) -> dict[str, np.ndarray]:
    """The fields of a tensor file, by name, without a copy: each is checked to lie within the file."""
    stream = _Reader(content, len(MAGIC) + 2, path)
    fields = {}
    for _ in range(stream.take("<I")[0]):
        name = stream.text(stream.take("<H")[0])
        dimensions, code, offset = stream.take("<HBQ")
        if not 0 < code < len(TYPES) or dimensions > MOST_DIMENSIONS:
            raise InputError(
                f"{path}: field {name!r} has type {code} and {dimensions} dimensions; need 1 to {len(TYPES) - 1}, at most {MOST_DIMENSIONS}"
            )
        shape, dtype = stream.take(f"<{dimensions}Q"), TYPES[code]
        size = math.prod(shape)
        # A size of 0 would let the others be anything.
        if offset + size * dtype.itemsize > len(content) or max(shape, default=0) > len(content):
            raise InputError(f"{path}: field {name!r} of shape {shape} ends beyond the file's {len(content)} bytes")
        fields[name] = np.frombuffer(content, dtype, size, offset).reshape(shape)
    return fields


class _Reader:
    """Takes numbers off the front of bytes, and says so where they end."""

    def __init__(self, content: bytes, at: int, path: str):
        self.content, self.at, self.path = content, at, path

    def take(self, layout: str) -> tuple:
        return struct.unpack(layout, self._bytes(struct.calcsize(layout)))

    def text(self, size: int) -> str:
        return self._bytes(size).decode("latin-1")

    def _bytes(self, size: int) -> bytes:
        piece = self.content[self.at : self.at + size]
        if len(piece) < size:
            raise InputError(f"{self.path}: the header ends after {len(self.content)} bytes; the file is truncated")
        self.at += size
        return piece


def _lobe(tables: dict[str, np.ndarray], azimuth: int, zenith: int, grid: tuple[int, int]):
    """wi, wo (n, 3) and the BRDF (n, bands) of one incident direction."""
    theta, phi = tables["theta_i"][zenith], tables["phi_i"][azimuth]
    # An isotropic table has one azimuth, and its micronormals' azimuths are relative to it.
    wi = direction(theta, phi if len(tables["phi_i"]) > 1 else 0.0)
    v, u = (axis.ravel() for axis in np.meshgrid(*(np.linspace(0, 1, n) for n in grid), indexing="ij"))
    x, y = invert(tables["vndf"][azimuth, zenith], u, v)
    wm = direction(x * x * (math.pi / 2), (2 * y - 1) * math.pi)
    wo = 2 * (wm @ wi)[:, None] * wm - wi
    at = np.sqrt([theta / (math.pi / 2)]), np.array([(phi / math.pi + 1) / 2])
    sigma = bilinear(tables["sigma"], *at)[0]
    scale = bilinear(tables["ndf"], x, y) / (4 * sigma)
    # At the horizon f has no value; those rows are masked.
    cosine = np.where(wo[:, 2] > 0, wo[:, 2], 1.0)
    rgb = tables["rgb"][azimuth, zenith].reshape(-1, len(scale))
    return np.broadcast_to(wi, wo.shape), wo, (rgb * scale / cosine).T


def _place(coordinate, nodes: int) -> _Axis:
    cell = np.clip(np.floor(coordinate * (nodes - 1)).astype(int), 0, nodes - 2)
    return _Axis(cell, coordinate * (nodes - 1) - cell)


def bilinear(table: np.ndarray, x, y) -> np.ndarray:
    """`table` (rows along y, columns along x) between its nodes, at points of the unit square."""
    column, row = _place(x, table.shape[1]), _place(y, table.shape[0])
    low, high = (
        table[row.cell + k, column.cell] * (1 - column.fraction)
        + table[row.cell + k, column.cell + 1] * column.fraction
        for k in (0, 1)
    )
    return low * (1 - row.fraction) + high * row.fraction


def invert(density: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points (x, y) of the unit square below which the bilinear `density` holds the shares u of its row and v of all."""
    rows = _cumulative(density)  # (rows, columns)
    total = _cumulative(rows[:, -1])
    row, y = _share(lambda k: total[k], len(total), v)
    fraction = _root(rows[row, -1], rows[row + 1, -1], y)
    column, x = _share(lambda k: rows[row, k] * (1 - fraction) + rows[row + 1, k] * fraction, density.shape[1], u)
    left, right = (density[row, column + k] * (1 - fraction) + density[row + 1, column + k] * fraction for k in (0, 1))
    across = _root(left, right, x)
    return (column + across) / (density.shape[1] - 1), (row + fraction) / (density.shape[0] - 1)


def _cumulative(values: np.ndarray) -> np.ndarray:
    """The running trapezoid integral along the last axis, from 0, nodes 1 apart."""
    steps = (values[..., 1:] + values[..., :-1]) / 2
    return np.concatenate([np.zeros_like(values[..., :1]), np.cumsum(steps, axis=-1)], axis=-1)


def _share(
    cumulative: Callable[[np.ndarray], np.ndarray], nodes: int, share: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The cell in which an integral reaches `share` of its end, and how much of it is left for that cell.

    - `cumulative(k)`: of each share its integral up to node k, (n,), from 0 and never falling.

    By bisection: a table of every share's whole integral would take memory of the file's size squared.
    """
    target = share * cumulative(np.full(len(share), nodes - 1))
    low, high = np.zeros(len(share), int), np.full(len(share), nodes - 1)
    for _ in range(nodes.bit_length()):
        middle = (low + high) // 2
        below = cumulative(middle) <= target
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return low, target - cumulative(low)


def _root(left: np.ndarray, right: np.ndarray, area: np.ndarray) -> np.ndarray:
    """t in [0, 1] with the integral of left + (right − left) s over [0, t] equal to `area`; 0 where all is 0."""
    root = np.sqrt(np.maximum(left * left + 2 * area * (right - left), 0))
    denominator = left + root
    # 2 area / (left + root) is the quadratic's root that does not cancel where left = right.
    return np.clip(2 * area / np.where(denominator > 0, denominator, 1), 0, 1)
