"""Properties of the samplers: the map from u to normals has the Jacobian 1/pdf, whatever the method; edges and limits."""

from fractions import Fraction
from itertools import pairwise

import pytest
from flint import arb
from oracle_points import ALPHA, BITS, DIAGONAL, DIRECTIONS, MIRRORED, SKEWED, STEP, alike, same, solid_angle

from ggxref.oracle import ellipsoid, geometry
from ggxref.oracle.linalg import N, add, dot, negative, norm, normalise, scale
from ggxref.oracle.precision import decimal, digits, evaluate, exact, lookup, working
from ggxref.oracle.sampling import (
    bounded_cap,
    cross_section,
    ellipsoid_bounded,
    ellipsoid_cap,
    lune,
    normals,
    slope_beckmann,
    slope_ggx,
    sphere,
    spherical_cap,
    v_cavity,
)

GGX = {"spherical_cap": spherical_cap, "cross_section": cross_section, "slope_ggx": slope_ggx}
ALPHAS = {**GGX, "bounded_cap": bounded_cap, "slope_beckmann": slope_beckmann}
SHAPES = {"lune": lune, "ellipsoid_cap": ellipsoid_cap, "ellipsoid_bounded": ellipsoid_bounded}
METHODS = [(module, ALPHA) for module in ALPHAS.values()]
METHODS += [(module, A) for module in SHAPES.values() for A in (SKEWED, MIRRORED)]

POINTS = [exact((0.3125, 0.625)), exact((0.875, 0.0625))]  # off the diagonals, where the concentric map has a crease

methods = pytest.mark.parametrize(
    ("module", "shape"),
    METHODS,
    ids=[f"{module.__name__.rpartition('.')[2]}-{k % 2}" for k, (module, _) in enumerate(METHODS)],
)
directions = pytest.mark.parametrize("wi", DIRECTIONS.values(), ids=DIRECTIONS)


@pytest.fixture(autouse=True)
def precision():
    with working(BITS):
        yield


@methods
@directions
@pytest.mark.parametrize("u", POINTS)
def test_the_density_is_one_over_the_jacobian_of_the_map(module, shape, wi, u):
    m = module.sample(u, wi, shape)
    assert same(norm(m), 1) and m[2] > 0 and dot(wi, m) > 0
    assert same(solid_angle(lambda u: module.sample(u, wi, shape), u) * module.pdf(m, wi, shape), 1)


@pytest.mark.parametrize("name", ["ggx", "beckmann"])
@pytest.mark.parametrize("u", POINTS)
def test_the_density_of_normals_is_one_over_the_jacobian_of_the_map(name, u):
    sample, pdf = getattr(normals, f"sample_{name}"), getattr(normals, f"pdf_{name}")
    assert same(solid_angle(lambda u: sample(u, ALPHA), u) * pdf(sample(u, ALPHA), ALPHA), 1)


@pytest.mark.parametrize("u", POINTS)
def test_misprints_and_slips_have_another_density(u):
    """dupuy2023 listing 1, line 8 unwarps wi, not the normal: one normal for every u. A cap from +z_i is a likely slip."""
    wi, B = DIRECTIONS["plain"], sphere.stretch(ALPHA)
    i = sphere.incident(wi, B)

    def printed(u):
        return sphere.micronormal(scale(1 + 0 * u[0], i), B)

    def wrong_end(u):
        return sphere.half_in_cap(u, wi, i[2], B)

    for sample in (printed, wrong_end):
        assert not same(solid_angle(sample, u) * spherical_cap.pdf(sample(u), wi, ALPHA), 1, 2)


@directions
def test_one_density_by_every_route(wi):
    """dupuy2023 (1), heitz2014 (5), walter2014 (33) and the canonical form."""
    for m in (exact((0.125, -0.25, 1)), exact((-0.5, 0.0625, 0.25)), exact((-0.75, 0.25, 0.125))):
        value = spherical_cap.pdf(m, wi, ALPHA)
        for other in (cross_section, slope_ggx):
            assert same(other.pdf(m, wi, ALPHA), value)
        for other in (lune, ellipsoid_cap):
            assert same(other.pdf(m, wi, DIAGONAL), value)
        assert same(lune.pdf(m, wi, SKEWED), ellipsoid_cap.pdf(m, wi, SKEWED))


@methods
def test_hidden_normals_have_no_density(module, shape):
    wi = exact((1, 0, 0.5))
    for m in (exact((-1, 0, 0.25)), exact((0.5, 0, -1)), exact((1, 0, 0)), exact((-1, 0, 2)), negative(wi)):
        assert module.pdf(m, wi, shape) == 0


@methods
def test_straight_below_is_refused(module, shape):
    with pytest.raises(ValueError, match="straight below"):
        module.sample(POINTS[0], exact((0, 0, -2)), shape)


