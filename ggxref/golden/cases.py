"""From a function, a dtype and an index to the input of one test: exact numbers and their bits."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from flint import fmpq

from ggxref.golden.catalogue import Function
from ggxref.golden.inputs import Draw
from ggxref.golden.rounding import Format, decode, encode, is_nan
from ggxref.golden.stream import Stream
from ggxref.golden.themes import Theme, themes

DIRECTIONS = frozenset({"wi", "wo", "wm"})
# What describes a skewed surface.
SHAPES = frozenset({"A", "mean", "scatter"})


@dataclass(frozen=True)
class Case:
    """The input of one test. `bits` and `values` (None: NaN) are keyed by argument; vectors and matrices are nested."""

    function: Function
    fmt: Format
    theme: Theme
    bits: dict[str, Any]
    values: dict[str, Any]

    def quantity(self, name: str) -> list[Any]:
        """Values of the arguments that were drawn as that quantity."""
        return [self.values[a] for a, q in self.function.arguments.items() if q == name]

    def directions(self) -> dict[str, Any]:
        return {a: self.values[a] for a, q in self.function.arguments.items() if q in DIRECTIONS}


def mapped(f: Callable[[Any], Any], x: Any) -> Any:
    """`f` of each leaf of nested tuples (or lists)."""
    return tuple(mapped(f, part) for part in x) if isinstance(x, tuple | list) else f(x)


def leaves(x: Any) -> Iterator[Any]:
    if isinstance(x, tuple | list):
        for part in x:
            yield from leaves(part)
    elif isinstance(x, dict):
        yield from leaves(tuple(x.values()))
    else:
        yield x


def swapped(quantity: str, x: Any) -> Any:
    """The quantity after x and y change places."""
    match quantity:
        case "scatter":
            (a, b), (c, d) = x
            return (d, c), (b, a)
        case "A":
            return tuple((row[1], row[0], row[2]) for row in x)
        case "wi" | "wo" | "wm" | "alpha" | "mean" | "slope":
            return (x[1], x[0], *x[2:])
    return x


def stretched(s: Stream, fmt: Format, quantity: str, x: Any) -> Any:
    """A direction made a few ulp longer or shorter, as after a chain of reflections."""
    if quantity not in DIRECTIONS:
        return x
    factor = 1 + s.sign() * fmpq(2 + s.below(7), 1 << fmt.precision)
    return tuple(factor * c for c in x)


def case(seed: int, function: Function, fmt: Format, index: int) -> Case | None:
    """The input of candidate number `index`; None where it is outside the function's domain."""
    cycle = themes(function)
    place = index % len(cycle)
    theme = cycle[place]
    post = theme.get("_post")
    # A swapped case repeats the draws of its partner, the same theme unswapped.
    partner = cycle.index({k: v for k, v in theme.items() if k != "_post"}) if post == "swap" else place
    label = seed, function.name, fmt.name, index - place + partner
    # Without a shape matrix the surface is the one of `alpha`: its lobe has neither skew nor shear.
    shaped = not SHAPES.isdisjoint(function.arguments.values())
    drawn = Draw(label, fmt, theme if shaped else {**theme, "A": "aligned"})
    exact = {argument: getattr(drawn, quantity) for argument, quantity in function.arguments.items()}
    if post == "swap":
        exact = {a: swapped(q, exact[a]) for a, q in function.arguments.items()}
    if post == "stretch":
        exact = {a: stretched(Stream(*label, "stretch", a), fmt, q, exact[a]) for a, q in function.arguments.items()}
    bits = {a: mapped(lambda x: encode(x, fmt), x) for a, x in exact.items()}
    if any(decode(bits[a][2], fmt) <= 0 for a in function.above):
        return None
    # A sampler may never look at a uniform number.
    first = next(a for a, q in function.arguments.items() if q not in {"u", "u3", "rows"})
    broken = {a: "" if post == "nan" and a != first else post or "" for a in bits}
    bits = {a: altered(broken[a], q, bits[a], fmt) for a, q in function.arguments.items()}
    values = {a: mapped(lambda b: None if is_nan(b, fmt) else decode(b, fmt), b) for a, b in bits.items()}
    return Case(function, fmt, theme, bits, values)


def altered(post: str, quantity: str, bits: Any, fmt: Format) -> Any:
    """The bits of an argument after a change that only bits can tell, or that breaks the argument."""
    match post:
        case "minus zero" if quantity in DIRECTIONS:
            return mapped(lambda b: b or fmt.sign, bits)
        case "negative alpha" if quantity == "alpha":
            return bits[0] | fmt.sign, bits[1]
        case "zero alpha" if quantity == "alpha":
            return 0, bits[1]
        case "nan":
            # The last component: some functions look at the z of a direction alone.
            nan = fmt.infinity | 1 << (fmt.precision - 2)
            return (*bits[:-1], altered(post, quantity, bits[-1], fmt)) if isinstance(bits, tuple) else nan
    return bits
