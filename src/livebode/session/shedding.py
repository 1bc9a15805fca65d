"""LoadShedding: what a live run leaves out when it is behind, so that no sample is lost."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from livebode.core import Event, Responses
from livebode.session.fit_budget import FitBudget
from livebode.sources.live import LiveSource

MONITORING_STOPS_S, MONITORING_RESUMES_S = 15.0, 1.0
"""So far behind, monitoring is left out, until the run has caught up to the second."""
ALARM_S, CLEARED_S = 10.0, 1.0
"""So far behind, an event reports it, and so far another one reports that it is over."""
ENDING_S = 0.5
"""A run that was told to end makes no fits while more than this waits."""
REPORT_S = 10.0
"""What was left out is reported at most so often, in seconds of the machine."""


class LoadShedding:
    """Decides what a run has time for: samples and responses always, then monitoring, then fits.

    Of a source whose sender waits nothing is left out, for nothing is lost there, until the run is ended: then
    what still waits is tracked as fast as it can be.

    Parameters
    ----------
    source
        Where the samples come from.
    ended
        Whether the run was told to end.
    budget
        Of the fits.
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
        """Seconds of the machine that wait, where waiting can lose samples or hold up the end."""
        return self._source.waiting_s if not self._source.waits or self._ended() else 0.0

    @property
    def _limited(self) -> bool:
        return not self._source.waits or self._ended()

    def monitors(self) -> bool:
        """Whether there is time for monitoring."""
        behind_s = self.behind_s
        self._monitors = behind_s < (MONITORING_STOPS_S if self._monitors else MONITORING_RESUMES_S)
        return self._monitors

    def to_monitor(self, responses: Responses) -> bool:
        """The same, and what is left out is counted."""
        if not self._monitors:
            self._leave_out("monitoring", len(responses), responses)
        return self._monitors

    @contextmanager
    def fitting(self, responses: Responses) -> Iterator[Responses]:
        """Those that there is time to fit, evenly spread, the newest among them; they are fitted inside."""
        fitted = responses
        if self._limited and len(responses):
            behind_s = np.inf if self._ended() and self.behind_s > ENDING_S else self.behind_s
            rows = self._budget.rows(len(responses), behind_s)
            stride = -(-len(responses) // rows) if rows else 0
            fitted = responses[(len(responses) - 1) % stride :: stride] if rows else responses[0:0]
            self._leave_out("fits", len(responses) - len(fitted), responses)
        with self._budget.spending(len(fitted)):
            yield fitted

    def drain_events(self, sample: int, time_s: float) -> list[Event]:
        """Events at this sample: the backlog, and what was left out."""
        return [*self._backlog(sample, time_s), *self._thinned(sample, time_s, REPORT_S)]

    def finish(self, sample: int, time_s: float) -> list[Event]:
        """Events of what is not reported yet."""
        return self._thinned(sample, time_s, 0.0)

    def _leave_out(self, what: str, rows: int, responses: Responses) -> None:
        if rows:
            self._left_out[what] += rows
            self._since = int(responses.sample[0]) if self._since is None else self._since

    def _backlog(self, sample: int, time_s: float) -> list[Event]:
        behind_s = self.behind_s
        if self._alarm_since_s is None:
            if behind_s < ALARM_S:
                return []
            self._alarm_since_s, self._longest_s = time_s, behind_s
            message = (
                f"tracking is {behind_s:.1f} s behind the machine; fits and monitoring are left out, and samples are "
                "lost when the queue is full; take a longer tracking.hop, fewer lines or fewer axes on this computer"
            )
            return [Event("backlog", sample, time_s, message, {"backlog_s": behind_s})]
        self._longest_s = max(self._longest_s, behind_s)
        if behind_s > CLEARED_S:
            return []
        since_s, self._alarm_since_s = self._alarm_since_s, None
        message = f"tracking has caught up; it was {self._longest_s:.1f} s behind at most"
        details = {"backlog_s": behind_s, "longest_s": self._longest_s, "duration_s": time_s - since_s}
        return [Event("backlog-cleared", sample, time_s, message, details)]

    def _thinned(self, sample: int, time_s: float, every_s: float) -> list[Event]:
        if self._since is None or time_s - self._reported_s < every_s:
            return []
        fits, judged = self._left_out["fits"], self._left_out["monitoring"]
        details = {"fits": fits, "monitoring": judged, "first_response": self._since, "backlog_s": self.behind_s}
        self._reported_s, self._since, self._left_out = time_s, None, {"fits": 0, "monitoring": 0}
        message = f"no time for the fits of {fits} responses" + f" and the monitoring of {judged}" * bool(judged)
        message += "; a simpler model or a longer tracking.hop needs less"
        return [Event("thinned", sample, time_s, message, details)]
