"""Double-double arithmetic on NumPy arrays: about 32 digits, a hundred times faster than ball arithmetic.

A number is the unevaluated sum of two float64, |lo| <= ulp(hi)/2. NumPy rounds each operation by itself, so the
error-free transforms hold (under XLA they would not: it contracts to FMAs). Dekker 1971; Hida, Li & Bailey 2001.
Nothing here is proven: `tests/test_measure_reference.py` compares what is built on it with the oracle.
"""

from fractions import Fraction
from math import factorial
from typing import Any

import numpy as np

_SPLITTER = 134217729.0  # 2^27 + 1


def _two_sum(a, b):
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def _quick_two_sum(a, b):
    s = a + b
    return s, b - (s - a)


def _two_product(a, b):
    p = a * b
    t = _SPLITTER * a
    ah = t - (t - a)
    t = _SPLITTER * b
    bh = t - (t - b)
    al, bl = a - ah, b - bh
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


class DD:
    """An array of double-double numbers; mixes with Python numbers and float64 arrays."""

    __slots__ = ("hi", "lo")
    __array_ufunc__ = None  # `array * DD` comes here, not element by element

    def __init__(self, hi: Any, lo: Any = 0.0):
        self.hi, self.lo = hi, lo

    def __add__(self, other):
        o = _dd(other)
        s, e = _two_sum(self.hi, o.hi)
        t, f = _two_sum(self.lo, o.lo)
        s, e = _quick_two_sum(s, e + t)
        return DD(*_quick_two_sum(s, e + f))

    __radd__ = __add__

    def __neg__(self):
        return DD(-self.hi, -self.lo)

    def __sub__(self, other):
        return self + (-_dd(other))

    def __rsub__(self, other):
        return (-self) + other

    def __mul__(self, other):
        o = _dd(other)
        p, e = _two_product(self.hi, o.hi)
        return DD(*_quick_two_sum(p, e + (self.hi * o.lo + self.lo * o.hi)))

    __rmul__ = __mul__

    def __truediv__(self, other):
        o = _dd(other)
        first = self.hi / o.hi
        rest = self - o * first
        second = rest.hi / o.hi
        third = (rest - o * second).hi / o.hi
        s, e = _quick_two_sum(first, second)
        return DD(*_quick_two_sum(s, e + third))

    def __rtruediv__(self, other):
        return _dd(other) / self

    def __gt__(self, other):
        return (self - other).hi > 0

    def __lt__(self, other):
        return (self - other).hi < 0

    def __abs__(self):
        return where(self.hi < 0, -self, self)


def _dd(x):
    return x if isinstance(x, DD) else DD(np.asarray(x, np.float64), 0.0)


def constant(x: Fraction) -> DD:
    """A rational to 32 digits."""
    hi = float(x)
    return DD(hi, float(x - Fraction(hi)))


# 2π and ln 2 to 50 digits.
TURN = constant(Fraction(62831853071795864769252867665590057683943387987502, 10**49))
PI = TURN * 0.5
_LN2 = constant(Fraction(69314718055994530941723212145817656807550013436026, 10**50))
_RECIPROCAL_FACTORIALS = [constant(Fraction(1, factorial(k))) for k in range(30)]


def where(condition, a, b) -> DD:
    """Elementwise choice."""
    a, b = _dd(a), _dd(b)
    return DD(np.where(condition, a.hi, b.hi), np.where(condition, a.lo, b.lo))


def maximum(a, b) -> DD:
    return where(_dd(a) > b, a, b)


def minimum(a, b) -> DD:
    return where(_dd(a) < b, a, b)


def sqrt(x: DD) -> DD:
    """Square root; 0 at and below 0."""
    positive = x.hi > 0
    safe = where(positive, x, 1.0)
    r = np.sqrt(safe.hi)
    rest = safe - DD(*_two_product(r, r))
    return where(positive, DD(*_quick_two_sum(r, rest.hi / (2 * r))), 0.0)


def _series(x_square: DD, start: int, terms: int) -> DD:
    """Σ (−x²)^k / (2k + start)! for k < terms."""
    value = _RECIPROCAL_FACTORIALS[2 * (terms - 1) + start]
    for k in reversed(range(terms - 1)):
        value = value * (-x_square) + _RECIPROCAL_FACTORIALS[2 * k + start]
    return value


def cos_sin_turn(u) -> tuple[DD, DD]:
    """(cos 2πu, sin 2πu); 14 terms leave 1e-32 on the eighth of a turn that is left after the reduction."""
    u = _dd(u)
    quarter = np.round(4 * u.hi)
    x = (u - quarter / 4) * TURN
    square = x * x
    c, s = _series(square, 0, 15), x * _series(square, 1, 14)
    turned = quarter.astype(np.int64) % 4
    swapped = turned % 2 == 1
    c, s = where(swapped, s, c), where(swapped, c, s)
    return where((turned == 1) | (turned == 2), -c, c), where(turned >= 2, -s, s)


def exp(x: DD) -> DD:
    """e^x, by Taylor's series at (x − k ln 2)/512."""
    k = np.round(x.hi / _LN2.hi)
    r = (x - _LN2 * k) * (1 / 512)
    value = _RECIPROCAL_FACTORIALS[9]
    for j in reversed(range(1, 9)):
        value = value * r + _RECIPROCAL_FACTORIALS[j]
    value = value * r  # e^r − 1: its square keeps the digits that 1 + r would drop
    for _ in range(9):
        value = value * value + value * 2.0
    value = value + 1.0
    return DD(np.ldexp(value.hi, k.astype(np.int64)), np.ldexp(value.lo, k.astype(np.int64)))


def log(x: DD) -> DD:
    """ln x for x > 0: one step of Newton from float64 doubles its digits."""
    first = np.log(x.hi)
    return first + (x * exp(DD(-first, np.zeros_like(first))) - 1.0)
