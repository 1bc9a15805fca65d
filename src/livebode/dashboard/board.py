"""Board: the states of all axes in the server's thread, the operations of requests on them, and their updates."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from livebode.core import Event, LivebodeError, ServerError
from livebode.dashboard.access import Access
from livebode.dashboard.alarm import AlarmShelf
from livebode.dashboard.alarm_requests import Act, AlarmRequest, acknowledgement, shelving, unshelving
from livebode.dashboard.notices import Notice
from livebode.dashboard.places import Places
from livebode.dashboard.run_feed import RunFeed
from livebode.dashboard.state import State
from livebode.dashboard.verdict import verdict
from livebode.language import Message


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
_IDLE_S = 0.5
_VIEW_EVERY_S = 1.0
_JOBS_MAX = 8
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
