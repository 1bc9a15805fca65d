"""Readiness: whether the machine is ready, so that its responses are assessed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.configuration import ReadyCondition
from livebode.core import Block, Event, Responses, Stage, StatefulBase
from livebode.estimation import NOTHING, contains
from livebode.language import Message

SUPPRESSED, ENDED = "suppressed", "suppression-ended"


class Readiness(StatefulBase):
    """Follows the state of the machine, marks responses that contain a sample at which it was not ready, and reports.

    Alarms of the response are suppressed (ISA 18.2: suppressed by design) from the first sample that is not ready until
    the machine was ready for a whole window and the reach. So a state that changes faster is one interruption with two
    events. Samples that are missing leave the state as it was. The results do not depend on how the samples are cut
    into Blocks.

    Parameters
    ----------
    condition
        At which samples the machine is ready.
    window
        Samples that a response is computed from.
    reach
        Samples before and after the window that also affect a response: those that a motion correction fits together.
    """

    _stage = Stage("readiness", 1)

    def __init__(self, condition: ReadyCondition, window: int, reach: int = 0) -> None:
        self.condition, self._window, self._reach = condition, window, reach
        self.spans: NDArray[np.int64] = NOTHING
        """First sample of each interruption, and the one after its last, as far as later responses may contain it."""
        self._begin = 0  # sample since which it is not ready
        self._since: float | None = None
        """Time since which it is not ready; None where it is."""
        self._value = float("nan")  # at which it is not ready
        self._reported = True
        self._suppressed, self._next = 0, -1
        self._left_out = 0

    def take(self, block: Block) -> list[Event]:
        """Events of these samples."""
        values = block[self.condition.channel]
        events = [] if self._reported or self._since is None else [self._begun(block, 0)]
        if self._since is not None and (block.gap or block.start > self._next):
            self.spans[-1, 1] = block.start
        edges = np.flatnonzero(np.diff(~self.condition.holds(values), prepend=False, append=False))
        for first, last in block.start + edges.reshape(-1, 2):
            events += self._ended_before(int(first), block)
            if self._since is None:
                self._begin, self._since = int(first), block.origin_s + int(first) / block.rate_hz
                self._value = float(values[first - block.start])
                events.append(self._begun(block, int(first) - block.start))
            self._interrupt(int(first), int(last))
        self._next = block.stop
        return events + self._ended_before(block.stop, block)

    def _interrupt(self, first: int, last: int) -> None:
        """Add an interruption; with one before it that is less than a window apart, as one."""
        if len(self.spans) and first - self.spans[-1, 1] < self._window:
            self.spans[-1, 1] = last
        else:
            self.spans = np.vstack([self.spans, [first, last]])

    def mark(self, responses: Responses) -> Responses:
        """The responses with the flag whether the machine was ready; each call has later responses than the last."""
        if not len(responses) or not len(self.spans):
            return responses
        left_out = self.left_out(responses.first - self._reach, responses.sample + self._reach)
        return replace(responses, ready=~left_out)

    def left_out(self, first: NDArray[np.int64], last: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which responses that depend on the samples first … last are left out; as `mark`, and they are counted."""
        found = contains(self.spans, first, last)
        if len(first) and len(self.spans):
            later = self.spans[:, 1] > first[-1]
            later[-1:] |= self._since is not None
            self.spans = self.spans[later]
            self._left_out += int(np.count_nonzero(found))
        return found

    def take_over(self, before: Readiness) -> None:
        """Continue with the machine's state in another run, which reports it again."""
        self.spans, self._since, self._next = before.spans.copy(), before._since, before._next
        self._begin = before._next
        self._value, self._reported = before._value, self._since is None

    def summary(self, rate_hz: float) -> dict[str, Any]:
        """Entries of run.json: seconds and responses that are not assessed, and whether the end of the run is."""
        open_samples = 0 if self._since is None else self._next - self._begin
        suppressed_s = (self._suppressed + open_samples) / rate_hz
        at_end = {"suppressed_at_end": self._since is not None}
        return {"channel": self.condition.channel, "suppressed_s": suppressed_s, "responses": self._left_out} | at_end

    def _begun(self, block: Block, at: int) -> Event:
        self._reported = True
        channel, value, sample = self.condition.channel, self._value, block.start + at
        message = Message(
            "{of_channel} is {of_value:g}: the machine is not ready; its response is not assessed, and alarms of "
            "the response are suppressed",
            of_channel=repr(channel),
            of_value=value,
        )
        details = {"channel": channel, "value": value if np.isfinite(value) else None, "since_s": self._since}
        return Event(SUPPRESSED, sample, block.origin_s + sample / block.rate_hz, message, details)

    def _ended_before(self, sample: int, block: Block) -> list[Event]:
        """The end of the suppression, if it is before this sample: the last one of the first window that is ready."""
        if self._since is None:
            return []
        last = int(self.spans[-1, 1])
        end = last + self._window + self._reach - 1
        if end >= sample:
            return []
        since_s, self._since = self._since, None
        self._suppressed += end - self._begin
        time_s = block.origin_s + end / block.rate_hz
        message = Message(
            "the machine is ready again: it was ready for a whole window of {window} samples; its response is "
            "assessed again, after {after_s:.3g} s",
            window=self._window,
            after_s=time_s - since_s,
        )
        details = {"channel": self.condition.channel, "suppressed_since_s": since_s, "ready_sample": last}
        return [Event(ENDED, end, time_s, message, details)]

    @property
    def _identity(self) -> str:
        return repr((self.condition, self._window, self._reach))

    def _state(self) -> dict[str, Any]:
        counts = {"begin": self._begin, "suppressed": self._suppressed, "next": self._next, "left_out": self._left_out}
        now = {"since": self._since, "value": self._value, "reported": self._reported}
        return {"spans": self.spans} | now | counts

    def _load(self, state: dict[str, Any]) -> None:
        spans = np.asarray(state["spans"], dtype=np.int64)
        self.spans = spans.reshape(-1, 2).copy()
        since = state["since"]
        self._since, self._reported = None if since is None else float(since), bool(state["reported"])
        self._value = float(state["value"])
        self._suppressed, self._next = int(state["suppressed"]), int(state["next"])
        self._begin, self._left_out = int(state["begin"]), int(state["left_out"])
