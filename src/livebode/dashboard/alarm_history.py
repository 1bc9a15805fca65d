"""History: what happened to the alarms of a run, in bounded memory."""

from __future__ import annotations

from collections import deque
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from livebode.language import for_page

What = Literal[
    "raised", "returned", "acknowledged", "shelved", "unshelved", "suppressed", "unsuppressed", "chattering"
]  # fmt: skip
ROWS_MAX = 1000
_MESSAGE_MAX = 400


@dataclass(frozen=True)
class Transition:
    """One change of an alarm.

    Attributes
    ----------
    number, version
        Of the row, and of its last change.
    time_s
        Time of the run.
    cause, kind, words
        Of the alarm, and of the event that caused the change.
    what
        What happened.
    state
        State of the alarm after it.
    by, comment
        Person, and what they wrote.
    count
        Number of events: more than one where a chattering alarm, or a flood, is one row.
    """

    number: int
    version: int
    time_s: float
    cause: str
    kind: str
    words: str
    what: What
    state: str
    by: str = ""
    comment: str = ""
    count: int = 1


def limited(message: str, letters: int) -> str:
    """The message, or the beginning of its text if it is longer."""
    return message if len(message) <= letters else message[:letters]


class AlarmHistory:
    """The newest transitions, oldest first. While an alarm chatters, all its transitions share a row."""

    def __init__(self) -> None:
        self._rows: deque[Transition] = deque(maxlen=ROWS_MAX)
        self._numbered = 0
        self._chattering: dict[str, int] = {}  # number of the row of each chattering cause

    def add(self, version: int, what: What, time_s: float, chatters: bool = False, **facts: Any) -> None:
        """Add a transition; `chatters`: of an alarm that chatters."""
        cause = facts["cause"]
        if not chatters:
            self._chattering.pop(cause, None)
        at = self._place(self._chattering.get(cause)) if chatters else None
        count = facts.pop("count", 1)
        facts["words"] = limited(facts["words"], _MESSAGE_MAX)
        if at is not None:
            known = self._rows[at]
            count = known.count + (count if what == "raised" else 0)
            self._rows[at] = replace(known, version=version, time_s=time_s, count=count, **facts)
            return
        self._numbered += 1
        if chatters:
            what = "chattering"
            self._chattering[cause] = self._numbered
        self._rows.append(Transition(self._numbered, version, time_s, what=what, count=count, **facts))

    def since(self, version: int) -> list[dict[str, Any]]:
        """Rows that are new or changed after `version`, oldest first."""
        return [
            asdict(row) | {"message": str(row.words), "words": for_page(row.words)}
            for row in self._rows
            if row.version > version
        ]

    def _place(self, number: int | None) -> int | None:
        """Index of a row that is still there."""
        if number is None or not self._rows or number < self._rows[0].number:
            return None
        return number - self._rows[0].number
