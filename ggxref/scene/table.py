"""A TOML table that knows where it stands, and readers of its values: every error says file, key, what was got, and why."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ggxref.errors import InputError

REQUIRED = object()
NUMBER = (int, float)


class Table:
    """A TOML table that knows where it stands, and which of its keys were asked for."""

    def __init__(self, path: Path, name: str, values: Any):
        self.path, self.name, self.asked = path, name, set()
        if not isinstance(values, Mapping):
            raise InputError(f"{path}: {name} = {values!r}; need a table")
        self.values = values

    def bad(self, key: str, why: str) -> InputError:
        return InputError(f"{self.path}: {self._full(key)} = {self.values[key]!r}; {why}")

    def _full(self, key: str) -> str:
        return f"{self.name}.{key}" if self.name else key

    def has(self, key: str) -> bool:
        return key in self.values

    def take(self, key: str, read: Callable[["Table", str], Any], default: Any = REQUIRED) -> Any:
        self.asked.add(key)
        if key in self.values:
            return read(self, key)
        if default is REQUIRED:
            raise InputError(f"{self.path}: {self._full(key)} is missing; there is no default for it")
        return default

    def table(self, key: str) -> "Table":
        self.asked.add(key)
        return Table(self.path, self._full(key), self.values.get(key, {}))

    def close(self) -> None:
        """No key is left that nobody asked for."""
        for key in self.values:
            if key not in self.asked:
                known = ", ".join(sorted(self.asked))
                raise InputError(f"{self.path}: {self._full(key)} is not a known key here; known are {known}")


def number(
    low: float | int = -math.inf, high: float | int = math.inf, *, above: bool = False
) -> Callable[[Table, str], float]:
    """A reader of a finite number in [low, high], or with `above` in (low, high]."""
    bracket = "(" if above else "["
    need = "a finite number" if low == -math.inf else f"a number in {bracket}{low:g}, {high:g}]"

    def read(table: Table, key: str) -> float:
        value = table.values[key]
        good = isinstance(value, NUMBER) and not isinstance(value, bool) and math.isfinite(value)
        if not good or not low <= value <= high or (above and value == low):
            raise table.bad(key, f"need {need}")
        return float(value)

    return read


def whole(low: int, high: int) -> Callable[[Table, str], int]:
    def read(table: Table, key: str) -> int:
        value = table.values[key]
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            raise table.bad(key, f"need a whole number from {low} to {high}")
        return value

    return read


def text(*allowed: str) -> Callable[[Table, str], str]:
    def read(table: Table, key: str) -> str:
        value = table.values[key]
        if not isinstance(value, str) or (allowed and value not in allowed):
            raise table.bad(key, f"need {'text' if not allowed else 'one of ' + ', '.join(allowed)}")
        return value

    return read


def vector(size: int, *, nonzero: bool = False) -> Callable[[Table, str], tuple[float, ...]]:
    def read(table: Table, key: str) -> tuple[float, ...]:
        value = table.values[key]
        good = isinstance(value, list) and len(value) == size
        if not good or not all(isinstance(x, NUMBER) and math.isfinite(x) for x in value):
            raise table.bad(key, f"need {size} finite numbers")
        if nonzero and not any(value):
            raise table.bad(key, "a direction or an edge of length 0 points nowhere")
        return tuple(float(x) for x in value)

    return read
