"""Properties: an ulp is an ulp; errors put in are found again; faults are counted; ill-conditioning is told from a bad form."""

from fractions import Fraction

import jax.numpy as jnp
import ml_dtypes
import numpy as np
import pytest

from ggxref import masking, ndf
from ggxref.measure.accuracy import DTYPES, box, compiled, errors, in_units, measure
from ggxref.measure.reference import REFERENCES
from ggxref.measure.regions import REGIONS, rounded
from ggxref.measure.variants import QUANTITIES

COUNT = 1 << 11
GGX = REFERENCES["ndf.ggx"]


@pytest.mark.parametrize("dtype", DTYPES)
def test_a_neighbour_is_one_ulp_away(dtype):
    kind = DTYPES[dtype]
    x = np.asarray([1.0, 1.5, 3.25, 0.1, 100.0], kind)
    gap = x.astype(float) * 0 + np.ldexp(1.0, np.frexp(x.astype(float))[1] - 1 - ml_dtypes.finfo(kind).nmant)
    assert in_units(gap, x.astype(float), kind).tolist() == [1.0] * 5


def test_an_error_put_in_is_found_again():
    def off(wm, alpha):
        return ndf.ggx(wm, alpha) * (1 + 40 * 2.0**-23)

    clean = measure("ndf", "", ndf.ggx, GGX, count=COUNT, rounds=0)
    wrong = measure("ndf", "", off, GGX, count=COUNT, rounds=0)
    # 40 ε is 40 to 80 ulps over a binade, give or take what the clean form errs.
    assert clean.worst < 10
    assert 60 < wrong.worst < 80 + clean.worst
    assert wrong.excess > 50


def test_faults_are_counted_and_do_not_pass_as_errors():
    def broken(wm, alpha):
        D = ndf.ggx(wm, alpha)
        return jnp.where(wm[0] > 0.8, jnp.nan, jnp.where(wm[0] < -0.8, 0, jnp.where(wm[1] > 0.9, -D, D)))

    found = measure("ndf", "", broken, GGX, count=COUNT, rounds=0)
    assert found.nan > 0 and found.wrong_zero > 0 and found.wrong_sign > 0 and found.inf == 0
    assert np.isinf(found.worst)
    assert measure("ndf", "", ndf.ggx, GGX, count=COUNT, rounds=0).nan == 0


def test_ill_conditioned_input_is_told_from_an_unstable_form():
    """A dot product of nearly perpendicular vectors moves by many ulps with its input, whatever the form."""
    q = QUANTITIES["dot"]
    best, plain = (
        measure("dot", v.name, v.function, q.reference, region="perpendicular", count=COUNT) for v in q.variants
    )
    assert best.median < 0.5 and best.excess == 0
    assert plain.sampled > 100 * best.sampled
    drawn = rounded(REGIONS["perpendicular"](np.random.default_rng(1), 256), np.float32)
    explained = box(q.reference, [drawn["wi"], drawn["wm"]], np.float32)
    assert np.median(explained) > 10  # half an ulp of the input is many of the result


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 60, reason="long double is double here")
@pytest.mark.parametrize("name", REGIONS)
def test_directions_in_float64_are_unit_but_for_their_rounding(name):
    """Each component within half an ulp, at most 2⁻⁵⁴, of an exactly unit vector's: its length within √3 of that, and long double's own."""
    drawn = rounded(REGIONS[name](np.random.default_rng(1), 256), np.float64)
    for direction in ("w", "wo", "wm"):
        squares = [sum(Fraction(float(c)) ** 2 for c in w) for w in drawn[direction].T]
        assert max(abs(square - 1) / 2 for square in squares) < (np.sqrt(3) + 0.01) * 2.0**-54


def test_search_finds_worse_than_sampling():
    v = QUANTITIES["lambda"].variants[1]
    sampled = measure("lambda", v.name, v.function, QUANTITIES["lambda"].reference, count=COUNT, rounds=0)
    searched = measure("lambda", v.name, v.function, QUANTITIES["lambda"].reference, count=COUNT, rounds=8)
    assert searched.sampled == sampled.sampled
    assert searched.worst > 2 * sampled.worst


def test_the_same_seed_gives_the_same_numbers():
    first, second = (measure("ndf", "", ndf.ggx, GGX, count=COUNT, rounds=2) for _ in range(2))
    assert first == second


@pytest.mark.parametrize("name", QUANTITIES)
def test_the_first_variant_is_the_librarys_and_sources_are_given(name):
    q = QUANTITIES[name]
    assert q.variants[0].source.startswith("ggxref")
    assert all(v.source and v.name for v in q.variants)
    assert len({v.name for v in q.variants}) == len(q.variants)
    assert not q.variants[0].approximate


@pytest.mark.parametrize("region", REGIONS)
def test_regions_draw_unit_directions_in_range(region):
    drawn = REGIONS[region](np.random.default_rng(0), 500)
    for name in ("wi", "wo", "wm"):
        assert np.allclose((drawn[name] ** 2).sum(0), 1, rtol=0, atol=1e-14)
        assert (drawn[name][2] > -1e-12).all()
    assert ((drawn["u"] >= 0) & (rounded(drawn, np.float32)["u"] < 1)).all()
    assert (drawn["alpha"] >= 0.99e-4).all() and (drawn["alpha"] <= 10.01).all()


def test_errors_leaves_out_what_has_no_finite_value():
    wm = np.asarray([[0.6], [0.0], [0.8]], np.float32)
    error, graded, faults = errors(lambda w: np.asarray([0.0], np.float32), lambda w: w[0] / 0.0, [wm], np.float32)
    assert not graded[0] and faults.inf == 0 and faults.nan == 0 and error.shape == (1,)


def test_a_flushed_result_is_told_from_a_wrong_zero():
    """Λ of Beckmann below the normal range comes out as 0, which is the hardware's; above it, it must not."""
    reference = REFERENCES["masking.lambda_beckmann"]
    w = np.asarray([[0.6, 0.6], [0.0, 0.0], [0.8, 0.8]], np.float32)
    alpha = np.asarray([[0.15, 0.152], [0.1, 0.1]], np.float32)
    error, graded, faults = errors(compiled(masking.lambda_beckmann), reference, [w, alpha], np.float32)
    assert (faults.flushed, faults.wrong_zero) == (1, 0)
    assert graded.tolist() == [False, True]
    assert error[1] < 1000
    _, _, faults = errors(lambda w, alpha: 0 * w[0], reference, [w, alpha], np.float32)
    assert (faults.flushed, faults.wrong_zero) == (1, 1)
