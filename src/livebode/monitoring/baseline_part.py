"""Part: one table of a baseline's file, whose values are checked when they are read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import BaselineError, counted
from livebode.language import recorded


@dataclass(frozen=True)
class BaselinePart:
    """Values by name; `file` and `path` are for the message where one is invalid."""

    file: str
    path: str
    data: Any

    def part(self, name: str) -> BaselinePart:
        """A table in it."""
        return BaselinePart(self.file, f"{self.path}{name}.", self._typed(name, dict, "a table"))

    def parts(self, name: str) -> list[BaselinePart]:
        """A list of tables in it."""
        rows = self._typed(name, list, "a list")
        return [BaselinePart(self.file, f"{self.path}{name}[{i}].", row) for i, row in enumerate(rows)]

    def text(self, name: str) -> str:
        return str(self._typed(name, str, "a text"))

    def texts(self, name: str) -> tuple[str, ...]:
        values = self._typed(name, list, "a list of texts")
        values = [(recorded(value, "") or None) if isinstance(value, dict) else value for value in values]
        if not all(isinstance(value, str) for value in values):
            raise self.wrong(name, "not a list of texts")
        return tuple(values)

    def truth(self, name: str) -> bool:
        return bool(self._typed(name, bool, "true or false"))

    def whole(self, name: str) -> int:
        value = self.number(name)
        if value != int(value):
            raise self.wrong(name, "not a whole number")
        return int(value)

    def number(self, name: str, least: float = -np.inf) -> float:
        """A finite number, above `least`."""
        value = self.value(name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise self.wrong(name, "not a number")
        if value <= least:
            raise self.wrong(name, f"not above {least:g}")
        return float(value)

    def array(self, name: str, dimensions: int, least: float = -np.inf, known: bool = True) -> NDArray[np.float64]:
        """An array of numbers not below `least`; without `known` a value may be null, which becomes NaN."""
        value = self.value(name)
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            raise self.wrong(name, "not an array of numbers") from None
        if array.ndim != dimensions or (known and not np.isfinite(array).all()):
            raise self.wrong(name, f"not an array of numbers in {counted(dimensions, 'dimension')}")
        if np.any(array < least):
            raise self.wrong(name, f"below {least:g} in one place", float(np.nanmin(array)))
        return array

    def has(self, name: str) -> bool:
        """Whether there is a value of this name."""
        return isinstance(self.data, dict) and name in self.data

    def value(self, name: str) -> Any:
        if not isinstance(self.data, dict):
            raise self._damaged(self.path[:-1], "is not a table")
        if name not in self.data:
            raise self._damaged(f"{self.path}{name}", "is missing")
        return self.data[name]

    def wrong(self, name: str, why: str, value: Any = None) -> BaselineError:
        shown = repr(self.data[name] if value is None else value)
        shown = shown if len(shown) <= 40 else shown[:37] + "…"
        return self._damaged(f"{self.path}{name}", f"= {shown} is {why}")

    def _damaged(self, key: str, why: str) -> BaselineError:
        message = f"the baseline {self.file!r} is damaged: {key} {why}"
        return BaselineError("damaged", message, "learn it again", path=self.file, key=key)

    def _typed(self, name: str, kind: type, words: str) -> Any:
        value = self.value(name)
        if not isinstance(value, kind):
            raise self.wrong(name, f"not {words}")
        return value
