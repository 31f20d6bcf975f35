"""How do PyPI's Mitsuba and the common textbook forms fare over golden vectors? Writes docs/peers.md.

    python experiments/grade_peers.py docs/peers.md

Each is graded over float32 vectors, about 700 a function (`ggxref vectors --count`, seed 1), as they are, and with those
left out that are outside the domain it claims. Needs the `peers` extra.
"""

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ggxref.files import write_atomically
from ggxref.golden import callables, generate, grade, text
from ggxref.golden.cases import leaves
from ggxref.golden.reading import Test, read
from ggxref.golden.rounding import is_nan
from ggxref.golden.verdict import Verdict

PI = np.float32(np.pi)
# So many that a form of one alpha meets some dozens of isotropic ones.
COUNT = 8000


@dataclass(frozen=True)
class Peer:
    """Functions by the vectors' names; `outside`: flags of inputs that the form does not claim to handle."""

    name: str
    domain: str
    functions: dict[str, Callable[..., Any]]
    outside: set[str] = field(default_factory=set)
    isotropic: bool = False


def cosine_form(wm, alpha):
    """D of one alpha from the cosine alone: alpha^2 / (pi (cos^2 (alpha^2 - 1) + 1)^2)."""
    a = alpha[0] * alpha[0]
    d = wm[2] * wm[2] * (a - 1) + 1
    return a / (PI * d * d) if wm[2] > 0 else np.float32(0)


def tangent_form(wm, alpha):
    """D = alpha^2 / (pi cos^4 (alpha^2 + tan^2)^2)."""
    if wm[2] <= 0:
        return np.float32(0)
    a, c = alpha[0] * alpha[0], wm[2] * wm[2]
    t = a + (1 - c) / c
    return a / (PI * c * c * t * t)


def anisotropic_tangent_form(wm, alpha):
    """D = 1 / (pi ax ay cos^4 (1 + tan^2 (cos^2 phi / ax^2 + sin^2 phi / ay^2))^2), with phi from the normal."""
    if wm[2] <= 0:
        return np.float32(0)
    sine = np.sqrt(np.maximum(0, 1 - wm[2] * wm[2]))
    cos_phi, sin_phi = (wm[0] / sine, wm[1] / sine) if sine > 0 else (np.float32(1), np.float32(0))
    t = (sine / wm[2]) ** 2
    e = t * ((cos_phi / alpha[0]) ** 2 + (sin_phi / alpha[1]) ** 2)
    return 1 / (PI * alpha[0] * alpha[1] * wm[2] ** 4 * (1 + e) ** 2)


def seen(w, wm):
    return np.dot(w, wm) * w[2] > 0


def tangent_g1(w, wm, alpha):
    """G1 = 2 / (1 + sqrt(1 + alpha^2 tan^2))."""
    if not seen(w, wm):
        return np.float32(0)
    c = w[2] * w[2]
    return 2 / (1 + np.sqrt(1 + alpha[0] * alpha[0] * (1 - c) / c))


def schlick_smith_g1(w, wm, alpha):
    """G1 = z / (z (1 - k) + k), k = alpha / 2."""
    k, z = alpha[0] / 2, np.abs(w[2])
    return z / (z * (1 - k) + k) if seen(w, wm) else np.float32(0)


def textbook_lambda(w, alpha):
    """(sqrt(1 + 1/a^2) - 1) / 2."""
    t = ((alpha[0] * w[0]) ** 2 + (alpha[1] * w[1]) ** 2) / w[2] ** 2
    return (np.sqrt(1 + t) - 1) / 2


def textbook_pdf(wm, wi, alpha):
    """G1 max(0, wi.m) D / z_i, of views above the horizon."""
    if wi[2] <= 0:
        return np.float32(0)
    return tangent_g1(wi, wm, alpha) * np.maximum(0, np.dot(wi, wm)) * cosine_form(wm, alpha) / wi[2]


def textbook_dielectric(cos_i, eta):
    """The two amplitudes squared, from Snell's sine."""
    c = np.abs(cos_i)
    sine = eta * eta * (1 - c * c)
    if sine >= 1:
        return np.float32(1)
    t = np.sqrt(1 - sine)
    s, p = (eta * c - t) / (eta * c + t), (c - eta * t) / (c + eta * t)
    return (s * s + p * p) / 2


def mitsuba() -> Peer:
    import mitsuba as mi

    mi.set_variant("scalar_rgb")

    def made(kind: Any, alpha: Any, visible: bool = True) -> Any:
        return mi.MicrofacetDistribution(kind, float(alpha[0]), float(alpha[1]), visible)

    def vector(w: Any) -> Any:
        return mi.Vector3f(*map(float, w))

    fresnel: Any = mi.fresnel
    functions: dict[str, Callable[..., Any]] = {}
    for name, kind in (("ggx", mi.MicrofacetType.GGX), ("beckmann", mi.MicrofacetType.Beckmann)):
        functions |= {
            f"ndf.{name}": lambda wm, alpha, kind=kind: np.float32(made(kind, alpha).eval(vector(wm))),
            f"masking.g1_{name}": lambda w, wm, alpha, kind=kind: np.float32(
                made(kind, alpha).smith_g1(vector(w), vector(wm))
            ),
            f"sampling.normals.pdf_{name}": lambda wm, alpha, kind=kind: np.float32(
                made(kind, alpha, False).pdf(mi.Vector3f(0, 0, 1), vector(wm))
            ),
            f"sampling.slope_{name}.pdf": lambda wm, wi, alpha, kind=kind: np.float32(
                made(kind, alpha).pdf(vector(wi), vector(wm))
            ),
        }
    functions["fresnel.dielectric"] = lambda cos_i, eta: np.float32(fresnel(abs(float(cos_i)), 1 / float(eta))[0])
    return Peer(
        f"Mitsuba {mi.__version__}, MicrofacetDistribution",
        "unit directions, the view above the horizon; alpha clamped to at least 1e-4",
        functions,
        {"Backfacing", "ExactHorizon", "NonUnit", "InvalidAlpha", "NotANumber"},
    )


