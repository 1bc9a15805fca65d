"""Alarms of a fleet: which are acknowledged and shelved, by whom; the states are those of ISA 18.2, as of one axis."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any, get_args

import numpy as np

from livebode.dashboard import MINUTES_MAX, NAME_MAX, TEXT_MAX, Act, AlarmShelf, AlarmState
from livebode.monitoring import ALARMS
from livebode_plant.fleet.status_message import ACTIVE, NOT_READY

CONDITIONS: tuple[AlarmState, ...] = (
    "normal", "unacknowledged", "returned", "acknowledged", "suppressed", "shelved",
)  # fmt: skip
"""The states by their numbers in arrays."""
NORMAL, UNACKNOWLEDGED, RETURNED, ACKNOWLEDGED, SUPPRESSED, SHELVED = range(len(CONDITIONS))
ACT_BYTES_MAX = 4096
_COUNT_MAX = 1 << 32
Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class FleetAct:
    """What a person did with the alarm of an axis: all pages of a fleet get it, and a new one the newest of each axis.

    Attributes
    ----------
    act, path
        What, and the axis.
    raised, raised_s
        How often the alarm had been raised, and when last, by the clock of its worker: those are acknowledged.
    by, words
        Person, and comment or reason.
    until_s, at_s
        End of the shelf, and when the person acted, seconds since 1970.
    """

    act: Act
    path: str
    raised: int
    raised_s: int
    by: str = ""
    words: str = ""
    until_s: float = 0.0
    at_s: float = 0.0

    def to_bytes(self) -> bytes:
        """This act as JSON."""
        return json.dumps(asdict(self), ensure_ascii=False).encode()

    @classmethod
    def of(cls, data: bytes) -> FleetAct | None:
        """The act in these bytes; None if they are none."""
        try:
            if len(data) > ACT_BYTES_MAX:
                return None
            found = cls(**json.loads(data))
        except (ValueError, TypeError, RecursionError):
            return None
        return found if found._valid() else None

    def _valid(self) -> bool:
        texts = ((self.path, ACT_BYTES_MAX), (self.by, NAME_MAX), (self.words, TEXT_MAX))
        times = (self.until_s, self.at_s)
        return (
            self.act in get_args(Act)
            and all(isinstance(text, str) and len(text) <= most and text.isprintable() for text, most in texts)
            and all(type(n) is int and 0 <= n < _COUNT_MAX for n in (self.raised, self.raised_s))
            and all(isinstance(t, int | float) and not isinstance(t, bool) and isfinite(t) for t in times)
            and 0 <= self.until_s <= self.at_s + 60 * MINUTES_MAX + 1
        )


class FleetAlarms:
    """Acknowledgements and shelves of axes by their rows."""

    def __init__(self) -> None:
        self.version = 0
        self._seen = np.zeros(0, np.uint32)
        self._seen_s = np.zeros(0, np.uint32)
        self._until_s = np.zeros(0)
        self._shelves: dict[int, AlarmShelf] = {}
        self._acknowledged: dict[int, FleetAct] = {}

    def apply(self, act: FleetAct, row: int) -> None:
        """Take an act on the axis of a row."""
        self._grow(row + 1)
        self.version += 1
        if act.act == "acknowledge":
            self._seen[row], self._seen_s[row] = act.raised, act.raised_s
            self._acknowledged[row] = act
        elif act.act == "shelve":
            self._until_s[row] = act.until_s
            self._shelves[row] = AlarmShelf(act.by, act.until_s, act.words)
        else:
            self._until_s[row] = 0.0
            self._shelves.pop(row, None)

    def conditions(self, status: Array, kinds: list[str], now_s: float) -> Array:
        """Number in `CONDITIONS` of each row, shape (rows,)."""
        self._grow(len(status))
        raised, active = status["raised"], (status["flags"] & ACTIVE) > 0
        of_response = np.array([kind in ALARMS and ALARMS[kind].of_response for kind in kinds])[status["kind"]]
        # An axis that begins again counts from zero: its next alarm must not pass for an acknowledged one.
        new = (self._seen[: len(status)] < raised) | ((self._seen_s[: len(status)] < status["raised_s"]) & (raised > 0))
        found = np.where(new, np.where(active, UNACKNOWLEDGED, RETURNED), np.where(active, ACKNOWLEDGED, NORMAL))
        found[active & of_response & ((status["flags"] & NOT_READY) > 0)] = SUPPRESSED
        found[(found != NORMAL) & (self._until_s[: len(status)] > now_s)] = SHELVED
        return found.astype(np.uint8)

    def plain(self, row: int, now_s: float) -> dict[str, Any]:
        """Who acknowledged the alarm of a row, and its shelf, for the page."""
        act, shelf = self._acknowledged.get(row), self._shelves.get(row)
        found: dict[str, Any] = {"by": act.by, "comment": act.words} if act is not None else {"by": "", "comment": ""}
        return found | {"shelf": shelf.plain() if shelf is not None and shelf.until_s > now_s else None}

    def _grow(self, rows: int) -> None:
        if rows > len(self._seen):
            more = max(1024, rows, 2 * len(self._seen)) - len(self._seen)
            self._seen = np.concatenate([self._seen, np.zeros(more, np.uint32)])
            self._seen_s = np.concatenate([self._seen_s, np.zeros(more, np.uint32)])
            self._until_s = np.concatenate([self._until_s, np.zeros(more)])
