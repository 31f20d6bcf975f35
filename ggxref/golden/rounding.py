"""Bit patterns of the four dtypes, and rounding to them by exact integer arithmetic.

A value is a rational (flint's: several times as fast as Python's), a ball an `arb`, an enclosure of the exact result. A ball
is rounded only when both of its ends round to the same number: rounding is monotone, so every number between them, the
exact result too, rounds there.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cache

from flint import arb, fmpq, fmpz

DIGITS = 40
# Results beyond it are left out of the vectors; the widest dtype ends at 2^-1074.
LARGEST_EXPONENT = 30000


class Undecided(ArithmeticError):
    """The enclosure is too wide to prove the rounding."""


@dataclass(frozen=True)
class Format:
    """An IEEE 754 style binary format.

    - `width`: bits in all; `precision`: bits of the significand with the hidden one;
    - `emin`, `emax`: exponents of the smallest normal and the largest finite binade, 2^e <= |x| < 2^(e+1).
    """

    name: str
    width: int
    precision: int
    emin: int
    emax: int

    @property
    def quantum(self) -> int:
        """Exponent of the smallest subnormal."""
        return self.emin - self.precision + 1

    @property
    def infinity(self) -> int:
        """Bits of +inf; larger magnitudes are NaN."""
        return (self.emax - self.emin + 2) << (self.precision - 1)

    @property
    def sign(self) -> int:
        """The sign bit."""
        return 1 << (self.width - 1)


F64 = Format("f64", 64, 53, -1022, 1023)
F32 = Format("f32", 32, 24, -126, 127)
BF16 = Format("bf16", 16, 8, -126, 127)
F16 = Format("f16", 16, 11, -14, 15)
FORMATS = {f.name: f for f in (F64, F32, BF16, F16)}


def binade(x: fmpq) -> int:
    """The integer e with 2^e <= |x| < 2^(e+1), x != 0."""
    n, d = abs(x.numerator), x.denominator
    e = int(n.bit_length() - d.bit_length())  # right, or one too large
    return e if (n << max(-e, 0)) >= (d << max(e, 0)) else e - 1


def scaled(x: fmpq, exponent: int) -> tuple[fmpz, fmpz]:
    """Numerator and denominator of x / 2^exponent, not reduced."""
    return x.numerator << max(-exponent, 0), x.denominator << max(exponent, 0)


def nearest(numerator: fmpz, denominator: fmpz) -> fmpz:
    """The integer nearest to a positive fraction, ties to even."""
    n, rest = divmod(numerator, denominator)
    twice = 2 * rest
    return n + (twice > denominator or (twice == denominator and n & 1))


def encode(x: fmpq, fmt: Format) -> int:
    """Bits of `x` rounded to nearest, ties to even; overflow is inf, underflow keeps the sign, exact 0 is +0."""
    if x == 0:
        return 0
    exponent = max(binade(x), fmt.emin) - fmt.precision + 1
    significand = int(nearest(*scaled(abs(x), exponent)))
    # The hidden bit is 1 << (precision-1): added to the exponent field it makes the normal numbers, and a significand
    # that rounds up to the next power of two carries into the next binade.
    bits = ((exponent - fmt.quantum) << (fmt.precision - 1)) + significand
    return min(bits, fmt.infinity) | (fmt.sign if x < 0 else 0)


def decode(bits: int, fmt: Format) -> fmpq:
    """Exact value of a finite number's bits. -0 is 0: a rational has one zero."""
    magnitude = bits & (fmt.sign - 1)
    if magnitude >= fmt.infinity:
        raise ValueError(f"{to_hex(bits, fmt)} is not finite in {fmt.name}")
    hidden = 1 << (fmt.precision - 1)
    field, significand = magnitude >> (fmt.precision - 1), magnitude & (hidden - 1)
    if field:
        significand, field = significand + hidden, field - 1
    value = (significand << field) * power(fmt.quantum)
    return -value if bits & fmt.sign else value


