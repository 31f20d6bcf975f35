"""Other implementations in the same run: Mitsuba 3 (its LLVM variant) and plain NumPy."""

import functools
import importlib.util
import os
import subprocess
import sys
import warnings
from collections.abc import Callable
from glob import glob

import numpy as np

from ggxref.measure.variants.brdf import BANDS, ETA, K


def mitsuba(points: int, alpha: tuple[float, float] = (0.3, 0.1), seed: int = 0) -> dict[str, Callable[[], object]]:
    """Mitsuba's GGX: sample (direction and density), eval, pdf, and its rough conductor of one index and of three; empty if it cannot run.

    It needs the package `mitsuba` and an LLVM library (Debian: libllvm19), found by itself or by DRJIT_LIBLLVM_PATH.
    """
    return _subjects(*_modules(), points, alpha, np.random.default_rng(seed)) if runs() else {}


def _modules():
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    import drjit as dr

    return mi, dr


@functools.cache
def runs() -> bool:
    """Whether each of Mitsuba's subjects runs: tried in another process, which an LLVM library too old for Dr.Jit aborts."""
    found = sorted(glob("/usr/lib/*/libLLVM-19*.so*"))
    if found:
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", found[0])
    if importlib.util.find_spec("mitsuba") is None:
        return False
    trial = [sys.executable, "-c", "from ggxref.measure.peers import trial; trial()"]
    done = subprocess.run(trial, capture_output=True, check=False, text=True, timeout=300)
    if done.returncode:
        why = next((line for line in done.stderr.splitlines()[::-1] if "rror" in line), f"exit code {done.returncode}")
        warnings.warn(f"Mitsuba is left out, as it does not run here: {why}", stacklevel=2)
    return done.returncode == 0


def trial() -> None:
    """Run each of Mitsuba's subjects once."""
    for call in _subjects(*_modules(), 16, (0.3, 0.1), np.random.default_rng(0)).values():
        call()


def _subjects(mi, dr, points, alpha, rng):
    def directions():
        v = rng.normal(size=(3, points))
        v[2] = np.abs(v[2])
        return mi.Vector3f((v / np.sqrt((v * v).sum(0))).astype(np.float32))

    u, wi, wo = mi.Point2f(rng.random((2, points)).astype(np.float32)), directions(), directions()
    wm = directions()
    ggx = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, *alpha, True)

    def conductor(kind, eta, k):
        optics = {name: {"type": kind, "value": value} for name, value in (("eta", eta), ("k", k))}
        surface = {"type": "roughconductor", "distribution": "ggx", "alpha_u": alpha[0], "alpha_v": alpha[1]}
        return mi.load_dict(surface | optics)

    # Of a "uniform" index Dr.Jit evaluates F once, though the variant has three bands.
    grey, metal = conductor("uniform", ETA, K), conductor("rgb", *map(list, zip(*BANDS, strict=True)))
    at = dr.zeros(mi.SurfaceInteraction3f, points)
    at.wi = wi
    dr.eval(u, wi, wo, wm, at)

    def done(*values) -> object:
        dr.eval(*values)
        dr.sync_thread()

    return {
        "mitsuba sample": lambda: done(*ggx.sample(wi, u)),
        "mitsuba eval": lambda: done(ggx.eval(wm)),
        "mitsuba pdf": lambda: done(ggx.pdf(wi, wm)),
        "mitsuba conductor": lambda: done(grey.eval(mi.BSDFContext(), at, wo)),
        "mitsuba conductor, three bands": lambda: done(metal.eval(mi.BSDFContext(), at, wo)),
    }


def numpy_cap(points: int, alpha: tuple[float, float] = (0.3, 0.1), seed: int = 0) -> dict[str, Callable[[], object]]:
    """dupuy2023 listing 3 in NumPy, an array operation at a time."""
    rng = np.random.default_rng(seed)
    u = rng.random((2, points), dtype=np.float32)
    wi = rng.normal(size=(3, points)).astype(np.float32)
    wi /= np.sqrt((wi * wi).sum(0))
    stretch = np.array([*alpha, 1], np.float32)[:, None]

    def sample():
        i = stretch * wi
        i /= np.sqrt((i * i).sum(0))
        phi, c = np.float32(2 * np.pi) * u[0], (1 - u[1]) * (1 + i[2]) - i[2]
        s = np.sqrt(np.maximum(1 - c * c, 0))
        m = stretch * (np.stack([s * np.cos(phi), s * np.sin(phi), c]) + i)
        return m / np.sqrt((m * m).sum(0))

    return {"NumPy": sample}
