"""Properties: inputs come from integers alone and are the same everywhere; each flag's condition is met by tests of its
kind and by no plain one; a swapped case is the mirror of its partner."""

import hashlib

import pytest
from flint import fmpq

from ggxref.golden.cases import case, leaves
from ggxref.golden.flags import CONDITIONS, SENTENCES
from ggxref.golden.inputs import Draw
from ggxref.golden.linear import determinant, dot
from ggxref.golden.rounding import F16, F32, F64, FORMATS, decode, is_nan
from ggxref.golden.samplers import FUNCTIONS
from ggxref.golden.stream import Stream, hemisphere, root, unit
from ggxref.golden.themes import THEMES, themes


def test_the_stream_is_sha_256_of_label_and_counter():
    block = hashlib.sha256(b"a/1" + (1).to_bytes(8, "big")).digest()
    s = Stream("a", 1)
    s.bits(8)
    assert s.bits(64) == int.from_bytes(block[:8], "big")
    assert Stream("a", 1).bits(64) != Stream("a", 2).bits(64)


def test_the_streams_numbers_fill_their_ranges_evenly():
    s = Stream("ranges")
    tenths = [s.below(10) for _ in range(2000)]
    # Standard deviation of a count is 13.4; five of them.
    assert all(abs(tenths.count(i) - 200) < 67 for i in range(10))
    scales = [s.scale(fmpq(1, 1024), 1) for _ in range(2000)]
    octaves = [sum(1 for x in scales if fmpq(1, 2 ** (i + 1)) <= x < fmpq(1, 2**i)) for i in range(10)]
    assert sum(octaves) == 2000
    assert all(abs(n - 200) < 67 for n in octaves)
    eighths = [(c > 0, d > 0, abs(c) > abs(d)) for c, d in (s.circle() for _ in range(2000))]
    assert min(eighths.count(e) for e in set(eighths)) > 180
    assert len(set(eighths)) == 8


def test_circle_and_hemisphere_are_exactly_unit_and_unit_nearly():
    s = Stream("unit")
    for _ in range(50):
        c, d = s.circle()
        assert c * c + d * d == 1
        w = hemisphere(s)
        assert dot(w, w) == 1
        assert w[2] > 0
        v = unit(s.scale(1, 1000), s.uniform(-1, 1), s.uniform(-1, 1))
        assert abs(dot(v, v) - 1) < fmpq(1, 2**120)
    assert abs(root(fmpq(2, 10**60)) ** 2 * 10**60 / 2 - 1) < fmpq(1, 2**120)


def test_draws_know_no_floating_point():
    """The first draw, digit by digit: a change of any draw changes every vector and must raise generate.VERSION."""
    drawn = Draw(("pin",), F32, {})
    quantities = {q: getattr(drawn, q) for q in sorted({q for f in FUNCTIONS.values() for q in f.arguments.values()})}
    text = repr({k: [*map(str, leaves(v))] for k, v in quantities.items()})
    assert all(isinstance(x, fmpq) for v in quantities.values() for x in leaves(v))
    assert hashlib.sha256(text.encode()).hexdigest()[:16] == "6be8e2fba88e1806"


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_can_be_drawn_in_every_dtype(name):
    function = FUNCTIONS[name]
    for fmt in FORMATS.values():
        cases = [case(1, function, fmt, i) for i in range(6)]
        for c in filter(None, cases):
            assert set(c.values) == set(function.arguments)
            pairs = zip(leaves(c.bits), leaves(c.values), strict=True)
            assert all(value is None if is_nan(bits, fmt) else decode(bits, fmt) == value for bits, value in pairs)


def test_a_theme_reaches_only_functions_that_take_its_quantities():
    assert {"alpha": "small"} not in themes(FUNCTIONS["ndf.hemisphere"])
    assert {"u": "zero"} in themes(FUNCTIONS["sampling.v_cavity.sample.ggx"])
    assert {"A": "strong"} in themes(FUNCTIONS["ndf.ellipsoid"])
    used = {tuple(t.items()) for f in FUNCTIONS.values() for t in themes(f)}
    assert all(tuple(t.items()) in used for t in THEMES)


def find(name: str, theme: dict[str, str], fmt=F32):
    function = FUNCTIONS[name]
    return case(1, function, fmt, themes(function).index(theme))


def test_directions_are_unit_to_rounding_and_stretched_ones_are_not():
    plain, stretched = find("ndf.ggx", {}), find("ndf.ggx", {"wm": "plain", "_post": "stretch"})
    assert plain and stretched
    ulp = fmpq(1, 2**23)
    assert abs(dot(plain.values["wm"], plain.values["wm"]) - 1) < 2 * ulp
    assert abs(dot(stretched.values["wm"], stretched.values["wm"]) - 1) > ulp


def test_a_swapped_case_is_its_partner_with_x_and_y_exchanged():
    cycle = themes(FUNCTIONS["masking.g1_ggx"])
    i = cycle.index({"alpha": "mild", "_post": "swap"})
    j = cycle.index({"alpha": "mild"})
    partner, swapped = (case(1, FUNCTIONS["masking.g1_ggx"], F64, k + 3 * len(cycle)) for k in (j, i))
    assert partner and swapped
    for a, x in partner.bits.items():
        assert swapped.bits[a] == (x[1], x[0], *x[2:])
        assert swapped.bits[a] != x


def test_minus_zero_and_subnormals_survive_into_the_bits():
    minus = find("masking.g1_ggx", {"wi": "normal", "_post": "minus zero"})
    assert minus and minus.bits["w"] == (0x80000000, 0x80000000, 0x3F800000)
    tiny = find("masking.g1_ggx", {"wi": "subnormal"})
    assert tiny and 0 < abs(tiny.values["w"][0]) < fmpq(2) ** -126


def test_a_negative_determinant_and_a_normal_at_right_angles_are_drawn():
    negative = find("ndf.ellipsoid", {"A": "negative"})
    assert negative and determinant(negative.values["A"]) < 0
    edge = find("masking.g1_ggx", {"wi": "plain", "wm": "perpendicular"})
    assert edge and 0 < abs(dot(edge.values["w"], edge.values["wm"])) < fmpq(1, 50)


def test_every_flag_has_a_sentence_and_a_condition():
    assert SENTENCES.keys() == CONDITIONS.keys()
    assert all(len(s) > 20 and s.endswith(".") for s in SENTENCES.values())
    required = """NormalIncidence NearNormal Grazing ExactHorizon Backfacing WrongSideMicrofacet NearPerpendicular
    HalfVectorDegenerate Retro NonUnit NegativeZero AlphaSmall AlphaOne AlphaAboveOne AlphaSquaredUnderflow AnisoMild
    AnisoExtreme AxesSwapped Skew StrongSkew NegativeDet IllConditionedA U0 ULargestBelow1 AzimuthSeam LobeTail SubnormalIn
    SubnormalOut IntermediateOverflow IntermediateUnderflow F16Overflow FtzSensitive HardToRound EtaNearOne TotalReflection
    CriticalAngle"""
    assert set(required.split()) == SENTENCES.keys()


def test_the_largest_number_below_one_is_on_the_grid_of_its_dtype():
    for fmt in (F16, F32, F64):
        c = find("sampling.spherical_cap.sample", {"u": "last"}, fmt)
        assert c and set(c.values["u"]) == {1 - fmpq(1, 2**fmt.precision)}
