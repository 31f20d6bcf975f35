"""Properties: the oracle has every public name, with the arguments that vectors use; every result is an enclosure."""

import inspect
import random
import zlib

import pytest
from flint import arb

from ggxref.oracle.precision import evaluate, lookup

# design.md's table, but for sampling.table.
NAMES = {
    "geometry": "reflect(w, wm) refract(w, wm, eta) half_reflection(wi, wo) half_refraction(wi, wo, n_i, n_o) basis(w)",
    "jacobian": "reflection(wo, wm) refraction(wi, wo, wm, n_i, n_o) slope(wm) linear(wm, M)",
    "ellipsoid": "shape_matrix(alpha, angles) canonical(A) from_slopes(mean, scatter) to_slopes(A) sggx(A) size(A) "
    "gaussian_curvature(wm, A, size) projected_area(w, A, size) lune_area(u, v, A, size) mean_normal(A)",
    "slopes": "from_normal(wm) to_normal(slope) stretch(w, factors) ggx(slope, alpha) beckmann(slope, alpha) "
    "student_t(slope, alpha, gamma) ellipsoid(slope, A) visible_ggx(slope, wi, alpha) visible_beckmann(slope, wi, alpha)",
    "ndf": "hemisphere(wm) ggx(wm, alpha) beckmann(wm, alpha) student_t(wm, alpha, gamma) ellipsoid(wm, A)",
    "masking": "lambda_ggx(w, alpha) lambda_beckmann(w, alpha) g1_ggx(w, wm, alpha) g1_beckmann(w, wm, alpha) "
    "g1_v_cavity(w, wm) g1_ellipsoid(w, wm, A) g2_separable(g1_i, g1_o) g2_height_correlated(g1_i, g1_o) "
    "g2_v_cavity(wi, wo, wm)",
    "fresnel": "dielectric(cos_i, eta) conductor(cos_i, eta, k) schlick(cos_i, f0)",
    "bsdf": "brdf(wi, wo, D, G2, F) brdf_ggx(wi, wo, alpha) btdf(wi, wo, n_i, n_o, D, G2, F) weight_normals(wi, wm, G2) weight_visible(g1_i, g2, F)",
    "sampling.normals": "sample_ggx(u, alpha) sample_beckmann(u, alpha) pdf_ggx(wm, alpha) pdf_beckmann(wm, alpha)",
    "sampling.slope_ggx": "sample(u, wi, alpha) pdf(wm, wi, alpha)",
    "sampling.slope_beckmann": "sample(u, wi, alpha) pdf(wm, wi, alpha)",
    "sampling.v_cavity": "sample(u, wi, alpha) pdf(wm, wi, alpha)",
    "sampling.cross_section": "sample(u, wi, alpha) pdf(wm, wi, alpha)",
    "sampling.spherical_cap": "sample(u, wi, alpha) pdf(wm, wi, alpha) cap_pdf(wo, wi)",
    "sampling.bounded_cap": "sample(u, wi, alpha) pdf(wm, wi, alpha) bound(wi, alpha)",
    "sampling.lune": "sample(u, wi, A) pdf(wm, wi, A) sample_rejection_sphere(u, wi, A) "
    "sample_rejection_ellipsoid(u, wi, A)",
    "sampling.ellipsoid_cap": "sample(u, wi, A) pdf(wm, wi, A)",
    "sampling.ellipsoid_bounded": "sample(u, wi, A) pdf(wm, wi, A) bound(wi, A)",
}
SIGNATURES = {
    f"{module}.{head}": arguments.split(", ")
    for module, line in NAMES.items()
    for head, arguments in (entry.split("(") for entry in line[:-1].split(") "))
}
names = pytest.mark.parametrize("name", SIGNATURES)


def inputs(name, seed):
    """Random arguments of `name` in its domain, the micronormal above the horizon and facing wi."""
    draw = random.Random(zlib.crc32(name.encode()) + seed)

    def direction():
        return draw.uniform(-1, 1), draw.uniform(-1, 1), draw.uniform(0.1, 1)

    def matrix():
        return tuple(
            tuple((i == j) * draw.uniform(0.3, 2) + draw.uniform(-0.1, 0.1) for j in range(3)) for i in range(3)
        )

    def numbers(n, low=0.0, high=1.0):
        return tuple(draw.uniform(low, high) for _ in range(n))

    wi = direction()
    values = {
        **dict.fromkeys(("w", "wi", "v"), wi),
        "wo": direction(),
        "wm": (wi[0] / 4, wi[1] / 4, wi[2] + draw.random()),
        **dict.fromkeys(("A", "M"), matrix()),
        "alpha": numbers(2, 0.05, 1.5),
        "angles": numbers(3, -0.5, 0.5),
        **dict.fromkeys(("slope", "mean"), numbers(2, -1, 0.2)),
        "scatter": ((0.5, 0.1), (0.1, 0.3)),
        "factors": numbers(2, 0.1, 2),
        "gamma": draw.uniform(1.5, 4),
        "u": [numbers(2) for _ in range(32)] if "rejection" in name else numbers(3 if "v_cavity" in name else 2),
        **{key: draw.random() for key in ("size", "cos_i", "f0", "g1_i", "g1_o", "g2", "G2", "F", "D", "k", "n_i")},
        **{key: draw.uniform(1.1, 1.9) for key in ("n_o",)},
        "eta": draw.uniform(0.4, 0.9),
    }
    if name == "ellipsoid.lune_area":
        values["u"] = direction()
    return {key: values[key] for key in SIGNATURES[name]}


def balls(x):
    return [x] if isinstance(x, arb) else [ball for part in x for ball in balls(part)]


@names
def test_the_name_is_there_with_its_arguments(name):
    parameters = inspect.signature(lookup(name)).parameters.values()
    assert [p.name for p in parameters if p.kind is p.POSITIONAL_OR_KEYWORD] == SIGNATURES[name]


def test_the_table_is_read_whole():
    assert len(SIGNATURES) == sum(line.count("(") for line in NAMES.values())


@names
def test_a_low_precision_encloses_a_high_one(name):
    for seed in range(4):
        arguments = inputs(name, seed)
        low, high = (balls(evaluate(name, arguments, bits)) for bits in (64, 1000))
        assert len(low) == len(high)
        for wide, narrow in zip(low, high, strict=True):
            assert wide.contains(narrow)
            # The rest of the test would hold for balls of any width.
            assert (
                wide.rad() <= (abs(narrow) + 1) * arb(2) ** -40 and narrow.rad() <= (abs(narrow) + 1) * arb(2) ** -900
            )


def test_a_midpoint_is_no_enclosure():
    """The check above sees a result whose error is left out."""
    arguments = inputs("ndf.ellipsoid", 0)
    low, high = (evaluate("ndf.ellipsoid", arguments, bits) for bits in (64, 1000))
    assert low.contains(high) and not low.mid().contains(high)
