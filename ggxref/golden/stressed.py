"""A case seen from what it stresses: its quantities by their kind, with the exact result."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product as pairs
from typing import Any

from flint import fmpq

from ggxref.golden.cases import Case
from ggxref.golden.linear import dot
from ggxref.golden.rounding import Format


@dataclass(frozen=True)
class Stressed:
    """A case with its exact result: fractions, or None where a component is infinite."""

    case: Case
    result: tuple[fmpq | None, ...]

    @property
    def fmt(self) -> Format:
        return self.case.fmt

    def given(self, *quantities: str) -> list[Any]:
        return [value for q in quantities for value in self.case.quantity(q)]

    def seen(self) -> list[Any]:
        """Directions of light and view, not micronormals."""
        return self.given("wi", "wo")

    def against(self) -> Iterator[tuple[Any, Any]]:
        """Each such direction with each micronormal."""
        return pairs(self.seen(), self.given("wm"))

    def indices(self) -> fmpq | None:
        """n_i / n_o of a transparent interface."""
        if k := self.given("k"):  # a metal's index is the inverse ratio
            return None if k[0] else 1 / self.given("eta")[0]
        if eta := self.given("eta"):
            return eta[0]
        n = self.given("n_i") + self.given("n_o")
        return n[0] / n[1] if len(n) == 2 else None

    def cosines(self) -> list[fmpq]:
        """Squared cosines of incidence on the microfacet."""
        return [c * c for c in self.given("cos_i")] + [
            dot(w, m) ** 2 / (dot(w, w) * dot(m, m)) for w, m in pairs(self.given("wi"), self.given("wm"))
        ]
