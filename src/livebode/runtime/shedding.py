"""LoadShedding: work that a live run omits when it is behind, so that no sample is lost; time for fits."""

from __future__ import annotations

import logging
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import ClassVar

import numpy as np

from livebode.core import Event, MatrixResponses, Responses
from livebode.language import Message
from livebode.sources.live import LiveSource

SHARE = 0.5
"""Share of one core for the fits of all axes of a process: Python runs one thread at a time, samples have priority."""
CREDIT_S_MAX = 2.0
"""Most processor time that a pause can accumulate."""
RELIEF_FROM_S, RELIEF_TO_S = 2.0, 8.0
"""Backlogs above which fits get less time, and no time."""
_FIRST_ROW_S = 0.02
_logger = logging.getLogger(__name__)


class FitBudget:
    """Processor time for fits: it accumulates with real time, and fits use it; axes of one process share it evenly.

    Parameters
    ----------
    clock, worked
        Real time, and the processor time of the calling thread, in seconds.
    """

    _open: ClassVar[weakref.WeakSet[FitBudget]] = weakref.WeakSet()

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, worked: Callable[[], float] = time.thread_time
    ) -> None:
        self._clock, self._worked = clock, worked
        self._credit_s, self._then = CREDIT_S_MAX, clock()
        self._row_s = _FIRST_ROW_S
        self._exceeded = False

    def rows(self, required: int, behind_s: float) -> int:
        """Number of the `required` responses that there is time to fit, at a backlog of `behind_s`."""
        FitBudget._open.add(self)
        now = self._clock()
        relief = (RELIEF_TO_S - behind_s) / (RELIEF_TO_S - RELIEF_FROM_S)
        share = SHARE * min(max(relief, 0.0), 1.0) / len(FitBudget._open)
        self._credit_s = min(CREDIT_S_MAX, self._credit_s + share * (now - self._then))
        self._then = now
        rows = min(required, self._affordable(share))
        if (rows < required) != self._exceeded:
            self._exceeded = not self._exceeded
            _logger.debug("fit budget %s (%.1f s behind)", "exceeded" if self._exceeded else "suffices", behind_s)
        return rows

    def _affordable(self, share: float) -> int:
        if share <= 0 or self._credit_s <= 0:
            return 0
        # With the largest possible saving one fit is allowed, however long it takes.
        least = int(self._credit_s >= CREDIT_S_MAX)
        return max(least, int(self._credit_s / self._row_s))

    @contextmanager
    def spending(self, rows: int) -> Iterator[None]:
        """Context in which that many responses are fitted."""
        before = self._worked()
        yield
        spent = self._worked() - before
        self._credit_s -= spent
        if rows:
            self._row_s += (spent / rows - self._row_s) / 4


MONITORING_STOPS_S, MONITORING_RESUMES_S = 15.0, 1.0
"""Backlog at which monitoring is omitted, and backlog at which it resumes."""
ALARM_S, CLEARED_S = 10.0, 1.0
"""Backlog that is reported, and backlog at which its end is reported."""
ENDING_S = 0.5
"""Backlog above which a stopping run makes no fits."""
REPORT_S = 10.0
"""Shortest interval between reports of omitted work, in seconds of machine time."""


