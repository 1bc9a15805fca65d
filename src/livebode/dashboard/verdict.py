"""The verdict on an axis: the one thing that a person must know of it now."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from livebode.core import RunClock
from livebode.dashboard.alarm import OPEN
from livebode.language import for_page
from livebode.monitoring import PRIORITIES, SOURCE

if TYPE_CHECKING:
    from livebode.dashboard.alarm import AlarmState, AlarmStatus
    from livebode.dashboard.notices import Notice
    from livebode.dashboard.state import State

Tone = Literal["alarm", "check", "ok", "open"]


@dataclass(frozen=True)
class AxisVerdict:
    """What a person must know of an axis now; the page makes a sentence of it.

    Attributes
    ----------
    tone
        ``alarm``: a difference from the baseline is active; ``check``: a person must look; ``ok``; ``open``: nothing
        can be concluded.
    word
        Which sentence: ``change``, ``shelved``, ``silent``, ``disconnected``, ``behind``, ``alarms``, ``active``,
        ``suppressed``, ``not-monitored``, ``healthy``, ``no-baseline``, ``not-judged`` or ``not-begun``.
    since_s, since_unix_s
        Second of the run, and seconds since 1970, since which it applies; None if not known.
    seconds
        Duration of the silence, or the backlog.
    facts
        Of the alarm, as in `AlarmStatus`.
    message
        Of the alarm's newest event.
    count
        Number of alarms of this word.
    cause
        Of the alarm.
    """

    tone: Tone
    word: str
    since_s: float | None = None
    since_unix_s: float | None = None
    seconds: float | None = None
    facts: dict[str, Any] = field(default_factory=dict)
    message: str = ""
    count: int = 0
    cause: str = ""

    def plain(self) -> dict[str, Any]:
        """Plain data for the page."""
        return asdict(self) | {"message": str(self.message), "words": for_page(self.message)}


def verdict(axis: State) -> AxisVerdict:
    """The most important of: a difference from the baseline, states of source or machine, other alarms, baseline."""
    if axis.quantities is None:
        return AxisVerdict("open", "not-begun")
    clock, alarms = RunClock(axis.clock), list(axis.notices.alarms())
    changes = [alarm for alarm in alarms if alarm[0].cause.partition(":")[0] == "change" and alarm[1].active]
    if shown := [alarm for alarm in changes if alarm[2] in ("unacknowledged", "acknowledged")]:
        return _of_alarm("alarm", "change", shown, clock)
    if (silence := _silence(axis)) is not None:
        return silence
    if shown := [alarm for alarm in alarms if alarm[2] in OPEN]:
        return _of_alarm("check", "alarms", shown, clock)
    if (since_s := axis.notices.suppressed_s) is not None:
        return AxisVerdict("open", "suppressed", since_s, clock.unix_s(since_s))
    if changes:
        return _of_alarm("check", "shelved", changes, clock)
    if shown := [alarm for alarm in alarms if alarm[2] == "acknowledged"]:
        return _of_alarm("check", "active", shown, clock)
    if not axis.has_baseline:
        return AxisVerdict("open", "no-baseline")
    if (since_s := axis.notices.unmonitored_s) is not None:
        return AxisVerdict("open", "not-monitored", since_s, clock.unix_s(since_s))
    return AxisVerdict("ok", "healthy") if axis.judged else AxisVerdict("open", "not-judged")


def _of_alarm(
    tone: Tone, word: str, shown: list[tuple[Notice, AlarmStatus, AlarmState]], clock: RunClock
) -> AxisVerdict:
    """Verdict of the most important of these alarms; among equal ones the oldest."""
    notice, alarm, _ = min(shown, key=lambda alarm: (PRIORITIES.index(alarm[1].kind.priority), alarm[1].since_s))
    since_s = alarm.since_s
    return AxisVerdict(
        tone, word, since_s, clock.unix_s(since_s), None, alarm.facts, notice.words, len(shown), notice.cause
    )  # fmt: skip


def _silence(axis: State) -> AxisVerdict | None:
    """The source does not send, or tracking is behind; None if all is well, or the axis is a record."""
    hub = axis.hub
    if hub is None or axis.finished or axis.notices.shelf(SOURCE) is not None:
        return None
    silent_s, stale = axis.silence()
    health = hub.health
    if health is not None and not health.connected:
        return AxisVerdict("check", "disconnected", seconds=silent_s, since_unix_s=time.time() - silent_s)
    if stale:
        return AxisVerdict("check", "silent", seconds=silent_s, since_unix_s=time.time() - silent_s)
    if (backlog_s := axis.backlog_s()) is not None:
        return AxisVerdict("check", "behind", seconds=backlog_s)
    return None