@directions
def test_in_canonical_form_the_ellipsoid_cap_is_the_spherical_cap(wi):
    assert alike(ellipsoid_cap.sample(POINTS[0], wi, DIAGONAL), spherical_cap.sample(POINTS[0], wi, ALPHA))


def test_the_cap_density():
    wi, wo = exact((0.5, 0, 0.5)), exact((0, 0.5, -0.25))
    assert same(spherical_cap.cap_pdf(wo, wi), 1 / (2 * arb.pi() * (1 + normalise(wi)[2])))
    assert spherical_cap.cap_pdf(exact((0, 3, -3)), wi) == 0  # exactly on the edge, at another length
    assert spherical_cap.cap_pdf(exact((0, 3, -2.999)), wi) > 0


# --- v-cavities


@pytest.mark.parametrize("distribution", ["ggx", "beckmann"])
@pytest.mark.parametrize("wi", [DIRECTIONS[key] for key in ("plain", "normal", "grazing")])
def test_v_cavities_keep_each_wall_for_its_share_of_u2(wi, distribution):
    """At fixed u[0], u[1] the two walls m, m' take shares of u[2] that make the density 2 share z D."""
    u = POINTS[0]

    def wall(u2):
        return v_cavity.sample((*u, u2), wi, ALPHA, distribution=distribution)

    low, high = arb(0), arb(1)  # u[2] at which the other wall gives way to m
    m, other = wall(1 - STEP), wall(arb(0))
    if same(other[0], m[0]):
        share = arb(1)
    else:
        for _ in range(80):
            middle = (low + high) / 2
            low, high = (middle, high) if same(wall(middle)[0], other[0]) else (low, middle)
        share = 1 - low
    density = getattr(normals, f"pdf_{distribution}")(m, ALPHA)
    assert same(v_cavity.pdf(m, wi, ALPHA, distribution=distribution), 2 * share * density, 20)


def test_v_cavities_are_seen_from_above():
    with pytest.raises(ValueError, match="above the horizon"):
        v_cavity.sample(exact((0.5, 0.5, 0.5)), DIRECTIONS["below"], ALPHA)
    assert v_cavity.pdf(exact((0.5, 0.25, 1)), exact((1, 0, 0)), ALPHA) == 0


# --- slopes


def test_slope_samplers_tend_to_their_limits():
    """u = 0 is the infinite slope: the value there is what a tiny u comes close to."""
    wi, tiny = DIRECTIONS["plain"], arb(2) ** -900
    with working(2500):
        for u, near in (((0, 0.25), (tiny, 0.25)), ((0.25, 0), (0.25, tiny)), ((0, 0), (tiny, tiny))):
            limit = slope_ggx.sample(exact(u), wi, ALPHA)
            assert alike(slope_ggx.sample(exact(near), wi, ALPHA), limit, 80)
            assert limit[2] == 0
        assert alike(slope_ggx.sample(exact((0.75, 0)), wi, ALPHA), slope_ggx.sample(exact((0, 0)), wi, ALPHA))
    for u in ((0, 0.25), (0.25, 0)):
        limit = slope_beckmann.sample(exact(u), wi, ALPHA)
        near = slope_beckmann.sample(tuple(arb(2) ** -400 if x == 0 else exact(x) for x in u), wi, ALPHA)
        # A Gaussian slope grows as sqrt(-log u): here 16, so that the normal is still 0.1 from the horizon.
        assert limit[2] == 0 and alike(near, limit, 0) and norm(add(near, negative(limit))) < arb(1) / 4


@pytest.mark.parametrize("module", [slope_ggx, slope_beckmann])
def test_the_slope_along_grows_with_u0_from_the_horizon_to_the_edge(module):
    """heitz2014 algorithm 4 in the plane of incidence: x~ from -infinity to cot(theta)."""
    wi, alpha = exact((0.5, 0, 0.5)), exact((1, 1))
    slopes = []
    for u0 in (2**-20, 0.25, 0.5, 0.75, 1 - 2**-40):
        x, _, z = module.sample(exact((u0, 0.5)), wi, alpha)
        slopes.append(-x / z)
    assert all(a < b for a, b in pairwise(slopes)) and slopes[-1] < 1
    assert slopes[-1] > 1 - arb(2) ** -18


@pytest.mark.parametrize("module", [slope_ggx, slope_beckmann])
def test_half_is_the_middle_of_the_slope_across(module):
    assert module.sample(exact((0.3, 0.5)), exact((0.5, 0, 0.5)), ALPHA)[1] == 0
    assert module.sample(exact((0.5, 0.5)), N, ALPHA)[:2] == (0, 0)


def test_tiny_numbers_are_solved_too():
    """The smallest positive double, at 40 digits; erfc and the cube root of u both stay accurate there."""
    for name in ("slope_ggx", "slope_beckmann"):
        inputs = {"u": (5e-324, 5e-324), "wi": (1, 0, 1e-6), "alpha": (1e-4, 2)}
        text = digits(f"sampling.{name}.sample", inputs, 40)
        again = evaluate(f"sampling.{name}.sample", inputs, 1500)
        assert text == tuple(decimal(part, 40) for part in again)