def textbook() -> list[Peer]:
    outside = {"NonUnit", "InvalidAlpha", "NotANumber", "ExactHorizon"}
    one, both = "one alpha, unit directions, nothing on the horizon", "unit directions, nothing on the horizon"
    return [
        Peer("D from the cosine", one, {"ndf.ggx": cosine_form}, outside, True),
        Peer("D from the tangent", one, {"ndf.ggx": tangent_form}, outside, True),
        Peer("anisotropic D from tangent and azimuth", both, {"ndf.ggx": anisotropic_tangent_form}, outside),
        Peer("G1 from the tangent", one, {"masking.g1_ggx": tangent_g1}, outside, True),
        Peer("Schlick–Smith G1", one + "; an approximation", {"masking.g1_ggx": schlick_smith_g1}, outside, True),
        Peer("Λ = (√(1 + a⁻²) − 1)/2", both, {"masking.lambda_ggx": textbook_lambda}, outside),
        Peer(
            "VNDF pdf = G1 ⟨ωi·m⟩ D / z",
            one + ", the view above the horizon",
            {"sampling.spherical_cap.pdf": textbook_pdf},
            outside | {"Backfacing"},
            True,
        ),
        Peer("Fresnel from Snell's sine", "all", {"fresnel.dielectric": textbook_dielectric}, {"NotANumber"}),
    ]


def claimed(peer: Peer, test: Test) -> bool:
    alpha = test.inputs.get("alpha")
    one_alpha = alpha is None or alpha[0] == alpha[1]
    return not peer.outside & set(test.flags) and (one_alpha or not peer.isotropic)


def answers_of(peer: Peer, tests: list[Test]) -> grade.Grade:
    answers: text.Answers = {}
    for function, fmt, group in text.groups(tests):
        f = peer.functions[function.id]
        for t in group:
            inputs = {a: callables.numbers(x, fmt) for a, x in t.inputs.items()}
            answers[function.id, fmt.name, t.id] = callables.guarded(f, inputs, fmt)
    return grade.collect(tests, answers, strict=False)


def nans(verdicts: list[Verdict]) -> int:
    return sum(v.got is not None and any(is_nan(b, v.test.fmt) for b in leaves(v.got)) for v in verdicts)


def ulps(verdicts: list[Verdict]) -> str:
    errors = [v.error for v in verdicts if v.error is not None]
    return f"{float(max(errors)):.2g}" if errors else "–"


def section(peer: Peer, everything: list[Test]) -> str:
    """A peer's table: functions, within its domain and outside; then the flags that fail within it."""
    tests = [t for t in everything if t.function.id in peer.functions]
    inside = answers_of(peer, [t for t in tests if claimed(peer, t)])
    whole = answers_of(peer, tests)
    diagnoses = {d.function: d.mutant.name for d in inside.diagnoses}
    lines = [
        f"## {peer.name}",
        "",
        f"Claims: {peer.domain}.",
        "",
        "| function | passed in its domain | of | worst ulp | NaN | looks like | passed of all |",
        "|---|--:|--:|--:|--:|---|--:|",
    ]
    of_all = whole.by(lambda v: v.test.function.id)
    for function, verdicts in inside.by(lambda v: v.test.function.id).items():
        passed, rest = sum(v.passed for v in verdicts), of_all[function]
        share = f"{sum(v.passed for v in rest)} of {len(rest)}"
        cells = function, passed, len(verdicts), ulps(verdicts), nans(verdicts), diagnoses.get(function, ""), share
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join([*lines, "", *failing_flags(inside)])


def failing_flags(inside: grade.Grade) -> list[str]:
    """Function × flag, where something fails in the domain."""
    rows = []
    for function, verdicts in inside.by(lambda v: v.test.function.id).items():
        for flag in sorted({flag for v in verdicts for flag in v.test.flags}):
            of = [v for v in verdicts if flag in v.test.flags]
            failed = [v for v in of if not v.passed]
            if failed:
                rows.append(f"| {function} | {flag} | {len(failed)} of {len(of)} | {ulps(failed)} | {nans(failed)} |")
    return ["| function | flag | failed | worst ulp | NaN |", "|---|---|--:|--:|--:|", *rows, ""] if rows else []


INTRODUCTION = """# Peers, graded

PyPI's Mitsuba and the forms that stand in textbooks and shaders, over 8000 float32 vectors (`ggxref vectors --dtypes f32 --seed 1`
of these functions). Written by `python experiments/grade_peers.py docs/peers.md`; do not edit.

A test is passed if the error is within what a careful implementation in float32 can keep for that input (`ulp` of the
vectors). "In its domain" leaves out inputs that the form does not claim to handle; the last column counts them all.
"Looks like" names the mistake whose results the failures are, if one explains at least half of them.
"""


def main() -> None:
    peers = [mitsuba(), *textbook()]
    wanted = {name for peer in peers for name in peer.functions}
    with tempfile.TemporaryDirectory() as scratch:
        generate.generate(generate.order(",".join(sorted(wanted)), "f32", COUNT, 1), Path(scratch), jobs=2)
        tests = list(read(Path(scratch)))
    page = "\n".join([INTRODUCTION, *(section(peer, tests) for peer in peers)])
    write_atomically(Path(sys.argv[1]), page.rstrip() + "\n")


if __name__ == "__main__":
    main()
