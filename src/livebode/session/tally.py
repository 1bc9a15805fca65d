"""What a run counts beside the tracker: responses, what each signal held, and the time that it took."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping

import numpy as np

from livebode.core import Responses
from livebode.session.checks import ChannelCheck
from livebode.session.continuing import Before
from livebode.session.event_groups import EventGroups


class Tally:
    """Counts over a whole run, also over one that was gone on with.

    Parameters
    ----------
    check
        What looks at the signals.
    started
        `time.perf_counter()` at the beginning.
    before
        The run that this one goes on from.

    Attributes
    ----------
    stop
        Number of the sample behind the last one that was followed.
    groups
        The events of each cause.
    left_out_samples
        Where the transient that a live run began with ends; None without one.
    handed_out
        The `stop` at which what was held back had been handed out.
    judged
        Whether the signals of a live run were judged at its beginning.
    """

    def __init__(self, check: ChannelCheck, started: float, before: Before | None = None) -> None:
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
        """What came of a step, and the seconds that it took the tracker."""
        self.responses += len(responses)
        self.invalid += int(np.count_nonzero(~responses.valid.all(axis=1)))
        self.valid_lines += int(np.count_nonzero(responses.valid))
        self.tracked_s += tracked_s

    def judge(self) -> None:
        """From here on the signals are judged."""
        self.judged = True

    def counts(self, tracker: Mapping[str, int]) -> dict[str, int]:
        """What the tracker has counted in this run."""
        return {name: count - self._before.get(name, 0) for name, count in tracker.items()}

    _STATE = ("responses", "invalid", "valid_lines", "stop", "handed_out", "tracked_s")

    def snapshot(self) -> bytes:
        """All of it as bytes; see `restore`."""
        numbers = {name: getattr(self, name) for name in self._STATE}
        parts = {"before": self._before, "judged": self.judged, "left_out_samples": self.left_out_samples}
        parts |= {"check": self.check.state(), "groups": self.groups.state()}
        return json.dumps(numbers | {"run_s": self.run_s} | parts).encode()

    def restore(self, snapshot: bytes) -> None:
        """Go on from a snapshot."""
        state = json.loads(snapshot)
        for name in self._STATE:
            setattr(self, name, state[name])
        self._started -= state["run_s"]
        self.judged = state.get("judged", True)  # a record from before this was stored is not judged again
        self._before = state["before"]
        self.check.load(state["check"])
        self.groups.load(state.get("groups", {}))  # a record from before there were groups has none
        self.left_out_samples = state.get("left_out_samples")
