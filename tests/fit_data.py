"""Synthetic measurements for the tests of fits, made with the library's own formulas and not with `fit.models`."""

import io
import zipfile
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from ggxref import bsdf, ellipsoid, fresnel, geometry, masking, ndf
from ggxref.fit import solver
from ggxref.fit.data import Reflectance, Source
from ggxref.fit.readers import rgl

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


def directions(degrees: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """wi, wo and their half vectors, (3, n) each."""
    zenith_i, azimuth_i, zenith_o, azimuth_o = np.radians(degrees).T
    wi, wo = direction(zenith_i, azimuth_i), direction(zenith_o, azimuth_o)
    with solver.float64():
        wm = np.asarray(jax.vmap(geometry.half_reflection)(jnp.asarray(wi), jnp.asarray(wo)))
    return wi.T, wo.T, wm.T


@jax.jit
@partial(jax.vmap, in_axes=(0, 0, None, None, None))
def _brdf(wi, wo, A, f0, diffuse):
    wm = geometry.half_reflection(wi, wo)
    g2 = masking.g2_height_correlated(masking.g1_ellipsoid(wi, wm, A), masking.g1_ellipsoid(wo, wm, A))
    return bsdf.brdf(wi, wo, ndf.ellipsoid(wm, A), g2, fresnel.schlick(jnp.dot(wi, wm), f0)) + diffuse / jnp.pi


def brdf(degrees: np.ndarray, A: np.ndarray, f0: float, diffuse: float) -> np.ndarray:
    """(n,): the BRDF from `ndf.ellipsoid`, `masking.g1_ellipsoid` and Schlick's F, plus a diffuse term."""
    zenith_i, azimuth_i, zenith_o, azimuth_o = np.radians(degrees).T
    with solver.float64():
        wi, wo = jnp.asarray(direction(zenith_i, azimuth_i)), jnp.asarray(direction(zenith_o, azimuth_o))
        return np.asarray(_brdf(wi, wo, jnp.asarray(A), jnp.asarray(f0), jnp.asarray(diffuse)))


def reflectance(degrees: np.ndarray, A: np.ndarray, noise: float = 0.1, seed: int = 1) -> Reflectance:
    """A measurement of F0 0.6 and an albedo of 0.1, with lognormal noise."""
    values = brdf(degrees, A, 0.6, 0.1) * np.exp(noise * np.random.default_rng(seed).normal(size=len(degrees)))
    zenith_i, azimuth_i, zenith_o, azimuth_o = np.radians(degrees).T
    one, source = np.ones(len(values)), Source("synthetic", "test", "")
    wi, wo = direction(zenith_i, azimuth_i), direction(zenith_o, azimuth_o)
    return Reflectance(wi, wo, values[:, None], one, one > 0, ("brdf",), source)


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


def tensor_file(fields: dict[str, np.ndarray]) -> bytes:
    """An RGL tensor file of these fields."""
    codes = {"u1": 1, "f4": 10, "f8": 11}
    names = {name: name.encode() for name in fields}
    start = 18 + sum(2 + len(name) + 2 + 1 + 8 + 8 * fields[key].ndim for key, name in names.items())
    header, data = [b"tensor_file\0\x01\x00", len(fields).to_bytes(4, "little")], []
    for key, name in names.items():
        array = np.ascontiguousarray(fields[key])
        header += [len(name).to_bytes(2, "little"), name, array.ndim.to_bytes(2, "little")]
        header += [bytes([codes[array.dtype.str[1:]]]), (start + sum(map(len, data))).to_bytes(8, "little")]
        header += [size.to_bytes(8, "little") for size in array.shape]
        data.append(array.tobytes())
    return b"".join(header + data)


def rgl_fields(theta_i=(0.0, 30.0, 60.0, 85.0), grid=9) -> dict[str, np.ndarray]:
    """A matte material, f = (0.1, 0.2, 0.3), measured at micronormals spread by a density that is not even."""
    zeniths = np.radians(theta_i).astype("f4")
    x, y = np.meshgrid(np.linspace(0, 1, 16), np.linspace(0, 1, 12))
    density = (0.3 + x + 0.2 * np.sin(2 * np.pi * y)).astype("f4")
    u, v = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 1, grid), np.linspace(0, 1, grid)))
    at_x, at_y = rgl.invert(density.astype(float), u, v)
    wm = direction(at_x**2 * np.pi / 2, (2 * at_y - 1) * np.pi)
    ndf = np.tile(np.linspace(2, 1, 128), (2, 1)).astype("f4")
    rgb = np.empty((1, len(zeniths), 3, grid, grid), "f4")
    for k, zenith in enumerate(zeniths):
        wi = direction(zenith, 0.0)
        wo_z = 2 * (wm @ wi) * wm[:, 2] - wi[2]
        scale = rgl.bilinear(ndf.astype(float), at_x, at_y) / 4
        rgb[0, k] = ((np.array([[0.1], [0.2], [0.3]]) * wo_z) / scale).reshape(3, grid, grid)
    return {
        "phi_i": np.zeros(1, "f4"), "theta_i": zeniths, "ndf": ndf, "sigma": np.ones((2, 128), "f4"),
        "vndf": np.tile(density, (1, len(zeniths), 1, 1)), "rgb": rgb,
    }  # fmt: skip


def merl(value, sizes=(90, 90, 180)) -> bytes:
    """A MERL binary of one value per colour, or one per colour and node (3, n), [1/sr]."""
    scales = np.array([[1.0], [1.15], [1.66]]) / 1500
    planes = np.broadcast_to(np.asarray(value, float).reshape(3, -1) / scales, (3, int(np.prod(sizes))))
    return np.array(sizes, "<i4").tobytes() + planes.astype("<f8").tobytes()
