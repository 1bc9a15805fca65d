"""Counts of a run in addition to the tracker's: responses, statistics of each signal, and processing time."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from livebode.core import Stage, decode, encode, restore_parts
from livebode.preparation import ChannelCheck
from livebode.runtime.event_groups import EventGroups

if TYPE_CHECKING:
    from livebode.runtime.continuing import PreviousRun

_STAGE = Stage("run-counts", 1)


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

    def take(self, valid: NDArray[np.bool_], tracked_s: float) -> None:
        """Count the results of a step by where they are valid, and its processing time in seconds."""
        self.responses += len(valid)
        self.invalid += int(np.count_nonzero(~valid.all(axis=tuple(range(1, valid.ndim)))))
        self.valid_lines += int(np.count_nonzero(valid))
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
        own = {"before": self._before, "judged": self.judged, "left_out_samples": self.left_out_samples}
        parts = {"check": self.check.snapshot(), "groups": self.groups.snapshot()}
        return encode(_STAGE, numbers | {"run_s": self.run_s} | own | parts)

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot; StateError, and nothing has changed, if that cannot be restored."""
        state = decode(_STAGE, snapshot)
        restore_parts({"check": self.check, "groups": self.groups}, state)
        for name in self._STATE:
            setattr(self, name, state[name])
        self._started += self.run_s - state["run_s"]
        self.judged, self._before = state["judged"], state["before"]
        self.left_out_samples = state["left_out_samples"]