def is_nan(bits: int, fmt: Format) -> bool:
    """Whether the bits are a NaN."""
    return bits & (fmt.sign - 1) > fmt.infinity


def rational(x: str | float) -> fmpq:
    """The exact value of a decimal or a float."""
    return fmpq(*Fraction(x).as_integer_ratio())


def to_float(x: fmpq) -> float:
    """The nearest float64: division of Python's integers rounds once."""
    return int(x.p) / int(x.q)


def spacing(x: fmpq, fmt: Format) -> fmpq:
    """Distance between neighbours in the binade of `x`, were there no end to the exponents; at 0 and below the normal range,
    the smallest subnormal."""
    return power(max(binade(x), fmt.emin) - fmt.precision + 1 if x else fmt.quantum)


def ulp(x: fmpq, fmt: Format) -> fmpq:
    """`spacing`, beyond the largest finite number that of its binade."""
    return min(spacing(x, fmt), power(fmt.emax - fmt.precision + 1))


@cache
def power(exponent: int) -> fmpq:
    """2^exponent."""
    return fmpq(2) ** exponent


HEXADECIMAL = frozenset("0123456789abcdef")


def to_hex(bits: int, fmt: Format) -> str:
    """Bits as they stand in the files: `0x` and width/4 lower-case digits."""
    return f"0x{bits:0{fmt.width // 4}x}"


def from_hex(text: str, fmt: Format) -> int:
    """Bits of a hex string of exactly this format's width."""
    digits = fmt.width // 4
    body = text[2:]
    if text[:2] != "0x" or len(body) != digits or not HEXADECIMAL.issuperset(body):
        raise ValueError(f"{text!r} is not 0x and {digits} lower-case hex digits ({fmt.name})")
    return int(body, 16)


def dyadic(x: arb) -> fmpq:
    """Value of an exact ball."""
    man, exp = map(int, x.man_exp())
    return fmpq(man << exp) if exp >= 0 else fmpq(man, 1 << -exp)


def ends(ball: arb) -> tuple[fmpq, fmpq]:
    """The two ends of an enclosure, exact."""
    if not ball.is_finite():
        raise Undecided("the enclosure is not finite")
    mid, rad = ball.mid(), ball.rad()
    if any(part != 0 and abs(int(part.man_exp()[1])) > LARGEST_EXPONENT for part in (mid, rad)):
        raise OverflowError("the result is beyond 2^±30000: too long to write, and no dtype holds it")
    centre, radius = dyadic(mid), dyadic(rad)
    return (centre - radius, centre + radius) if radius else (centre, centre)


def round_ball(ball: arb, fmt: Format) -> int:
    """Bits of the exact result that `ball` encloses, correctly rounded; `Undecided` where the ball is too wide.

    A tie is decided only by an exact ball, and the sign of zero only by one or by a ball of one sign.
    """
    low, high = (encode(end, fmt) for end in ends(ball))
    if low != high:
        raise Undecided(f"{ball} rounds to more than one {fmt.name}")
    return low


def decimal(x: fmpq, digits: int = DIGITS) -> str:
    """`x` to so many significant digits, nearest, ties to even: `-1.250e-7`; 0 is `0`."""
    if x == 0:
        return "0"
    # log10 from the binade is right, or one too small; the division below tells.
    e = binade(x) * 30102999566398119521 // 10**20
    n = 10**digits
    while n >= 10**digits:
        shift = digits - 1 - e
        n = nearest(abs(x.numerator) * 10 ** max(shift, 0), x.denominator * 10 ** max(-shift, 0))
        e += 1
    e -= 1
    text = str(n)
    return f"{'-' if x < 0 else ''}{text[0]}.{text[1:]}e{e}"


def decimal_ball(ball: arb, digits: int = DIGITS) -> str:
    """The exact result that `ball` encloses, to so many proven digits."""
    low, high = (decimal(end, digits) for end in ends(ball))
    if low != high:
        raise Undecided(f"{ball} has no {digits} proven digits")
    return low
