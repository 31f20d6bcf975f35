"""MERL binaries: isotropic BRDFs over half vectors and difference angles (Matusik et al. 2003; Rusinkiewicz 1998).

Three i32 sizes (θh, θd, φd), then a plane of f64 per colour, φd fastest. Node i of θh is at (i/n)² π/2, the others are
evenly spaced over [0, π/2] and [0, π]; negative values are missing.
"""

import math
import struct

import numpy as np

from ggxref.errors import InputError
from ggxref.fit.data import Reflectance, Source

SCALES = (1.0 / 1500, 1.15 / 1500, 1.66 / 1500)
HEADER = 12
LARGEST_SIDE = 1024


def recognise(content: bytes) -> bool:
    """Sizes that account for every byte, or MERL's own sizes at the start of a file that was cut."""
    if len(content) < HEADER:
        return False
    sizes = struct.unpack_from("<3i", content)
    whole = all(0 < size <= LARGEST_SIDE for size in sizes) and _due(sizes) == len(content)
    return whole or sizes == (90, 90, 180)


def _due(sizes: tuple[int, ...]) -> int:
    return HEADER + len(SCALES) * math.prod(sizes) * 8


def parse(content: bytes, source: Source) -> Reflectance:
    sizes = struct.unpack_from("<3i", content)
    if _due(sizes) != len(content):
        raise InputError(
            f"{source.path}: {len(content)} bytes where {sizes} takes {_due(sizes)}; the file is truncated"
        )
    planes = np.frombuffer(content, "<f8", offset=HEADER).reshape(3, -1)
    if not np.isfinite(planes).all():
        raise InputError(f"{source.path}: a value is not finite; a BRDF is, and a missing one negative")
    values = planes.T * SCALES
    wi, wo = directions(sizes)
    missing = (values < 0).any(axis=1)
    below = (wi[:, 2] <= 0) | (wo[:, 2] <= 0)
    return Reflectance(
        wi=wi,
        wo=wo,
        values=values,
        weights=np.ones(len(wi)),
        mask=~(missing | below),
        bands=("r", "g", "b"),
        source=source,
        counts={
            "left out: below the horizon": int(below.sum()),
            "left out: missing (negative)": int((missing & ~below).sum()),
        },
    )


def directions(sizes: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """wi and wo of every node, (n, 3): the difference vector turned by θh about y; the half vector lies in the xz plane."""
    half, difference, azimuth = (np.arange(size) / size for size in sizes)
    grid = np.meshgrid(half**2 * (math.pi / 2), difference * (math.pi / 2), azimuth * math.pi, indexing="ij")
    theta_h, theta_d, phi_d = (axis.ravel() for axis in grid)
    x, y, z = np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)
    cosine, sine = np.cos(theta_h), np.sin(theta_h)
    wi = np.stack([cosine * x + sine * z, y, cosine * z - sine * x], axis=-1)
    # wo mirrors wi about the half vector: in the difference frame x and y change sign.
    wo = np.stack([sine * z - cosine * x, -y, cosine * z + sine * x], axis=-1)
    return wi, wo
