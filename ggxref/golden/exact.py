"""The oracle's answer for a catalogue entry: the value, or the value with a gradient."""

from typing import Any

from ggxref.golden.catalogue import Function
from ggxref.golden.dual import gradient
from ggxref.oracle import precision


def evaluate(function: Function, values: dict[str, Any], bits: int) -> Any:
    """A ball or nested tuples of balls at `bits` bits: f, or the vector (f, ∂f/∂x_1, …) if the entry is a gradient."""
    inputs = values | function.options
    if not function.derivative:
        return precision.evaluate(function.name, inputs, bits)
    f = precision.lookup(function.name)

    def attempt() -> Any:
        balls = {argument: precision.exact(x) for argument, x in inputs.items()}
        x = balls.pop(function.derivative)
        return gradient(lambda y: f(**balls, **{function.derivative: y}), x)

    return precision.raised(attempt, bits, function.id, inputs)
