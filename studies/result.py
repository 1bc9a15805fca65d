"""The form of a study and of its results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True)
class Verdict:
    """A target and what was measured; `why` is the reason, also measured, and is printed if the target is missed.

    >>> print(Verdict("dated at the centre, dB", 0.24, 0.28))
    met      dated at the centre, dB: 0.24 ≤ 0.28
    >>> print(Verdict("dated at the centre, dB", 0.3, 0.28, why="the axis moves"))
    missed   dated at the centre, dB: 0.3 > 0.28: the axis moves
    """

    claim: str
    value: float
    target: float
    at_least: bool = False
    why: str = ""

    @property
    def met(self) -> bool:
        return bool(self.value >= self.target if self.at_least else self.value <= self.target)

    @property
    def word(self) -> str:
        return "met" if self.met else "missed"

    def __str__(self) -> str:
        sign = {(True, True): "≥", (True, False): "<", (False, True): "≤", (False, False): ">"}
        line = f"{self.word:8} {self.claim}: {self.value:.3g} {sign[self.at_least, self.met]} {self.target:.4g}"
        return line if self.met else f"{line}: {self.why}"


@dataclass(frozen=True)
class Table:
    """Numbers with a caption; a cell is a number or a word."""

    caption: str
    header: tuple[str, ...]
    rows: list[tuple[Any, ...]]


@dataclass(frozen=True)
class Result:
    """The results of a study. `curves` are for its figure only and are not written."""

    tables: list[Table]
    verdicts: list[Verdict]
    curves: dict[str, Any] = field(default_factory=dict)

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        verdicts = [{**asdict(v), "verdict": v.word, "sentence": str(v)} for v in self.verdicts]
        return {"tables": [asdict(t) for t in self.tables], "verdicts": verdicts}


@dataclass(frozen=True)
class Study:
    """One script: its measurement, its figure, and the content of the paper."""

    name: str
    title: str
    paper: str
    measure: Callable[[bool], Result]  # True: a short version, for tests
    draw: Callable[[Result], Any]