# --- bounded caps


@directions
def test_bounds_agree_without_skew(wi):
    """ellipsoid_bounded is tokuyoshi2024 for e = 0 and alpha <= 1."""
    i = sphere.incident(wi, DIAGONAL)
    assert same(ellipsoid_bounded.bound(wi, DIAGONAL), -bounded_cap.bound(wi, ALPHA) * i[2])


def test_the_bound_keeps_every_reflection_above_the_horizon():
    for wi in (exact((0.5, -0.25, 0.75)), exact((-1, 0.5, 0.125)), exact((0, 0, 1))):
        for k in range(12):
            sin, cos = (arb(k) / 6).sin_cos_pi()
            wo = (cos, sin, arb(1) / 2**20)
            m = geometry.half_reflection(wi, wo)
            assert bounded_cap.pdf(m, wi, ALPHA) > 0
            for A in (SKEWED, MIRRORED, exact(((2, 0.5, 0), (0, 1.5, 0), (0.5, -0.75, 1)))):
                assert ellipsoid_bounded.pdf(m, wi, A) > 0
                o = _sphere_reflection(m, wi, A)
                assert o > ellipsoid_bounded.bound(wi, A)


def _sphere_reflection(m, wi, A):
    """o_z' of the reflection about m."""
    form = ellipsoid.canonical(A)
    return geometry.reflect(sphere.incident(wi, form), _sphere_normal(m, form))[2]


def _sphere_normal(m, form):
    (c00, c10, _), (_, c11, _), (ex, ey, _) = form
    # A^-T m by back substitution: A^T = [[C, e], [0, 1]].
    z = m[2]
    x = (m[0] - ex * z) / c00
    y = (m[1] - ey * z - c10 * x) / c11
    return normalise((x, y, z))


def test_bounds_bound():
    """They cut something off: some reflections below the horizon have a density of 0 there but not in the full cap."""
    wi, m = exact((0.5, -0.25, 0.75)), exact((1, -0.5, 0.125))
    assert spherical_cap.pdf(m, wi, ALPHA) > 0 and bounded_cap.pdf(m, wi, ALPHA) == 0
    assert ellipsoid_cap.pdf(m, wi, SKEWED) > 0 and ellipsoid_bounded.pdf(m, wi, SKEWED) == 0


def test_no_bound_from_below_or_for_alpha_above_one():
    below, wi = DIRECTIONS["below"], DIRECTIONS["plain"]
    assert bounded_cap.bound(below, ALPHA) == 1
    assert same(bounded_cap.bound(wi, exact((3, 2))), 0)
    assert ellipsoid_bounded.bound(wi, exact(((3, 0, 0), (0, 2, 0), (0, 0, 1)))) == 0


def test_the_edge_of_the_cap_is_inside():
    """At normal incidence the half vector at 45 degrees reflects to the horizon, exactly."""
    inputs = {"wm": (0.7, 0, 0.7), "wi": (0, 0, 1), "alpha": (0.3, 0.3)}
    assert evaluate("sampling.bounded_cap.pdf", inputs, 64) > 0
    assert evaluate("sampling.bounded_cap.pdf", inputs | {"wm": (0.7 + 1e-15, 0, 0.7)}, 64) == 0
    inputs = {"wm": (0.7, 0, 0.7), "wi": (0, 3, 4), "alpha": (1, 1)}
    with working(64):
        o = geometry.reflect(exact(inputs["wi"]), exact(inputs["wm"]))
        assert o[2] == 0
    assert evaluate("sampling.bounded_cap.pdf", inputs, 64) > 0


def test_a_third_of_a_turn_is_enclosed():
    """A rational that is no double: the enclosure narrows with the precision."""
    inputs = {"u": (Fraction(1, 3), Fraction(1, 7)), "wi": (1, 2, 3), "alpha": (Fraction(1, 10), 1)}
    narrow, wide = (evaluate("sampling.spherical_cap.sample", inputs, bits) for bits in (500, 100))
    assert all(b.contains(a) and a.rad() < b.rad() for a, b in zip(narrow, wide, strict=True))
    assert lookup("sampling.spherical_cap.sample") is spherical_cap.sample


def test_an_even_choice_is_exact():
    """At wi = n the two walls share evenly, so that u[2] = 1/2 is decided although it is on the edge."""
    inputs = {"u": (0.1, 0.3, 0.5), "wi": (0, 0, 1), "alpha": (0.5, 0.7)}
    above = evaluate("sampling.v_cavity.sample", inputs | {"u": (0.1, 0.3, 0.75)}, 64)
    below = evaluate("sampling.v_cavity.sample", inputs | {"u": (0.1, 0.3, 0.25)}, 64)
    assert alike(evaluate("sampling.v_cavity.sample", inputs, 64), above, 15) and not alike(above, below, 1)
