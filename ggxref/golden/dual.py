"""Exact gradients: balls that carry their derivatives through the oracle's own functions.

Every rule is applied to enclosures, so that the derivatives are enclosures too, as wide as they must be.
"""

from collections.abc import Callable, Sequence
from typing import Any

from flint import arb

from ggxref.golden.rounding import Undecided


class Dual(arb):
    """A ball with its derivatives along a few directions. Comparisons see the value alone."""

    slopes: tuple[arb, ...]

    @staticmethod
    def of(value: Any, slopes: Sequence[arb]) -> "Dual":
        self = Dual(value)
        self.slopes = tuple(slopes)
        return self

    def _chain(self, value: arb, slope: arb) -> "Dual":
        """f(self) from f and f'."""
        return Dual.of(value, [slope * d for d in self.slopes])

    def _with(self, other: Any, value: arb, mine: Any, its: Any) -> "Dual":
        """f(self, other) from f and both partial derivatives."""
        if not isinstance(other, Dual):
            return Dual.of(value, [mine * d for d in self.slopes])
        return Dual.of(value, [mine * d + its * e for d, e in zip(self.slopes, other.slopes, strict=True)])

    def __add__(self, other: Any) -> "Dual":
        return self._with(other, arb(self) + plain(other), 1, 1)

    __radd__ = __add__

    def __sub__(self, other: Any) -> "Dual":
        return self._with(other, arb(self) - plain(other), 1, -1)

    def __rsub__(self, other: Any) -> "Dual":
        return -self + other

    def __mul__(self, other: Any) -> "Dual":
        return self._with(other, arb(self) * plain(other), plain(other), arb(self))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> "Dual":
        x, y = arb(self), plain(other)
        return self._with(other, x / y, arb(1) / y, -x / (y * y))

    def __rtruediv__(self, other: Any) -> "Dual":
        x = arb(self)
        return self._chain(other / x, -other / (x * x))

    def __pow__(self, power: Any, modulus: None = None) -> "Dual":  # pyright: ignore[reportIncompatibleMethodOverride]
        if isinstance(power, Dual):
            raise TypeError("no derivative with respect to an exponent")
        x = arb(self)
        return self._chain(x**power, power * x ** (power - 1))

    def __rpow__(self, base: Any, modulus: None = None) -> "Dual":  # pyright: ignore[reportIncompatibleMethodOverride]
        raise TypeError("no derivative with respect to an exponent")

    def __neg__(self) -> "Dual":
        return Dual.of(-arb(self), [-d for d in self.slopes])

    def __pos__(self) -> "Dual":
        return self

    def __abs__(self) -> "Dual":
        if self > 0 or (self == 0 and not any(d != 0 for d in self.slopes)):
            return self
        if self < 0:
            return -self
        raise Undecided("the derivative of an absolute value at 0")

    def sqrt(self) -> "Dual":
        root = arb(self).sqrt()
        return self._chain(root, 1 / (2 * root))

    def exp(self) -> "Dual":
        power = arb(self).exp()
        return self._chain(power, power)

    def log(self) -> "Dual":
        return self._chain(arb(self).log(), 1 / arb(self))

    def erf(self) -> "Dual":
        x = arb(self)
        return self._chain(x.erf(), 2 * (-x * x).exp() / arb.pi().sqrt())

    def erfc(self) -> "Dual":
        x = arb(self)
        return self._chain(x.erfc(), -2 * (-x * x).exp() / arb.pi().sqrt())

    def min(self, other: Any) -> "Dual":
        return self if self < other else _constant(self, other) if self > other else _tied()

    def max(self, other: Any) -> "Dual":
        return self if self > other else _constant(self, other) if self < other else _tied()


def plain(x: Any) -> Any:
    """The value without derivatives."""
    return arb(x) if isinstance(x, Dual) else x


def _constant(like: Dual, x: Any) -> Dual:
    return x if isinstance(x, Dual) else Dual.of(x, [arb(0)] * len(like.slopes))


def _tied() -> Dual:
    raise Undecided("the derivative of a minimum or maximum of two equal numbers")


def _refused(name: str) -> Callable[..., Any]:
    def method(self: Dual, *_: Any, **__: Any) -> Any:
        raise TypeError(f"no rule for the derivative of {name}")

    return method


# What tells of the value alone. Every other method of balls must have a rule above: without one it would drop the derivative.
_VALUES = {"is_finite", "is_exact", "is_zero", "is_nan", "str", "repr", "mid", "rad", "lower", "upper", "contains"}
for _name in set(dir(arb)) - set(vars(Dual)) - _VALUES:
    if not _name.startswith("_") and not isinstance(vars(arb).get(_name), staticmethod):
        setattr(Dual, _name, _refused(_name))


def gradient(f: Callable[[Any], arb], x: Any) -> tuple[arb, ...]:
    """f and its partial derivatives at `x`, nested tuples of balls, in their order."""
    numbers = [*_flat(x)]
    unit = [[arb(int(i == j)) for j in range(len(numbers))] for i in range(len(numbers))]
    variables = iter([Dual.of(n, slopes) for n, slopes in zip(numbers, unit, strict=True)])
    value = f(_like(x, variables))
    return (arb(value), *value.slopes) if isinstance(value, Dual) else (value, *(arb(0) for _ in numbers))


def _flat(x: Any) -> list[arb]:
    return [leaf for part in x for leaf in _flat(part)] if isinstance(x, tuple) else [x]


def _like(x: Any, leaves: Any) -> Any:
    return tuple(_like(part, leaves) for part in x) if isinstance(x, tuple) else next(leaves)
