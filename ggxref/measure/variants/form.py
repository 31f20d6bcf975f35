"""What a variant is."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Variant:
    """One form of a quantity. `approximate`: it computes something else on purpose, so its error is the model's."""

    name: str
    source: str
    function: Callable
    approximate: bool = False
