"""Properties: decode and encode are inverse; rounding is to nearest even, over- and underflow too; a ball is rounded
only when the rounding is proven; decimals are the exact value's digits."""

import struct

import numpy as np
import pytest
from flint import arb, ctx, fmpq

from ggxref.golden.rounding import (
    BF16,
    F16,
    F32,
    F64,
    FORMATS,
    Undecided,
    decimal,
    decimal_ball,
    decode,
    encode,
    from_hex,
    is_nan,
    rational,
    round_ball,
    to_hex,
    ulp,
)

formats = pytest.mark.parametrize("fmt", FORMATS.values(), ids=FORMATS)


@formats
def test_every_finite_16_bit_pattern_survives_and_wider_ones_do_at_random(fmt):
    patterns = range(fmt.infinity) if fmt.width == 16 else np.random.default_rng(1).integers(1, fmt.infinity, 5000)
    for bits in map(int, patterns):
        value = decode(bits, fmt)
        assert encode(value, fmt) == bits
        if value:
            assert encode(-value, fmt) == bits | fmt.sign


@pytest.mark.parametrize(("fmt", "kind"), [(F64, "d"), (F32, "f"), (F16, "e")])
def test_decode_agrees_with_the_hardware(fmt, kind):
    for bits in map(int, np.random.default_rng(2).integers(0, fmt.infinity, 2000)):
        assert decode(bits, fmt) == rational(struct.unpack(kind, bits.to_bytes(fmt.width // 8, "little"))[0])


@pytest.mark.parametrize(("fmt", "dtype"), [(F32, np.float32), (F16, np.float16)])
def test_encode_agrees_with_numpys_conversion_from_double(fmt, dtype):
    rng = np.random.default_rng(3)
    values = np.concatenate([rng.normal(size=500) * 10.0 ** rng.integers(-46, 39, 500), rng.normal(size=500)])
    with np.errstate(over="ignore", under="ignore"):
        expected = [int(v) for v in values.astype(dtype).view(f"u{fmt.width // 8}")]
    assert [encode(rational(float(v)), fmt) for v in values] == expected


@formats
def test_ties_go_to_even_and_a_hair_beside_them_to_the_nearer(fmt):
    hair = fmpq(1, 2**4000)
    for bits in (0, 1, 2, 3, 1 << (fmt.precision - 1), (1 << (fmt.precision - 1)) - 1, fmt.infinity - 2):
        tie = (decode(bits, fmt) + decode(bits + 1, fmt)) / 2
        assert encode(tie, fmt) == bits + (bits & 1)
        assert encode(tie - hair, fmt) == bits
        assert encode(tie + hair, fmt) == bits + 1


@formats
def test_overflow_starts_half_an_ulp_above_the_largest_number(fmt):
    largest = decode(fmt.infinity - 1, fmt)
    edge = largest + ulp(largest, fmt) / 2
    assert encode(edge, fmt) == fmt.infinity
    assert encode(-edge, fmt) == fmt.infinity | fmt.sign
    assert encode(edge - fmpq(1, 2**2000), fmt) == fmt.infinity - 1
    assert not is_nan(fmt.infinity, fmt)
    assert is_nan(fmt.infinity + 1, fmt)
    with pytest.raises(ValueError, match="not finite"):
        decode(fmt.infinity, fmt)


@formats
def test_zero_is_positive_and_underflow_keeps_its_sign(fmt):
    smallest = fmpq(2) ** fmt.quantum
    assert encode(fmpq(0), fmt) == 0
    assert encode(-smallest / 2, fmt) == fmt.sign
    assert encode(-smallest * fmpq(51, 100), fmt) == fmt.sign | 1
    assert decode(fmt.sign, fmt) == 0


def test_ulp_is_the_distance_to_the_next_number():
    for fmt in FORMATS.values():
        for bits in (0, 1, 1 << (fmt.precision - 1), fmt.infinity - 2):
            x = decode(bits, fmt)
            assert ulp(x, fmt) == decode(bits + 1, fmt) - x
    assert ulp(fmpq(10) ** 400, F64) == ulp(decode(F64.infinity - 1, F64), F64)


def test_hex_is_exactly_as_wide_as_the_format():
    assert to_hex(1, F16) == "0x0001"
    assert from_hex("0x3f000000", F32) == 0x3F000000
    for text in ("0x3f00000", "0x3f0000000", "3f000000", "0x3F000000", "0x3f00000g", "0x+f000000"):
        with pytest.raises(ValueError, match="lower-case hex"):
            from_hex(text, F32)


@formats
def test_a_ball_is_rounded_only_with_proof(fmt):
    """A ball around a tie has no proven rounding however narrow it is; the exact tie has one."""
    ctx.prec = 300
    try:
        one, up = decode(encode(fmpq(1), fmt), fmt), fmpq(1) + ulp(fmpq(1), fmt)
        tie = (arb(int(one)) + arb(up.numerator) / up.denominator) / 2
        assert round_ball(tie, fmt) == encode(one, fmt)
        with pytest.raises(Undecided):
            round_ball(tie + arb(0, 2.0**-250), fmt)
        assert round_ball(arb(1, 2.0**-250), fmt) == encode(one, fmt)
        with pytest.raises(Undecided):
            round_ball(arb(0, 2.0**-1000) * arb(2) ** -500, fmt)
        with pytest.raises(Undecided):
            round_ball(arb.nan(), fmt)
    finally:
        ctx.prec = 53


def test_a_ball_is_rounded_as_one_that_rounds_midpoints_would_not():
    """pi in f32 and bf16 against their known bits; the midpoint of a wide ball must not be taken for the value."""
    assert round_ball(arb.pi(), F32) == 0x40490FDB
    assert round_ball(arb.pi(), BF16) == 0x4049
    with pytest.raises(Undecided):
        round_ball(arb(3.14159, 1e-3), F32)


def test_decimals_are_the_exact_digits():
    assert decimal(fmpq(1, 3), 5) == "3.3333e-1"
    assert decimal(fmpq(-2, 3), 5) == "-6.6667e-1"
    assert decimal(fmpq(0)) == "0"
    assert decimal(fmpq(999999, 10), 3) == "1.00e5"
    assert decimal(fmpq(1, 2**1074), 17) == "4.9406564584124654e-324"
    assert decimal(fmpq(10**30), 3) == "1.00e30"
    assert decimal(fmpq(125, 1000), 2) == "1.2e-1"
    ctx.prec = 200
    try:
        assert decimal_ball(arb.pi()) == "3.141592653589793238462643383279502884197e0"
        with pytest.raises(Undecided):
            decimal_ball(arb.pi() + arb(0, 2.0**-130))
    finally:
        ctx.prec = 53


def test_a_result_that_no_dtype_and_no_page_holds_is_refused():
    with pytest.raises(OverflowError, match="too long to write"):
        round_ball((arb(-10) ** 7).exp(), F64)
