"""Parts of a baseline in its file: checked access, the tables, and the name of its version."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import BaselineError, counted
from livebode.dataclass import dataclass
from livebode.language import Message, recorded
from livebode.monitoring.accuracy import ChangeAccuracy
from livebode.monitoring.table import ScheduleTable


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


def table_plain(table: ScheduleTable) -> dict[str, Any]:
    """Plain data of it, for JSON."""
    return {
        "what": table.what,
        "names": [name.plain() if isinstance(name, Message) else name for name in table.names],
        "low": table.low,
        "step": table.step,
        "still": table.still,
        "ways": ["back", "still", "forth"],
        "mean_re": as_list(table.mean.real),
        "mean_im": as_list(table.mean.imag),
        "covariance": as_list(table.covariance),
        "variance": as_list(table.variance),
        "count": table.count.tolist(),
        "accuracy": accuracy_plain(table.accuracy),
    } | ({"unit": table.unit} if table.unit else {})


def table_of(data: BaselinePart) -> ScheduleTable:
    """From plain data; BaselineError where it is damaged."""
    real, imaginary = data.array("mean_re", 3, known=False), data.array("mean_im", 3, known=False)
    if real.shape != imaginary.shape:
        raise data.wrong("mean_im", "not of the shape of mean_re")
    mean = np.empty(real.shape, dtype=np.complex128)
    mean.real, mean.imag = real, imaginary
    return ScheduleTable(
        data.text("what"),
        data.texts("names"),
        data.number("low"),
        data.number("step"),
        data.number("still"),
        mean,
        data.array("covariance", 5, known=False),
        data.array("variance", 3, known=False),
        data.array("count", 2, least=0).astype(np.int64),
        accuracy_of(data.part("accuracy")),
        data.text("unit") if data.has("unit") else "",
    )


def accuracy_plain(known: ChangeAccuracy) -> dict[str, Any]:
    """Plain data of it, for JSON."""
    return {name: as_list(getattr(known, name)) for name in ChangeAccuracy.__dataclass_fields__}


def accuracy_of(data: BaselinePart) -> ChangeAccuracy:
    """From plain data; BaselineError where it is damaged."""
    return ChangeAccuracy(*(data.array(name, 1, least=0, known=False) for name in ChangeAccuracy.__dataclass_fields__))


def as_list(array: NDArray[Any]) -> Any:
    """Nested lists, with None for NaN and infinity."""
    plain = array.astype(object)
    plain[~np.isfinite(array)] = None
    return plain.tolist()


@dataclass(frozen=True)
class BaselineVersion:
    """One version of a baseline.

    Attributes
    ----------
    id
        The first 16 hexadecimal digits of the SHA-256 of what was learned: two files with one id judge alike.
    learned
        When, ISO 8601 in UTC.
    runs
        The runs that it was learned from.
    reason
        Why it was learned; empty where nobody stated it.
    """

    id: str
    learned: str
    runs: tuple[str, ...]
    reason: str


def file_of(baseline: Path, version: str | None) -> Path:
    """The file of this version: the retained one, if there is one; else the baseline, the newest version."""
    retained = None if version is None else retained_file(baseline, version)
    return baseline if retained is None or not retained.exists() else retained


def retained_file(baseline: Path, version: str) -> Path:
    """The file of an earlier version of this baseline.

    >>> retained_file(Path("press/healthy.json"), "3f2a91d05c77b64e").as_posix()
    'press/healthy.history/3f2a91d05c77b64e.json'
    """
    return baseline.with_suffix(".history") / f"{version}.json"
