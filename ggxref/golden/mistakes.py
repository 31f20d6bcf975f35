"""Mistakes that people make. Of two that explain the answers alike, the first is named."""

from typing import Any

from flint import arb, fmpq

from ggxref.golden import linear
from ggxref.golden.linear import determinant, minus, transposed
from ggxref.golden.mutants import (
    Answer,
    Mutant,
    formula,
    geometric_mean,
    height,
    instead,
    inverse,
    of,
    on,
    raised,
    signs,
    then,
    third_column,
    times,
    times_height,
    together,
    zero_below,
)
from ggxref.golden.stream import root
from ggxref.oracle.linalg import dot

DENSITIES = "ndf. pdf slopes.ggx slopes.beckmann slopes.student slopes.ellipsoid slopes.visible"
ONE = fmpq(1)


def _front(w: Any, wm: Any) -> bool:
    return dot(w, wm) * w[2] > 0


def _smith_schlick(k: Any) -> Answer:
    """G1 = z / (z (1 - k) + k) with k of the mean alpha."""

    def g1(w: Any, wm: Any, alpha: Any) -> Any:
        z, share = abs(height(w)), k((alpha[0] + alpha[1]) / 2)
        return z / (z * (1 - share) + share) if _front(w, wm) else arb(0)

    return formula("masking.g1_ggx masking.g1_beckmann", g1)


def _rational(w: Any, wm: Any, alpha: Any) -> Any:
    """Walter et al. 2007's fit of Beckmann's G1, good to 0.35 %."""
    stretched = ((alpha[0] * w[0]) ** 2 + (alpha[1] * w[1]) ** 2).sqrt()
    if not _front(w, wm):
        return arb(0)
    if not abs(w[2]) * 5 < stretched * 8:
        return arb(1)
    a = abs(w[2]) / stretched
    return (a * 3535 / 1000 + a * a * 2181 / 1000) / (1 + a * 2276 / 1000 + a * a * 2577 / 1000)


def _polarised(parallel: bool) -> Answer:
    def f(cos_i: Any, eta: Any) -> Any:
        c, square = abs(cos_i), 1 - eta * eta * (1 - cos_i * cos_i)
        if not square > 0:
            return arb(1)
        t = square.sqrt()
        r = (c - eta * t) / (c + eta * t) if parallel else (eta * c - t) / (eta * c + t)
        return r * r

    return formula("fresnel.dielectric", f)


def _schlick(cos_i: Any, eta: Any) -> Any:
    f0 = ((eta - 1) / (eta + 1)) ** 2
    return f0 + (1 - f0) * (1 - abs(cos_i)) ** 5


def _square_only(wm: Any, alpha: Any) -> Any:
    x, y, z = wm
    q = ((x / alpha[0]) ** 2 + (y / alpha[1]) ** 2 + z * z) / (x * x + y * y + z * z)
    return 1 / (arb.pi() * alpha[0] * alpha[1] * q) if z > 0 else arb(0)


def _per_outgoing(result: Any, function: Any, values: Any) -> Any:
    """The density over the reflected direction."""
    if not {"wi", "wm"} <= values.keys():
        return None
    cosine = linear.dot(values["wi"], values["wm"])
    return result / abs(4 * cosine.numerator) * cosine.denominator if cosine else None


def _signed(result: Any, function: Any, values: Any) -> Any:
    (matrix,) = of(function, "A")
    return -result if determinant(values[matrix]) < 0 else result


def _cut(result: Any, *_: Any) -> Any:
    return result if result > arb(10) ** -20 else arb(0)


_PAIRS = (("ggx", "beckmann"), ("beckmann", "ggx"))
_OTHER = {
    f"{a}{mine}": f"{a}{other}({arguments})"
    for mine, other in _PAIRS
    for a, arguments in (
        ("ndf.", "wm, alpha"),
        ("slopes.", "slope, alpha"),
        ("slopes.visible_", "slope, wi, alpha"),
        ("masking.lambda_", "w, alpha"),
        ("masking.g1_", "w, wm, alpha"),
        ("sampling.normals.sample_", "u, alpha"),
        ("sampling.normals.pdf_", "wm, alpha"),
    )
}
for _mine, _other in _PAIRS:
    for _end, _arguments in (("sample", "u, wi, alpha"), ("pdf", "wm, wi, alpha")):
        _OTHER[f"sampling.slope_{_mine}.{_end}"] = f"sampling.slope_{_other}.{_end}({_arguments})"
        _OTHER[f"sampling.v_cavity.{_end}.{_mine}"] = f"sampling.v_cavity.{_end}:{_other}({_arguments})"
