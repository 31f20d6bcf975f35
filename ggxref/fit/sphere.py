"""A lit sphere under the measured BRDF, interpolated, and under the fitted one: what the residuals look like.

The surface is turned about its normal at each point so that the light comes from the azimuth at which it was measured.
"""

import math

import numpy as np
from matplotlib.figure import Figure
from scipy.interpolate import LinearNDInterpolator

from ggxref.fit import figures, parameters
from ggxref.fit.data import Reflectance
from ggxref.fit.fitting import Ladder
from ggxref.fit.models import Surface

SIDE = 256
LIGHT = np.array([-0.5, 0.5, math.sqrt(0.5)])
"""To the light, 45° from the view along z: the highlight is well off the silhouette."""
FEWEST_DIRECTIONS = 3
BRIGHT = 0.99
"""The share of the lit pixels that stay below white."""
NO_DATA = (0.35, 0.45, 0.65)


def unseen(ladder: Ladder) -> str:
    """Why there is no sphere of this measurement, or ""."""
    if not isinstance(ladder.measurement, Reflectance):
        return "no lit sphere: slopes are no reflectance"
    if ladder.problem.shapes is parameters.IN_PLANE:
        return "no lit sphere: all directions lie in one plane, and nearly all of a sphere is seen out of it"
    wi = ladder.measurement.wi[ladder.measurement.mask]
    directions = np.unique(np.round(wi, 6), axis=0)
    azimuths = np.arctan2(*directions[directions[:, 2] < 1 - 1e-9, :2].T[::-1])
    if len(directions) > len(wi) / 16 or len(directions) < FEWEST_DIRECTIONS or np.ptp(azimuths) > 1e-5:
        return (
            f"no lit sphere: {len(directions)} incident directions; need {FEWEST_DIRECTIONS} or more zeniths at one azimuth, "
            "each with many outgoing directions, to interpolate between"
        )
    return ""


def draw(ladder: Ladder) -> Figure:
    """Measured, fitted, and the logarithm of their ratio; `unseen` must be ""."""
    assert isinstance(ladder.measurement, Reflectance)
    inside, wi, wo = geometry(ladder.measurement)
    noise = ladder.problem.samples[4][0]
    measured = interpolated(ladder.measurement, wi, wo, noise)
    half = (wi + wo) / np.linalg.norm(wi + wo, axis=0)
    fitted = figures.model(ladder.best, ladder.problem.surface or Surface(), wi, wo, half)
    shades = [f * wi[2] for f in (measured, fitted)]
    white = np.nanquantile(shades[0], BRIGHT)
    figure = Figure(figsize=(7.0, 2.6), layout="constrained")
    panels = figure.subplots(1, 3)
    for axes, shade, title in zip(
        panels, shades, ("measured (blue: no data)", f"fitted: {ladder.best.model.name}"), strict=False
    ):
        axes.imshow(_picture(inside, shade / white), origin="lower")
        axes.set_title(title, fontsize=8)
    ratio = np.full(inside.shape, np.nan)
    ratio[inside] = np.log10((fitted * wo[2] + noise) / (measured * wo[2] + noise)).mean(axis=0)
    end = max(0.05, float(np.nanquantile(np.abs(ratio), 0.98)))
    image = panels[2].imshow(ratio, origin="lower", cmap="PuOr_r", vmin=-end, vmax=end)
    panels[2].contour(_inside(), levels=[0.5], colors="0.6", linewidths=0.6)
    panels[2].set_title(r"$\log_{10}$ of fitted over measured", fontsize=8)
    bar = figure.colorbar(image, ax=panels[2], shrink=0.8, extend="both")
    bar.ax.tick_params(labelsize=7)
    for axes in panels:
        axes.set_axis_off()
    return figure


def geometry(data: Reflectance) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The lit pixels (side, side), and their local directions to the light and to the eye, (3, n) each."""
    y, x = np.meshgrid(*[np.linspace(-1, 1, SIDE)] * 2, indexing="ij")
    square = 1 - x * x - y * y
    n = np.stack([x, y, np.sqrt(np.maximum(square, 0))])
    lit = (square > 0) & (np.tensordot(LIGHT, n, 1) > 1e-3)
    n = n[:, lit]
    cosine = LIGHT @ n
    along = LIGHT[:, None] - cosine * n
    along /= np.linalg.norm(along, axis=0)
    across = np.cross(n, along, axis=0)
    oblique = data.wi[data.mask][np.argmin(data.wi[data.mask][:, 2])]
    c, s = oblique[:2] / np.hypot(*oblique[:2])
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    wi = np.stack([np.sqrt(1 - cosine**2), np.zeros_like(cosine), cosine])
    wo = np.stack([along[2], across[2], n[2]])
    return lit, turn @ wi, turn @ wo


def interpolated(data: Reflectance, wi: np.ndarray, wo: np.ndarray, noise: float) -> np.ndarray:
    """The measured BRDF (bands, n) at directions (3, n); NaN where none was measured nearby.

    Linear in log(f cosθo + ε), at the same half vector within each measured incident zenith, and then between the two zeniths
    around: a lobe stays at its half vector, and between outgoing directions it would be seen twice.
    """
    half = (wi + wo) / np.linalg.norm(wi + wo, axis=0)
    place, zenith = _disc(half.T), np.arccos(wi[2])
    known = data.wi[data.mask]
    directions, member = np.unique(np.round(known, 6), axis=0, return_inverse=True)
    order = np.argsort(-directions[:, 2])
    nodes = np.arccos(np.clip(directions[order, 2], -1, 1))
    values = np.log(np.maximum(data.values, 0)[data.mask] * data.wo[data.mask][:, 2:] + noise)
    bisector = known + data.wo[data.mask]
    at = _disc(bisector / np.linalg.norm(bisector, axis=1, keepdims=True))
    slices = [LinearNDInterpolator(at[m], values[m])(place) for m in (member.reshape(-1) == k for k in order)]
    low = np.clip(np.searchsorted(nodes, zenith) - 1, 0, len(nodes) - 2)
    share = (zenith - nodes[low]) / (nodes[low + 1] - nodes[low])
    every = np.stack(slices)
    each = np.arange(len(zenith))
    logarithm = every[low, each] * (1 - share[:, None]) + every[low + 1, each] * share[:, None]
    logarithm[(share < 0) | (share > 1)] = np.nan
    return np.maximum((np.exp(logarithm).T - noise) / wo[2], 0)


def _disc(w: np.ndarray) -> np.ndarray:
    """(n, 2): a direction's place on a disc whose radius is the root of the zenith, which spreads a narrow lobe."""
    length = np.hypot(w[:, 0], w[:, 1])
    radius = np.sqrt(np.arctan2(length, w[:, 2]) / (math.pi / 2))
    return (radius / np.where(length > 0, length, 1))[:, None] * w[:, :2]


def _inside() -> np.ndarray:
    """The pixels (side, side) that the sphere covers."""
    y, x = np.meshgrid(*[np.linspace(-1, 1, SIDE)] * 2, indexing="ij")
    return x * x + y * y < 1


def _picture(lit: np.ndarray, shade: np.ndarray) -> np.ndarray:
    """(side, side, 3) for a screen, by a gamma of 2.2: black where unlit, white around the sphere."""
    picture = np.where(_inside(), 0.0, 1.0)[..., None].repeat(3, axis=2)
    colour = np.clip(shade if len(shade) == 3 else shade[:1].repeat(3, axis=0), 0, 1) ** (1 / 2.2)
    picture[lit] = np.where(np.isnan(colour), np.array(NO_DATA)[:, None], colour).T
    return picture
