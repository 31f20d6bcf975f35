"""What each chart shows, as rows of a table: work cut into named pieces, so that an interrupted run goes on where it was."""

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from importlib import import_module

import numpy as np

from ggxref.measure import maps, peers, speed, variance
from ggxref.measure.accuracy import measure
from ggxref.measure.reference import REFERENCES
from ggxref.measure.regions import REGIONS
from ggxref.measure.variants import QUANTITIES

Rows = list[dict]
Pieces = dict[str, Callable[[], Rows]]

# Arguments whose names do not say which points they take.
DRAWS = {"ellipsoid.lune_area": ("w", "v", "A", "size")}


def library(name: str) -> Callable:
    """The library's function of a dotted name below `ggxref`."""
    module, _, attribute = name.rpartition(".")
    return getattr(import_module(f"ggxref.{module}"), attribute)


def _accuracy(name, dtype, count) -> Rows:
    options = {"dtype": dtype, "count": count, "draws": DRAWS.get(name), "rounds": 2 if "16" in dtype else 6}
    graded = (measure(name, "ggxref", library(name), REFERENCES[name], region=r, **options) for r in REGIONS)
    return [asdict(a) for a in graded]


def accuracy(points: int) -> Pieces:
    """Every public function with a reference, in every dtype: `points` a region in float32, a 16th in the others."""
    return {
        f"{name}-{dtype}": partial(_accuracy, name, dtype, points if dtype == "f32" else max(points // 16, 1 << 10))
        for dtype in ("f32", "f64", "f16", "bf16")
        for name in REFERENCES
    }


def _speed(size) -> Rows:
    forms = {
        f"{sampler} {v.name}": v.function for sampler in ("cap", "cross_section") for v in QUANTITIES[sampler].variants
    }
    forms["bounded cap"] = library("sampling.bounded_cap.sample")
    others = peers.mitsuba(size) | peers.numpy_cap(size)
    others = {name: call for name, call in others.items() if name in ("mitsuba sample", "NumPy")}
    return [asdict(t) for t in speed.throughput(forms, size, peers=others, seconds=4)]


def sampling_speed(points: int) -> Pieces:
    """Samplers, a peer and a copy at sizes from a small call up to `points`."""
    return {f"{size}": partial(_speed, size) for size in (1 << k for k in range(8, 25, 2)) if size <= points * 16}


# Units in the last place of each dtype in those of float32, so that one axis holds them all.
_SCALE = {"f64": 2.0**-29, "f32": 1.0, "f16": 2.0**13, "bf16": 2.0**16}


def _pareto(name, points) -> Rows:
    q = QUANTITIES[name]
    forms = {v.name: (v.function, "f32") for v in q.variants}
    forms |= {f"{q.variants[0].name}, {dtype}": (q.variants[0].function, dtype) for dtype in ("f64", "f16", "bf16")}
    times = _interleaved({form: (f, d) for form, (f, d) in forms.items()}, q.isotropic)
    rows = []
    for form, (function, dtype) in forms.items():
        graded = [
            measure(
                name, form, function, q.reference, dtype=dtype, region=r, count=points, rounds=2, isotropic=q.isotropic
            )
            for r in REGIONS
        ]
        rows.append(
            {
                "quantity": name,
                "variant": form,
                "dtype": dtype,
                "source": next((v.source for v in q.variants if v.name == form), q.variants[0].source),
                "approximate": any(v.approximate for v in q.variants if v.name == form),
                "worst": max(a.worst for a in graded) * _SCALE[dtype],
                "p999": max(a.p999 for a in graded) * _SCALE[dtype],
                "typical": graded[0].p999 * _SCALE[dtype],
                "faults": sum(a.nan + a.inf + a.wrong_zero + a.wrong_sign for a in graded),
                "ns": times[form].median,
                "ns_lower": times[form].lower,
                "ns_upper": times[form].upper,
                "compilation": times[form].compilation,
                "memory": times[form].memory,
            }
        )
    return rows


def _interleaved(forms, isotropic):
    size, subjects = 1 << 16, {}
    for form, (function, dtype) in forms.items():
        args = speed.inputs(speed.arguments(function), size, dtype, isotropic=isotropic)
        subjects[form] = speed.subject(function, args, dtype)
    return {t.subject: t for t in speed.interleaved(subjects, size, seconds=2)}


def pareto(points: int) -> Pieces:
    """Every variant of every quantity, and the library's form in the other dtypes: time against error."""
    return {name: partial(_pareto, name, max(points // 16, 1 << 10)) for name in QUANTITIES}


MAPS = {"alpha-theta": (maps.ALPHA, maps.THETA), "alpha-ratio": (maps.ALPHA, maps.RATIO)}
STABLE = ("ndf", "lambda", "pdf", "cap", "cross_section")


def _cells(values: dict[str, np.ndarray], first: maps.Axis, second: maps.Axis, **labels) -> Rows:
    return [
        labels | {"first": float(a), "second": float(b)} | {key: float(v[i, j]) for key, v in values.items()}
        for i, a in enumerate(first.values)
        for j, b in enumerate(second.values)
    ]


def _stability(name, plane) -> Rows:
    q, (first, second) = QUANTITIES[name], MAPS[plane]
    forms = [v for v in q.variants if not v.approximate and v.name not in ("cos²", "cross product")]
    rows = []
    if plane == "alpha-theta" and name == "ndf":
        forms = [v for v in q.variants if not v.approximate]
    for v in forms:
        digits, fault = maps.digits_lost(v.function, q.reference, first, second)
        rows += _cells({"digits": digits, "fault": fault}, first, second, quantity=name, variant=v.name, plane=plane)
    return rows


def _skewed(name) -> Rows:
    digits, fault = maps.digits_lost(library(name), REFERENCES[name], maps.SKEW, maps.THETA)
    labels = {"quantity": name, "variant": "ggxref", "plane": "skew-theta"}
    return _cells({"digits": digits, "fault": fault}, maps.SKEW, maps.THETA, **labels)


SKEWED = ("ndf.ellipsoid", "masking.g1_ellipsoid", "sampling.ellipsoid_cap.pdf", "sampling.ellipsoid_cap.sample")


def stability(points: int) -> Pieces:
    """Digits lost over α × θ, α × anisotropy, and skew × θ."""
    pieces = {f"{name}-alpha-theta": partial(_stability, name, "alpha-theta") for name in STABLE}
    pieces |= {f"{name}-alpha-ratio": partial(_stability, name, "alpha-ratio") for name in STABLE[:3]}
    return pieces | {name: partial(_skewed, name) for name in SKEWED}


ALPHAS = np.geomspace(0.01, 2, 12)
THETAS = np.array([1.0, 15, 30, 45, 60, 70, 80, 85, 88, 89, 89.9])


def _variance(name) -> Rows:
    mean, variances = variance.variances(name, ALPHAS, THETAS)
    values = {"mean": mean, "variance": variances}
    return _cells(values, maps.Axis("α", ALPHAS), maps.Axis("θ [°]", THETAS), sampler=name)


def _times() -> Rows:
    return [{"sampler": name, "ns": ns} for name, ns in variance.times().items()]


def efficiency(points: int) -> Pieces:
    """Variance of the albedo's estimate by every sampler, and the time of a sample."""
    return {name: partial(_variance, name) for name in variance.SAMPLERS} | {"times": _times}


GRADED = ("ndf", "g2", "pdf", "cap", "cross_section")


def _gradient(name) -> Rows:
    q = QUANTITIES[name]
    rows = []
    for v in [v for v in q.variants if not v.approximate and v.name not in ("cos²", "cross product")][:3]:
        digits, fault = maps.gradient_error(v.function, q.reference, maps.ALPHA, maps.THETA)
        labels = {"quantity": name, "variant": v.name}
        rows += _cells({"error": digits, "fault": fault}, maps.ALPHA, maps.THETA, **labels)
    return rows


def gradient(points: int) -> Pieces:
    """Relative error of ∂/∂α over α × θ, and where it is not finite."""
    return {name: partial(_gradient, name) for name in GRADED}


KINDS: dict[str, Callable[[int], Pieces]] = {
    "accuracy": accuracy,
    "speed": sampling_speed,
    "pareto": pareto,
    "stability": stability,
    "variance": efficiency,
    "gradient": gradient,
}


def timed(kind: str, name: str) -> bool:
    """Whether a piece measures time, and so must run alone."""
    return kind in ("speed", "pareto") or name == "times"
