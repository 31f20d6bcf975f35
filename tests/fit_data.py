"""Synthetic measurements for the tests of fits, made with the library's own formulas and not with `fit.models`."""

import io
import zipfile
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from ggxref import bsdf, ellipsoid, fresnel, geometry, masking, ndf
from ggxref.fit import solver

PIXEL = 1e-6
HEADER = "# zenith_i azimuth_i zenith_o azimuth_o brdf\n"


def angles(zenith_i=(10.0, 25.0, 40.0, 55.0, 70.0)) -> np.ndarray:
    """(n, 4) degrees: each incident zenith with 12 x 16 outgoing directions over the hemisphere."""
    zenith_o = np.linspace(3, 80, 12)
    azimuth_o = np.arange(16) * 22.5
    grid = np.meshgrid(zenith_i, [180.0], zenith_o, azimuth_o, indexing="ij")
    return np.stack([axis.ravel() for axis in grid], axis=-1)


def plane_angles(zenith_i=(10.0, 25.0, 40.0, 55.0, 70.0)) -> np.ndarray:
    """(n, 4) degrees: directions in the plane of incidence, negative zeniths on the side of the light."""
    grid = np.meshgrid(zenith_i, [180.0], np.linspace(-85, 85, 171), [0.0], indexing="ij")
    return np.stack([axis.ravel() for axis in grid], axis=-1)


def direction(zenith, azimuth):
    sine = np.sin(zenith)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(zenith)], axis=-1)


def brdf(degrees: np.ndarray, A: np.ndarray, f0: float, diffuse: float) -> np.ndarray:
    """(n,): the BRDF from `ndf.ellipsoid`, `masking.g1_ellipsoid` and Schlick's F, plus a diffuse term."""

    def one(wi, wo, A):
        wm = geometry.half_reflection(wi, wo)
        g2 = masking.g2_height_correlated(masking.g1_ellipsoid(wi, wm, A), masking.g1_ellipsoid(wo, wm, A))
        return bsdf.brdf(wi, wo, ndf.ellipsoid(wm, A), g2, fresnel.schlick(jnp.dot(wi, wm), f0)) + diffuse / jnp.pi

    zenith_i, azimuth_i, zenith_o, azimuth_o = np.radians(degrees).T
    with solver.float64():
        wi, wo = jnp.asarray(direction(zenith_i, azimuth_i)), jnp.asarray(direction(zenith_o, azimuth_o))
        return np.asarray(jax.vmap(one, (0, 0, None))(wi, wo, jnp.asarray(A)))


def shape(mean=(0.0, 0.0), scatter=((0.04, 0.0), (0.0, 0.04))) -> np.ndarray:
    """The canonical shape matrix of a mean slope and a scatter Σ."""
    with solver.float64():
        return np.asarray(ellipsoid.from_slopes(jnp.asarray(mean), jnp.asarray(scatter)))


def table(degrees: np.ndarray, values: np.ndarray, header: str = HEADER) -> str:
    return header + "".join(
        " ".join(f"{x:.17g}" for x in (*row, v)) + "\n" for row, v in zip(degrees, values, strict=True)
    )


def half_ellipsoid(radii: tuple[float, float], turn: float, mean: tuple[float, float], side: int = 201) -> np.ndarray:
    """Heights [m] of a half ellipsoid of height 1 pixel · side, on a plane tilted by `mean`, NaN around it.

    - `radii`: half axes in the plane over the height, so that α is 1/radius along each; `turn`: azimuth of the first.

    The slopes over its shadow have exactly the slope density of GGX (walter2014 derives D from them), moved by `mean`.
    """
    scale = side / 2 / max(radii)  # pixels: the height of the half ellipsoid
    place = np.arange(side) - (side - 1) / 2
    y, x = np.meshgrid(place, place, indexing="ij")
    u = (np.cos(turn) * x + np.sin(turn) * y) / (radii[0] * scale)
    v = (np.cos(turn) * y - np.sin(turn) * x) / (radii[1] * scale)
    square = 1 - u * u - v * v
    dome = np.where(square > 0, np.sqrt(np.maximum(square, 0)), np.nan) * scale
    return (dome + mean[0] * x + mean[1] * y) * PIXEL


def rough_surface(side: int = 48, seed: int = 5) -> np.ndarray:
    """A smooth random surface [m], slopes about 0.2, twice as steep along x."""
    noise = np.random.default_rng(seed).normal(size=(side, side))
    fx, fy = np.fft.fftfreq(side)[None, :], np.fft.fftfreq(side)[:, None]
    low = np.exp(-((fx * 8) ** 2) - (fy * 16) ** 2)
    heights = np.fft.ifft2(np.fft.fft2(noise) * low).real
    return heights / heights.std() * 0.5 * PIXEL


MAIN = """<?xml version="1.0"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2"><Record1><Axes>
<CX><AxisType>I</AxisType><DataType>L</DataType><Increment>{dx}</Increment></CX>
<CY><AxisType>I</AxisType><DataType>L</DataType><Increment>{dy}</Increment></CY>
<CZ><AxisType>A</AxisType><DataType>{code}</DataType><Increment>{dz}</Increment></CZ></Axes></Record1>
<Record3><MatrixDimension><SizeX>{nx}</SizeX><SizeY>{ny}</SizeY><SizeZ>{nz}</SizeZ></MatrixDimension>
<DataLink><PointDataLink>bindata/data.bin</PointDataLink></DataLink></Record3></p:ISO5436_2>"""

CODES = {"D": "<f8", "F": "<f4", "L": "<i4", "I": "<i2"}


def x3p(heights: np.ndarray, code: str = "D", dz: float = 1.0, main: str = MAIN, **changes) -> bytes:
    """An x3p file of `heights`, in units of `dz`; `changes` go into main.xml alone, to contradict the data."""
    ny, nx = heights.shape
    fields = {"nx": nx, "ny": ny, "nz": 1, "dx": PIXEL, "dy": 2 * PIXEL, "dz": dz, "code": code} | changes
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("main.xml", main.format(**fields))
        archive.writestr("bindata/data.bin", heights.astype(CODES[code]).tobytes())
    return stream.getvalue()


def matrix(heights: np.ndarray, pixel: str = "1e-6 m", factor: str = "1e-9", size: str | None = None) -> str:
    """A text matrix of `heights` in units of `factor`."""
    ny, nx = heights.shape
    rows = "\n".join(" ".join(f"{h:.9g}" for h in row) for row in heights)
    size = size or f"h={ny} w={nx}"
    return f"{size}\npixel size={pixel}\ndata unit=rad\nheight conversion factor (-> m)={factor}\n{rows}\n"


def npy(heights: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, heights)
    return stream.getvalue()


def write(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path