_SAMPLE, _PDF = "sample(u, wi, alpha)", "pdf(wm, wi, alpha)"
_UNBOUNDED = {f"sampling.bounded_cap.{f.partition('(')[0]}": f"sampling.spherical_cap.{f}" for f in (_SAMPLE, _PDF)}
_BOUNDED = {
    f"sampling.{m}.pdf": f"sampling.bounded_cap.{_PDF}" for m in ("spherical_cap", "cross_section", "slope_ggx")
}
_ALL_NORMALS = {
    **{
        f"sampling.{m}.pdf": "sampling.normals.pdf_ggx(wm, alpha)"
        for m in ("spherical_cap", "cross_section", "slope_ggx")
    },
    "sampling.slope_beckmann.pdf": "sampling.normals.pdf_beckmann(wm, alpha)",
    **{f"sampling.v_cavity.pdf.{d}": f"sampling.normals.pdf_{d}(wm, alpha)" for d in ("ggx", "beckmann")},
}
_MAPS = {
    "sampling.spherical_cap.sample": f"sampling.cross_section.{_SAMPLE}",
    "sampling.bounded_cap.sample": f"sampling.cross_section.{_SAMPLE}",
    "sampling.cross_section.sample": f"sampling.spherical_cap.{_SAMPLE}",
    "sampling.slope_ggx.sample": f"sampling.spherical_cap.{_SAMPLE}",
    "sampling.lune.sample": "sampling.ellipsoid_cap.sample(u, wi, A)",
    "sampling.ellipsoid_cap.sample": "sampling.lune.sample(u, wi, A)",
}
_G2 = {
    "masking.g2_height_correlated": "masking.g2_separable(g1_i, g1_o)",
    "masking.g2_separable": "masking.g2_height_correlated(g1_i, g1_o)",
}


def _alpha(name: str, sentence: str, change: Any) -> Mutant:
    return Mutant(name, sentence, on("alpha", change))


def _clamp(least: fmpq) -> Any:
    return lambda a: (max(a[0], least), max(a[1], least))


def _u(name: str, sentence: str, change: Any) -> Mutant:
    return Mutant(name, sentence, on("u u3", change))


def _factor(name: str, sentence: str, factor: Any, only: str) -> Mutant:
    return Mutant(name, sentence, then(times(factor), only))


