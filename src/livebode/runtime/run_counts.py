"""Counts of a run in addition to the tracker's: responses, statistics of each signal, and processing time."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping

import numpy as np

from livebode.core import Responses
from livebode.preparation.checks import ChannelCheck
from livebode.runtime.continuing import PreviousRun
from livebode.runtime.event_groups import EventGroups


class RunCounts:
    """Counts over a whole run, also over a continued one.

    Parameters
    ----------
    check
        Checks the signals.
    started
        `time.perf_counter()` at the beginning.
    before
        The run that this one continues.

    Attributes
    ----------
    stop
        Number of the sample after the last tracked one.
    groups
        The events of each cause.
    left_out_samples
        End of the transient at the beginning of a live run; None without one.
    handed_out
        The `stop` at which delayed results were published.
    judged
        Whether the signals of a live run were judged at its beginning.
    """

    def __init__(self, check: ChannelCheck, started: float, before: PreviousRun | None = None) -> None:
        self.check, self.groups = check, EventGroups()
        self._before = {} if before is None else before.counts
        self.responses = self.invalid = self.valid_lines = 0
        self.stop = self.handed_out = 0 if before is None else before.sample
        self.judged = False
        self.left_out_samples: int | None = None
        self.tracked_s = 0.0
        self._started = started

    @property
    def run_s(self) -> float:
        return time.perf_counter() - self._started

    def take(self, responses: Responses, tracked_s: float) -> None:
        """Count the results of a step, and the tracker's processing time in seconds."""
        self.responses += len(responses)
        self.invalid += int(np.count_nonzero(~responses.valid.all(axis=1)))
        self.valid_lines += int(np.count_nonzero(responses.valid))
        self.tracked_s += tracked_s

    def judge(self) -> None:
        """From now the signals are judged."""
        self.judged = True

    def counts(self, tracker: Mapping[str, int]) -> dict[str, int]:
        """The tracker's counts in this run."""
        return {name: count - self._before.get(name, 0) for name, count in tracker.items()}

    _STATE = ("responses", "invalid", "valid_lines", "stop", "handed_out", "tracked_s")

    def snapshot(self) -> bytes:
        """State as bytes; see `restore`."""
        numbers = {name: getattr(self, name) for name in self._STATE}
        parts = {"before": self._before, "judged": self.judged, "left_out_samples": self.left_out_samples}
        parts |= {"check": self.check.state(), "groups": self.groups.state()}
        return json.dumps(numbers | {"run_s": self.run_s} | parts).encode()

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot."""
        state = json.loads(snapshot)
        for name in self._STATE:
            setattr(self, name, state[name])
        self._started -= state["run_s"]
        self.judged = state.get("judged", True)  # an older record without this entry is not judged again
        self._before = state["before"]
        self.check.load(state["check"])
        self.groups.load(state.get("groups", {}))  # an older record has no groups
        self.left_out_samples = state.get("left_out_samples")