class LoadShedding:
    """Decides which work a run has time for: always samples and responses, then monitoring, then fits.

    Samples that are read on demand cannot be lost and nothing is omitted, except after a request to end: then the
    backlog is tracked as fast as possible.

    Parameters
    ----------
    source
        Source of the samples.
    ended
        Whether the end was requested.
    budget
        Budget of the fits.
    """

    def __init__(self, source: LiveSource, ended: Callable[[], bool], budget: FitBudget | None = None) -> None:
        self._source, self._ended, self._budget = source, ended, budget or FitBudget()
        self._monitors = True
        self._alarm_since_s: float | None = None
        self._longest_s = 0.0
        self._left_out = {"fits": 0, "monitoring": 0}
        self._since: int | None = None
        self._reported_s = -np.inf

    @property
    def behind_s(self) -> float:
        """Backlog in seconds of machine time, if it can cause lost samples or delay the end."""
        return self._source.waiting_s if self._limited else 0.0

    @property
    def _limited(self) -> bool:
        return not self._source.on_demand or self._ended()

    def monitors(self) -> bool:
        """Whether there is time for monitoring."""
        behind_s = self.behind_s
        self._monitors = behind_s < (MONITORING_STOPS_S if self._monitors else MONITORING_RESUMES_S)
        return self._monitors

    def to_monitor(self, responses: Responses | MatrixResponses) -> bool:
        """The same; omitted work is counted."""
        if not self._monitors:
            self._leave_out("monitoring", len(responses), responses)
        return self._monitors

    @contextmanager
    def fitting(self, responses: Responses) -> Iterator[Responses]:
        """Responses that there is time to fit, evenly spread, including the newest; they are fitted in this context."""
        fitted = responses
        if self._limited and len(responses):
            behind_s = np.inf if self._ended() and self.behind_s > ENDING_S else self.behind_s
            rows = self._budget.rows(len(responses), behind_s)
            stride = -(-len(responses) // rows) if rows else 0
            fitted = responses[(len(responses) - 1) % stride :: stride] if rows else responses[0:0]
            self._leave_out("fits", len(responses) - len(fitted), responses)
        with self._budget.spending(len(fitted)):
            yield fitted

    def take_events(self, sample: int, time_s: float) -> list[Event]:
        """Events at this sample: the backlog, and omitted work."""
        return [*self._backlog(sample, time_s), *self._thinned(sample, time_s, REPORT_S)]

    def finish(self, sample: int, time_s: float) -> list[Event]:
        """Events that are not reported yet."""
        return self._thinned(sample, time_s, 0.0)

    def _leave_out(self, what: str, rows: int, responses: Responses | MatrixResponses) -> None:
        if rows:
            self._left_out[what] += rows
            self._since = int(responses.sample[0]) if self._since is None else self._since

    def _backlog(self, sample: int, time_s: float) -> list[Event]:
        behind_s = self.behind_s
        if self._alarm_since_s is None:
            if behind_s < ALARM_S:
                return []
            self._alarm_since_s, self._longest_s = time_s, behind_s
            full = Message("samples are lost when the queue is full")
            if self._source.waits:
                full = Message("the sender waits when the queue is full")
            message = Message(
                "tracking is {backlog_s:.1f} s behind the machine; fits, and from 15 s on monitoring, are omitted; "
                "{when_full}; {advice}",
                backlog_s=behind_s,
                when_full=full,
                advice=self._source.backlog_cause.advice,
            )
            return [Event("backlog", sample, time_s, message)]
        self._longest_s = max(self._longest_s, behind_s)
        if behind_s > CLEARED_S:
            return []
        since_s, self._alarm_since_s = self._alarm_since_s, None
        message = Message(
            "tracking has caught up; the largest backlog was {longest_s:.1f} s", longest_s=self._longest_s
        )
        details = {"backlog_s": behind_s, "longest_s": self._longest_s, "duration_s": time_s - since_s}
        return [Event("backlog-cleared", sample, time_s, message, details)]

    def _thinned(self, sample: int, time_s: float, every_s: float) -> list[Event]:
        if self._since is None or time_s - self._reported_s < every_s:
            return []
        fits, judged = self._left_out["fits"], self._left_out["monitoring"]
        details = {"fits": fits, "monitoring": judged, "first_response": self._since, "backlog_s": self.behind_s}
        self._reported_s, self._since, self._left_out = time_s, None, {"fits": 0, "monitoring": 0}
        omitted = Message("no time for the fits of {fits} responses", fits=fits)
        if judged:
            omitted = Message(
                "no time for the fits of {fits} responses and the monitoring of {judged}", fits=fits, judged=judged
            )
        message = Message("{omitted}; a simpler model or a longer tracking.hop needs less", omitted=omitted)
        return [Event("thinned", sample, time_s, message, details)]