MUTANTS: list[Mutant] = [
    _alpha("alpha_squared", "alpha is squared, as if it were a perceptual roughness", lambda a: (a[0] ** 2, a[1] ** 2)),
    _alpha("alpha_root", "the square root of alpha is used", lambda a: (root(a[0]), root(a[1]))),
    _alpha("alpha_mean", "the geometric mean of alpha_x and alpha_y stands for both", geometric_mean),
    _alpha("axes_swapped", "alpha_x and alpha_y are swapped", lambda a: (a[1], a[0])),
    _alpha("alpha_x_for_both", "alpha_x is used for both axes", lambda a: (a[0], a[0])),
    _alpha("alpha_y_for_both", "alpha_y is used for both axes", lambda a: (a[1], a[1])),
    _alpha("alpha_clamped_1e-3", "alpha is clamped at 1e-3 from below", _clamp(fmpq(1, 1000))),
    _alpha("alpha_clamped_6.4e-3", "alpha is clamped at 6.4e-3 from below", _clamp(fmpq(64, 10000))),
    _alpha("alpha_clamped_1", "alpha is clamped to 1 from above", lambda a: (min(a[0], ONE), min(a[1], ONE))),
    _alpha("alpha_doubled", "alpha is twice too large", lambda a: (2 * a[0], 2 * a[1])),
    Mutant("matrix_transposed", "A is transposed", on("A", transposed)),
    Mutant("matrix_inverted", "A and its inverse are mixed up", on("A", inverse)),
    Mutant(
        "determinant_signed",
        "det A is used without its absolute value",
        then(_signed, "ndf.ellipsoid lune.pdf projected lune_area linear"),
    ),
    Mutant(
        "third_column", "the factor |A n| is missing", then(lambda r, f, v: r * third_column(v["A"]), "ndf.ellipsoid")
    ),
    Mutant("size_ignored", "the ellipsoid's size is taken for 1", on("size", lambda size: ONE)),
    Mutant("tail_cut", "densities below 1e-20 are set to 0", then(_cut, "ndf. pdf")),
    Mutant("view_flipped", "a direction of light or view has the wrong sign", on("wi", minus)),
    Mutant("normal_flipped", "the micronormal has the wrong sign", on("wm", minus)),
    Mutant("below_as_above", "a direction below the horizon is taken for its mirror image above", on("wi", raised)),
    Mutant("normal_below_seen", "a micronormal below the horizon is not cut off", on("wm", raised)),
    Mutant("below_is_zero", "a direction below the horizon always gives 0", then(zero_below("wi"))),
    Mutant(
        "directions_swapped",
        "the two directions are swapped",
        together(lambda v: {"wi": v["wo"], "wo": v["wi"]}, "wi", "wo"),
    ),
    _u("u_swapped", "u[0] and u[1] are swapped", lambda u: (u[1], u[0], *u[2:])),
    _u("reach_reversed", "u[1] is used as 1 - u[1]", lambda u: (u[0], 1 - u[1], *u[2:])),
    _u("azimuth_reversed", "u[0] is used as 1 - u[0]", lambda u: (1 - u[0], *u[1:])),
    _u(
        "azimuth_opposite",
        "the azimuth is off by half a turn",
        lambda u: (u[0] + fmpq(1, 2) - (u[0] >= fmpq(1, 2)), *u[1:]),
    ),
    Mutant("eta_inverted", "the ratio of the indices is upside down", on("eta", lambda eta: 1 / eta)),
    Mutant(
        "indices_swapped",
        "n_i and n_o are swapped",
        together(lambda v: {"n_i": v["n_o"], "n_o": v["n_i"]}, "n_i", "n_o"),
    ),
    Mutant("absorption_ignored", "the imaginary part of the index is ignored", on("k", lambda k: fmpq(0))),
    Mutant("gamma_shifted", "gamma is off by one", on("gamma", lambda gamma: gamma + 1)),
    Mutant("transmission_by_F", "F stands for 1 - F", on("F", lambda F: 1 - F, "btdf")),
    _factor("pi_missing", "pi is missing under the fraction", arb.pi, DENSITIES),
    _factor("pi_extra", "there is one pi too many under the fraction", lambda: 1 / arb.pi(), DENSITIES + " ellipsoid."),
    Mutant(
        "cosine_missing",
        "the cosine of the micronormal is missing",
        then(times_height("wm", -1), "ndf. pdf weight_normals"),
    ),
    Mutant(
        "cosine_extra",
        "there is a cosine of the micronormal too many",
        then(times_height("wm", 1), "ndf. pdf weight_normals"),
    ),
    Mutant(
        "slope_density",
        "the density of slopes stands for that of normals: cos^4 is missing",
        then(times_height("wm", 4), "ndf. pdf"),
    ),
    Mutant(
        "slope_jacobian",
        "cos^3 stands for cos^4: a Jacobian is missing",
        then(times_height("wm", -3), "ndf. jacobian.slope"),
    ),
    Mutant(
        "view_cosine_missing", "the cosine of the direction is not divided by", then(times_height("wi", 1), "bsdf. pdf")
    ),
    Mutant(
        "per_outgoing",
        "the density is that of the reflected direction: a factor 1/(4 |wi.m|) too many",
        then(_per_outgoing, "pdf"),
    ),
    _factor("four_missing", "the factor 4 is missing", lambda: arb(4), "bsdf.brdf jacobian.reflection"),
    _factor("half", "a factor 2 is missing", lambda: arb(1) / 2, "masking. pdf bsdf. area slopes.visible"),
    _factor("twice", "there is a factor 2 too many", lambda: arb(2), "masking. pdf bsdf. area slopes.visible"),
    Mutant("exponent", "the square of the norm stands for its fourth power", formula("ndf.ggx", _square_only)),
    Mutant("negated", "the sign is wrong", then(times(lambda: arb(-1)))),
    Mutant("squared", "the result is squared", then(lambda r, *_: r * r, "masking.g1 fresnel.")),
    Mutant("complement", "1 - x stands for x", then(lambda r, *_: 1 - r, "fresnel. masking.g")),
    Mutant("inverted", "1/x stands for x", then(lambda r, *_: 1 / r, "jacobian.")),
    Mutant("density_clamped", "the density is clamped to 1", then(lambda r, *_: r.min(arb(1)), "ndf. pdf")),
    Mutant("x_mirrored", "x has the wrong sign", then(signs(-1, 1, 1))),
    Mutant("y_mirrored", "y has the wrong sign", then(signs(1, -1, 1))),
    Mutant("z_mirrored", "z has the wrong sign", then(signs(1, 1, -1))),
    Mutant("other_distribution", "the formula is that of the other distribution (GGX, Beckmann)", instead(_OTHER)),
    Mutant("other_g2", "separable and height-correlated G2 are mixed up", instead(_G2)),
    Mutant("unbounded", "the cap is not bounded", instead(_UNBOUNDED)),
    Mutant("bounded", "the density is that of the bounded cap", instead(_BOUNDED)),
    Mutant("all_normals", "the density is D cos, of all normals, not of the visible ones", instead(_ALL_NORMALS)),
    Mutant("other_map", "the law is right and the map from u another: check it by statistics", instead(_MAPS)),
    Mutant("smith_schlick_half", "G1 is Schlick's with k = alpha/2", _smith_schlick(lambda a: a / 2)),
    Mutant(
        "smith_schlick_eighth", "G1 is Schlick's with k = (alpha + 1)^2 / 8", _smith_schlick(lambda a: (a + 1) ** 2 / 8)
    ),
    Mutant(
        "beckmann_rational",
        "Beckmann's G1 is the rational fit, not the function",
        formula("masking.g1_beckmann", _rational),
    ),
    Mutant("parallel_only", "only the parallel polarisation counts", _polarised(True)),
    Mutant("perpendicular_only", "only the perpendicular polarisation counts", _polarised(False)),
    Mutant(
        "schlick_for_fresnel",
        "Schlick's approximation stands for Fresnel's equations",
        formula("fresnel.dielectric", _schlick),
    ),
]
