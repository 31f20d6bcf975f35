"""Wrong formulas, made from the oracle's right ones: what they are built of."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flint import arb, fmpq

from ggxref.golden.cases import mapped
from ggxref.golden.catalogue import Function
from ggxref.golden.exact import evaluate
from ggxref.golden.linear import Matrix, cofactor, determinant, transposed
from ggxref.golden.stream import root
from ggxref.oracle import precision
from ggxref.oracle.precision import exact, working

BITS = 128
Values = dict[str, Any]
Answer = Callable[[Function, Values], Any]
Change = Callable[[Any, Function, Values], Any]


@dataclass(frozen=True)
class Mutant:
    """`answer(function, values)` is the wrong result of exact inputs; None where the mistake cannot be made."""

    name: str
    sentence: str
    answer: Answer


def of(function: Function, *quantities: str) -> list[str]:
    """The arguments that are drawn as these quantities."""
    return [a for a, q in function.arguments.items() if q in quantities]


def on(quantities: str, change: Callable[[Any], Any], only: str = "") -> Answer:
    """The right formula of wrong inputs: `change` applied to each argument of these quantities."""

    def answer(function: Function, values: Values) -> Any:
        arguments = of(function, *quantities.split())
        if not arguments or not concerns(only, function):
            return None
        return evaluate(function, values | {a: change(values[a]) for a in arguments}, BITS)

    return answer


def together(change: Callable[[Values], Values], *needed: str) -> Answer:
    """The right formula of arguments that are changed together."""

    def answer(function: Function, values: Values) -> Any:
        if not set(needed) <= values.keys() or function.derivative in needed:
            return None
        return evaluate(function, values | change(values), BITS)

    return answer


def then(change: Change, only: str = "") -> Answer:
    """The right result, changed, for functions whose names hold one of the words of `only`."""

    def answer(function: Function, values: Values) -> Any:
        if function.derivative or not concerns(only, function):
            return None
        result = evaluate(function, values, BITS)
        with working(BITS):
            return change(result, function, values)

    return answer


def instead(names: Mapping[str, str]) -> Answer:
    """Another function, of those arguments that it takes: `"module.name(a, b)"`, with `:option` for a distribution."""

    def answer(function: Function, values: Values) -> Any:
        if function.id not in names:
            return None
        name, _, arguments = names[function.id].rstrip(")").partition("(")
        name, _, option = name.partition(":")
        taken = {a.strip(): values[a.strip()] for a in arguments.split(",")}
        return precision.evaluate(name, taken | ({"distribution": option} if option else {}), BITS)

    return answer


def formula(names: str, f: Callable[..., Any]) -> Answer:
    """A formula of the functions' own arguments, as balls."""

    def answer(function: Function, values: Values) -> Any:
        if function.id not in names.split():
            return None
        with working(BITS):
            return f(**{a: exact(x) for a, x in values.items()})

    return answer


def concerns(only: str, function: Function) -> bool:
    return not only or any(word in function.name for word in only.split())


def times(factor: Callable[[], Any]) -> Change:
    return lambda result, *_: mapped(lambda x: x * factor(), result)


def height(w: Sequence[Any]) -> arb:
    """z of a direction, normalised."""
    x, y, z = exact(tuple(w))
    return z / (x * x + y * y + z * z).sqrt()


def times_height(quantity: str, power: int) -> Change:
    """The result times a power of |z| of the first direction of its kind."""

    def change(result: Any, function: Function, values: Values) -> Any:
        arguments = of(function, quantity)
        return abs(height(values[arguments[0]])) ** power * result if arguments else None

    return change


def signs(*factors: int) -> Change:
    """A vector with the signs of its components changed."""

    def change(result: Any, *_: Any) -> Any:
        plain = isinstance(result, tuple) and len(result) == len(factors) and not isinstance(result[0], tuple)
        return tuple(s * x for s, x in zip(factors, result, strict=True)) if plain else None

    return change


def zero_below(quantity: str) -> Change:
    """0 where a direction of that kind is below the horizon."""

    def change(result: Any, function: Function, values: Values) -> Any:
        below = any(values[a][2] < 0 for a in of(function, quantity))
        return mapped(lambda x: arb(0) if below else x, result)

    return change


def inverse(A: Matrix) -> Matrix:
    det = determinant(A)
    return transposed(tuple(tuple(e / det for e in row) for row in cofactor(A)))  # pyright: ignore[reportArgumentType]


def third_column(A: Matrix) -> arb:
    """|A n|."""
    return sum((e * e for e in exact(transposed(A)[2])), arb(0)).sqrt()


def geometric_mean(a: tuple[fmpq, fmpq]) -> tuple[fmpq, fmpq]:
    mean = root(a[0] * a[1])
    return mean, mean


def raised(w: tuple[fmpq, ...]) -> tuple[fmpq, ...]:
    """The direction's mirror image above the horizon."""
    return w[0], w[1], abs(w[2])
