"""DeliveryThread: a thread that sends events and results to one receiver, and repeats what it did not take."""

from __future__ import annotations

import logging
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from livebode.configuration import PublishSection
from livebode.core import LivebodeError, PublishError
from livebode.language import Message
from livebode.publishing.feed import AxisFeed
from livebode.publishing.messages import AxisValues, EventMessage
from livebode.publishing.outbox import Outbox
from livebode.publishing.sink import SinkConnection
from livebode.sources.live import Pauses

DOWN_AFTER = 2
"""Failures in succession after which a receiver is reported as down."""
_REPORT_S = 60.0
_SLEEP_S = 3600.0
_logger = logging.getLogger(__name__)
Report = Callable[[Sequence[AxisFeed], str, str, dict[str, Any]], None]


class DeliveryThread:
    """Sends to one receiver in a thread of its own.

    Events are sent in their order, each until the receiver has it (`Outbox`). Results are sent at most every
    `interval_s`; only the newest ones, so that a round that fails is missed and counted. After a failure the thread
    waits, 0.1 s at first and 30 s at last.

    Parameters
    ----------
    section
        The section of the receiver.
    sink
        The receiver.
    outbox
        Events that wait; None for a receiver without events.
    report
        Called with feeds, kind, sentence and details when the receiver is down, again up, or events were lost.
    """

    def __init__(self, section: PublishSection, sink: SinkConnection, outbox: Outbox | None, report: Report) -> None:
        self.section, self._sink, self._outbox, self._report = section, sink, outbox, report
        self.feeds: tuple[AxisFeed, ...] = ()
        """The axes whose results are sent."""
        self.delivered: Counter[str] = Counter()
        self.refused: Counter[str] = Counter()
        self.rounds = self._missed = 0
        self._wake = threading.Event()
        self._ends_s = float("inf")
        self._pauses, self._failures, self._retry_s = Pauses(), 0, 0.0
        self._down_s: float | None = None
        self._events_s = self._reported_s = float("-inf")
        self._values_s = time.monotonic() - section.interval_s
        self._first_failure_s, self._dropped = 0.0, 0
        self._work_left, self._final = outbox is not None, False
        self._thread = threading.Thread(target=self._work, name=f"livebode {section.label}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def offer(self, event: EventMessage) -> None:
        """Take an event, without waiting."""
        if self._outbox is not None:
            self._outbox.put(self.section.label, event)

    def wake(self) -> None:
        """Events are in the outbox."""
        self._work_left = self._outbox is not None
        self._wake.set()

    def end(self, patience_s: float) -> None:
        """Request the end: everything that waits is sent once more, for at most so long."""
        self._ends_s = time.monotonic() + patience_s
        self._retry_s, self._final = float("-inf"), bool(self.section.sent_values)
        self.wake()

    def join(self) -> None:
        """Wait for its end, at most until the time of `end` and one answer."""
        self._thread.join(max(0.0, self._ends_s - time.monotonic()) + self.section.timeout_s + 1.0)

    def waiting(self) -> dict[str, int]:
        """Number of events that wait, by axis."""
        return {} if self._outbox is None else self._outbox.waiting(self.section.label)

    def counts(self, axis: str) -> dict[str, int]:
        """What was delivered of an axis, and what was not."""
        label = self.section.label
        dropped = 0 if self._outbox is None else self._outbox.dropped[label, axis]
        return {
            "events_delivered": self.delivered[axis],
            "events_waiting": self.waiting().get(axis, 0),
            "events_refused": self.refused[axis],
            "events_dropped": dropped,
            "rounds": self.rounds,
            "rounds_missed": self._missed + self._missed_since(time.monotonic()),
        }

    def _work(self) -> None:
        while not self._ended:
            self._wake.wait(max(0.0, self._next_s() - time.monotonic()))
            self._wake.clear()
            now_s = time.monotonic()
            if now_s < self._retry_s:
                continue
            try:
                done = self._send_events(now_s) | self._send_values(now_s)
            except LivebodeError as error:  # of the configuration, if a file with a secret was removed
                self._failed(error)
            except Exception as error:
                _logger.exception("%s: internal error", self.section.label)
                self._failed(PublishError("refused", f"internal error: {error!r}"))
            else:
                if done:
                    self._succeeded()
        self._sink.close()

    @property
    def _ended(self) -> bool:
        left = self._work_left or self._final
        return time.monotonic() >= self._ends_s or (self._ending and not left)

    @property
    def _ending(self) -> bool:
        return self._ends_s != float("inf")

    def _next_s(self) -> float:
        """When something is due again."""
        found = [float("inf")]
        if self._work_left:
            found.append(self._events_s + self._sink.pause_s)
        if self.section.sent_values:
            found.append(self._values_s + self.section.interval_s)
        return min(self._ends_s, max(min(found), self._retry_s), time.monotonic() + _SLEEP_S)

    def _send_events(self, now_s: float) -> bool:
        """Send events that wait; whether something was sent."""
        if self._outbox is None or (now_s < self._events_s + self._sink.pause_s and not self._ending):
            return False
        label, sent = self.section.label, False
        self._work_left = False  # `wake` sets it again for what comes after the last look
        try:
            while rows := self._outbox.oldest(label, self._sink.events_at_once):
                self._hand_over([event for _, event in rows])
                self._outbox.remove([number for number, _ in rows])
                self._events_s, sent = time.monotonic(), True
                if self._sink.pause_s and not self._ending:
                    self._work_left = True
                    break
        except Exception:
            self._work_left = True
            raise
        self._report_dropped()
        return sent

    def _hand_over(self, events: Sequence[EventMessage]) -> None:
        try:
            self._sink.send_events(events)
        except PublishError as error:
            if error.code != "publish.not-taken":
                raise
            self._not_taken(events, error)
        else:
            self.delivered.update(event.axis for event in events)

    def _send_values(self, now_s: float) -> bool:
        """Send the newest results if they are due; whether something was sent."""
        due = self.section.sent_values and (self._final or now_s >= self._values_s + self.section.interval_s)
        if not due:
            return False
        values = [found for feed in self.feeds if (found := feed.values()) is not None]
        if values:
            self._sink.send_values([chosen(one, self.section.sent_values) for one in values])
            self.rounds += 1
            self._missed += self._missed_since(now_s)
        self._values_s, self._final = now_s, False
        return bool(values)

    def _missed_since(self, now_s: float) -> int:
        return max(0, int((now_s - self._values_s) / self.section.interval_s) - 1) if self.section.sent_values else 0

    def _failed(self, error: LivebodeError) -> None:
        now_s = time.monotonic()
        if not self._failures:
            self._first_failure_s = now_s
        self._failures += 1
        self._final = False  # at the end, results are tried once; events as long as there is time
        self._retry_s = now_s + self._pauses.next_s()
        _logger.info("%s: %s", self.section.label, error)
        if self._failures >= DOWN_AFTER and self._down_s is None:
            self._down_s = self._first_failure_s
            waits = (
                Message("events wait on disk, retrying with increasing delay")
                if self._outbox
                else Message("retrying with increasing delay")
            )
            self._tell(
                "sink-down",
                Message(
                    "{receiver} does not take messages: {reason}; {retry}",
                    receiver=self.section.label,
                    reason=error.message,
                    retry=waits,
                ),
            )

    def _succeeded(self) -> None:
        self._failures = 0
        self._pauses.reset()
        if self._down_s is not None:
            down_s, self._down_s = time.monotonic() - self._down_s, None
            self._tell(
                "sink-up",
                Message(
                    "{receiver} takes messages again, after {down_s:.0f} s", receiver=self.section.label, down_s=down_s
                ),
            )

    def _not_taken(self, events: Sequence[EventMessage], error: PublishError) -> None:
        self.refused.update(event.axis for event in events)
        count = sum(self.refused.values())
        if time.monotonic() - self._reported_s >= _REPORT_S:
            self._reported_s = time.monotonic()
            message = Message(
                "{receiver} refused {refused} events permanently: {reason}",
                receiver=self.section.label,
                refused=count,
                reason=error.message,
            )
            self._tell("sink-refused", message, count=count)

    def _report_dropped(self) -> None:
        assert self._outbox is not None
        dropped = sum(n for (sink, _), n in self._outbox.dropped.copy().items() if sink == self.section.label)
        if dropped > self._dropped and time.monotonic() - self._reported_s >= _REPORT_S:
            self._dropped, self._reported_s = dropped, time.monotonic()
            message = Message(
                "{lost} events for {receiver} were lost: too many waited", lost=dropped, receiver=self.section.label
            )
            self._tell("sink-full", message, count=dropped)

    def _tell(self, kind: str, message: str, **details: Any) -> None:
        self._report(self.feeds, kind, message, {"sink": self.section.label} | details)


def chosen(values: AxisValues, parts: Sequence[str]) -> AxisValues:
    """Only these parts of the results."""
    return replace(
        values,
        measurements=values.measurements if "parameters" in parts else (),
        response=values.response if "responses" in parts else None,
        status=values.status if "status" in parts else {},
    )
