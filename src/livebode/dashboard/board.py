"""Board: the states of all axes in the server's thread, their verdicts, operations of requests, and updates."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, field
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from livebode.core import Event, LivebodeError, RunClock, ServerError
from livebode.dashboard.access import Access
from livebode.dashboard.alarm import OPEN, AlarmShelf
from livebode.dashboard.alarm_requests import Act, AlarmRequest, acknowledgement, shelving, unshelving
from livebode.dashboard.notices import Notice
from livebode.dashboard.places import Places
from livebode.dashboard.run_feed import RunFeed
from livebode.dashboard.state import State
from livebode.dataclass import dataclass
from livebode.language import Message, for_page
from livebode.monitoring import PRIORITIES, SOURCE

if TYPE_CHECKING:
    from livebode.dashboard.alarm import AlarmState, AlarmStatus

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
    if hub is None or axis.finished or hub.ending or axis.notices.shelf(SOURCE) is not None:
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


class Pulse:
    """Wakes all that wait for the next update."""

    def __init__(self) -> None:
        self._next = asyncio.Event()

    async def wait_next(self) -> None:
        """Wait for the next update."""
        await self._next.wait()

    def beat(self) -> None:
        """Wake all that wait now."""
        before, self._next = self._next, asyncio.Event()
        before.set()


UPDATES_PER_S = 30.0
_IDLE_S = 0.5  # without a browser nobody sees the difference, and the processor sleeps
_VIEW_EVERY_S = 1.0
_JOBS_MAX = 8  # one thread reads the records: more requests would only wait
T = TypeVar("T")


class Board:
    """Data of the server's thread: a State for each axis, the browsers, and their update rate.

    Parameters
    ----------
    states
        One for each axis.
    viewed
        The record of each state without a hub.
    access
        The access control.
    """

    def __init__(self, states: list[State], viewed: dict[int, RunFeed], access: Access) -> None:
        self.states, self.access = states, access
        self.places = Places(access.open)
        self.pulse = Pulse()
        self._viewed = viewed
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="livebode dashboard reads")
        self._jobs = 0
        self._hurry = asyncio.Event()

    @property
    def names(self) -> list[str]:
        """Names of the axes, in order."""
        return [state.name for state in self.states]

    async def run(self) -> None:
        """Update the states and wake the browsers, at most 30 times per second; less often without browsers."""
        looked = 0.0
        clock = asyncio.get_running_loop().time
        while True:
            began = clock()
            for state in self.states:
                state.refresh()
                state.end_shelves()
            if self._viewed and began - looked >= _VIEW_EVERY_S:
                looked = began
                await self._follow()
            self.pulse.beat()
            pause = 1 / UPDATES_PER_S if self.places else _IDLE_S
            self._hurry.clear()
            try:
                await asyncio.wait_for(self._hurry.wait(), max(0.001, began + pause - clock()))
            except TimeoutError:
                continue

    def pulse_now(self) -> None:
        """Update immediately, because a person acted."""
        self._hurry.set()

    def health(self, state: State) -> dict[str, Any]:
        """Health of an axis and of the dashboard."""
        return state.health() | {
            "verdict": verdict(state).plain(),
            "browsers": len(self.places),
            "refused": self.access.refused,
        }

    def verdicts(self) -> list[dict[str, Any]]:
        """Name and verdict of every axis."""
        return [{"name": state.name, "live": state.live, **verdict(state).plain()} for state in self.states]

    async def elsewhere(self, job: Callable[..., T], *arguments: Any) -> T:
        """Run a long job in another thread; ServerError if too many are waiting."""
        if self._jobs >= _JOBS_MAX:
            raise ServerError("busy", Message("too much of the record is being read"), Message("try again in a moment"))
        self._jobs += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(self._worker, job, *arguments)
        finally:
            self._jobs -= 1

    def act(self, act: Act, asked: AlarmRequest) -> None:
        """Record what a person does with the alarm of an event; ServerError if impossible.

        An acknowledgement includes all earlier events of the same cause.
        """
        state = self.states[asked.axis]
        noticed = state.notices.of(asked.event)
        if noticed is None:
            raise ServerError(
                "event-unknown",
                Message("there is no event {event}", event=repr(asked.event)),
                Message("reload the page"),
                event=asked.event,
            )
        if state.hub is None or state.finished:
            raise ServerError(
                "run-ended",
                Message("the run has ended, and its record is closed"),
                Message("acknowledge events while a run continues"),
                event=asked.event,
            )
        event = _event_of(act, asked, state, *noticed)
        if event is not None and not state.hub.record(event):
            raise ServerError(
                "busy", Message("too many acknowledgements wait to be recorded"), Message("try again in a moment")
            )

    def close(self) -> None:
        """Stop the reading thread."""
        self._worker.shutdown(wait=False, cancel_futures=True)

    async def _follow(self) -> None:
        """Read what another process has recorded since the last call."""
        for axis, viewed in list(self._viewed.items()):
            state = self.states[axis]
            if viewed.finished:
                state.finished = True
                del self._viewed[axis]
                continue
            try:
                items, rows, summary, finished = await self.elsewhere(viewed.more)
            except LivebodeError:
                continue  # it is just being closed; the next look reads it
            state.add(items)
            for model, name, unit, new in rows:
                state.trends.add(model, [name], [unit], new)
            state.renewed(summary, finished)


def _event_of(act: Act, asked: AlarmRequest, state: State, notice: Notice, count: int) -> Event | None:
    """The event that records an action; None if there is nothing to record."""
    cause, position = notice.cause, state.position
    if act == "acknowledge":
        if notice.seen >= count:
            return None
        return acknowledgement(notice, asked.event, count, *position, asked.by, asked.words)
    if notice.alarm is None:
        raise ServerError(
            "no-alarm", Message("this event is not an alarm"), Message("shelve alarms only"), event=asked.event
        )
    if act == "shelve":
        shelf = AlarmShelf(asked.by, round(time.time() + 60 * asked.minutes, 3), asked.words)
        return shelving(cause, shelf, *position, notice)
    return unshelving(cause, *position, notice, asked.by) if state.notices.shelf(cause) is not None else None
