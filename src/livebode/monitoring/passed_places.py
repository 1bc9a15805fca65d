"""PassedPlaces: the places of the learned travel that a run passed, and those where no change would be found."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Event, Stage, StatefulBase
from livebode.monitoring._result_sentence import not_passed
from livebode.monitoring.detectability import WINDOWS
from livebode.monitoring.machine import KNOWN_WINDOWS, LearnedMachine

_PERIOD, _PERIOD_MIN = 6000, 300  # judged windows: ten minutes of motion at 0.1 s, and the least of a whole run
_SHARE = 0.1  # of the learned places: the ends of a stroke may be passed too unevenly to be judged


class PassedPlaces(StatefulBase):
    """Information of the windows in each cell of the travel, since the run began and in the newest period.

    A change of a place is found only where the axis passes it. An event reports the places without enough information
    after 6,000 judged windows, and at the end of a run of 300 or more, if they are a tenth of the learned ones and
    others than in the event before.

    Parameters
    ----------
    machine
        The learned machine.
    needed
        Information about the stiffness that a cell needs.
    """

    _stage = Stage("passed-places", 1)
    _STATE = ("_run", "_newest", "_windows", "_run_windows", "_told", "_sample", "_time_s")

    def __init__(self, machine: LearnedMachine, needed: float) -> None:
        self._machine, self._needed = machine, needed
        self._learned = machine.windows >= KNOWN_WINDOWS
        self._run, self._newest = np.zeros((2, len(machine.windows)))
        self._windows = self._run_windows = 0
        self._sample, self._time_s = 0, 0.0  # of the newest window
        self._told = np.zeros(len(machine.windows), dtype=bool)

    def step(self, cell: int, information: float, sample: int, time_s: float) -> list[Event]:
        """Process a judged window in this cell; one of a motion that shows nothing anywhere does not count."""
        if WINDOWS * information < self._needed:
            return []
        self._sample, self._time_s = sample, time_s
        self._run[cell] += information
        self._newest[cell] += information
        self._windows += 1
        self._run_windows += 1
        return self._report() if self._windows >= _PERIOD else []

    def finish(self) -> list[Event]:
        """An event at the end of a run."""
        return self._report() if self._windows >= _PERIOD_MIN else []

    @property
    def missing_m(self) -> list[list[float]]:
        """Ranges of learned positions without enough information in the whole run, from and to; none of a short run."""
        missing = self._missing(self._run)
        return self._ranges(missing) if self._run_windows >= _PERIOD_MIN else []

    def _report(self) -> list[Event]:
        missing = self._missing(self._newest)
        self._newest[:], self._windows = 0.0, 0
        if not missing.any() or np.array_equal(missing, self._told):
            return []
        self._told = missing
        ranges = self._ranges(missing)
        return [Event("places-not-monitored", self._sample, self._time_s, not_passed(ranges), {"places_m": ranges})]

    def _missing(self, information: Floats) -> NDArray[np.bool_]:
        """Learned cells with less information than needed; none if they are few."""
        missing = self._learned & (information < self._needed)
        return missing & (np.count_nonzero(missing) >= _SHARE * np.count_nonzero(self._learned))

    def _ranges(self, cells: NDArray[np.bool_]) -> list[list[float]]:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], cells, [False]]).astype(int)))
        ends_m = (self._machine.model.low_m + self._machine.way_m * edges / len(cells)).tolist()
        return [[low, high] for low, high in zip(ends_m[::2], ends_m[1::2])]
