"""What was monitored: the time, and the places of the learned travel, and what was not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Event, Stage, StatefulBase, moment
from livebode.language import Message
from livebode.monitoring import evidence as word
from livebode.monitoring._result_sentence import not_passed
from livebode.monitoring.accuracy import WINDOWS, ChangeAccuracy, detectable, information_needed
from livebode.monitoring.machine import KNOWN_WINDOWS, LearnedMachine

WEAK, INVALID = "weak", "invalid"
"""Why judged windows do not suffice: little excitation for the noise. Why a row of a table has no weight."""
_IDLE = {word.SLOW, word.UNEVEN}
_WHY = {
    word.SLOW: Message("the axis is at standstill or slower than learned"),
    word.UNEVEN: Message("the speed is not steady"),
    word.DISTURBED: Message("samples are missing or disturbed"),
    word.UNEXCITED: Message("the input has no excitation"),
    WEAK: Message("the excitation is too weak for the noise"),
    INVALID: Message("the responses are not valid"),
}
THE_MACHINE = Message("the machine")
_NOT_COVERED = Message("the baseline does not cover what the machine does")
_NAMED = 4
_TAIL = 0.1  # of a stretch: a shorter one at the end of a run is usual
_LARGEST = 0.7  # of a logarithm: a linear model describes no larger change


class MonitoredTime(StatefulBase):
    """Divides a run into stretches of windows that together show a change of every component, or do not.

    A stretch ends as soon as its windows have the information that each component needs (`information_needed`); all of
    its time is monitored, because a change that begins in it would be found by the next ones. A stretch that is not
    complete after 600 windows ends too: the components without enough information were not monitored. An event
    reports when that begins, when other components are concerned, and when it ends. Time in which the axis does not
    move steadily is idle: nobody has to do anything about it.

    Parameters
    ----------
    names
        Of the components.
    learned
        Mean information of a learned window, (components,).
    accuracy, threshold
        As for `detectable`.
    whole
        Name of all components together.
    """

    _stage = Stage("monitored-time", 1)
    _STATE = (
        "_seen", "_blind", "_idle", "_unseen", "_information", "_windows", "_share", "_waited", "_judged", "_begin_s",
        "_reasons", "_told", "_told_idle", "_sample", "_time_s",
    )  # fmt: skip

    def __init__(
        self,
        names: Sequence[str],
        learned: Floats,
        accuracy: ChangeAccuracy,
        threshold: float,
        whole: Message = THE_MACHINE,
    ) -> None:
        size = len(names)
        self._whole = whole
        self._names, self._accuracy, self._threshold = tuple(names), accuracy, threshold
        self.needed = information_needed(learned, accuracy, threshold)
        """Information that a stretch needs, (components,); infinite where not even the learned windows have any."""
        self._known = np.isfinite(self.needed)
        self._seen = self._idle = self._blind = 0  # judged windows; without any component: of an idle axis, and others
        self._unseen = np.zeros(size, dtype=np.int64)
        self._information, self._windows = np.zeros(size), np.zeros(size, dtype=np.int64)  # of monitored time
        self._told = np.zeros(size, dtype=bool)  # components of the newest event
        self._told_idle = False
        self._sample, self._time_s = 0, 0.0  # of the newest window
        self._begin()

    def _begin(self) -> None:
        self._share, self._waited, self._judged = np.zeros(len(self._names)), 0, 0
        self._begin_s = 0.0
        self._reasons: dict[str, int] = {}

    def step(self, share: Floats | None, reason: str, sample: int, time_s: float) -> list[Event]:
        """Process a window.

        Parameters
        ----------
        share
            Its information as a share of `needed`, (components,), infinite where it needs none; None: it is not judged.
        reason
            Why it is not.
        """
        self._sample, self._time_s = sample, time_s
        if not self._waited:
            self._begin_s = time_s
        self._waited += 1
        if share is not None:
            self._share += np.where(self._known, share, np.inf)
            self._judged += 1
        self._reasons[reason] = self._reasons.get(reason, 0) + 1
        seen = self._share >= 1
        if seen.all():
            self._count(~seen)
            ended = [self._again()] if self._told.any() else []
            self._told[:], self._told_idle = False, False
            self._begin()
            return ended
        return self._close(~seen) if self._waited >= WINDOWS else []

    def finish(self) -> list[Event]:
        """Close the last stretch, with an event if it is long, or if nothing was ever monitored.

        One that is too short to tell counts as monitored.
        """
        if not self._waited:
            return []
        missing = self._share < 1
        never = not self._windows.any() and self._reason(missing) in _WHY  # else `baseline-unknown` has told it
        if (never or self._long) if missing.all() else self._waited >= WINDOWS / 2:
            return self._close(missing)
        self._count(np.zeros_like(missing))
        self._begin()
        return []

    @property
    def _long(self) -> bool:
        """Whether the present stretch takes longer than is usual at the end of a run."""
        return self._waited >= WINDOWS * _TAIL

    @property
    def judged(self) -> int:
        """Judged windows of monitored time."""
        return self._seen + (0 if self._long and (self._share < 1).all() else self._judged)

    def summary(self, step_s: float) -> dict[str, Any]:
        """Entries of run.json for windows of this length."""
        total = self._information * np.minimum(1.0, WINDOWS / np.maximum(self._windows, 1))
        return {
            "judged_s": self.judged * step_s,
            "idle_s": self._idle * step_s,
            "not_monitored_s": self._blind * step_s,
            "not_monitored": {name: windows * step_s for name, windows in self._by_name(self._unseen) if windows},
            "detectable_percent": self._percent(total),
        }

    def _close(self, missing: NDArray[np.bool_]) -> list[Event]:
        self._count(missing)
        idle = self._reason(missing) in _IDLE
        changed = bool(np.any(missing != self._told)) or idle != self._told_idle
        event = [self._not_monitored(missing)] if changed and missing.any() else []
        self._told, self._told_idle = missing, idle
        self._begin()
        return event

    def _count(self, missing: NDArray[np.bool_]) -> None:
        """Add the stretch, in which these components are not monitored."""
        if missing.any() and self._reason(missing) in _IDLE:
            self._idle += self._waited
        else:
            self._unseen[missing] += self._waited
            self._blind += self._waited if missing.all() else 0
        if not missing.all():
            self._seen += self._judged
        known = ~missing & self._known & np.isfinite(self._share)
        self._information[known] += self._share[known] * self.needed[known]
        self._windows[known] += self._waited

    def _reason(self, missing: NDArray[np.bool_]) -> str:
        """The most frequent one of the stretch; that of judged windows if only some components are missing."""
        return max(self._reasons, key=lambda reason: self._reasons[reason]) if missing.all() else WEAK

    def _percent(self, information: Floats) -> dict[str, float | None]:
        """The change of each component that is found with this information; None: no change."""
        change = detectable(information, self._accuracy, self._threshold)
        return {name: 100 * size if size < _LARGEST else None for name, size in self._by_name(change)}

    def _by_name(self, values: NDArray[Any]) -> list[tuple[str, Any]]:
        """The largest value of each name: both parts of a line have one."""
        largest: dict[str, Any] = {}
        for name, value in zip(self._names, values.tolist()):
            largest[name] = max(largest.get(name, value), value)
        return list(largest.items())

    def _not_monitored(self, missing: NDArray[np.bool_]) -> Event:
        reason, names = self._reason(missing), [name for name, lacks in self._by_name(missing) if lacks]
        sizes = self._percent(np.where(self._known, self._share * self.needed, 0.0))
        detectable = {name: sizes[name] for name in names}
        message = Message(
            "Not monitored since {since}: {parts} ({why}).",
            since=moment(self._begin_s),
            parts=self._whole if missing.all() else _listed([Message(name) for name in names]),
            why=_WHY.get(reason, _NOT_COVERED),
        )
        known = [
            Message("{part} from {percent:.2g} %", part=Message(name), percent=size)
            for name, size in detectable.items()
            if size is not None
        ]
        if known:
            more = Message("Only larger changes are found: {changes}.", changes=_listed(known))
            message = Message.sentences([message, more])
        kind = "idle" if reason in _IDLE else "not-monitored"
        details = {"what": names, "reason": reason, "since_s": self._begin_s, "detectable_percent": detectable}
        return Event(kind, self._sample, self._time_s, message, details)

    def _again(self) -> Event:
        again = [name for name, told in self._by_name(self._told) if told]
        message = Message("Monitored again since {at}.", at=moment(self._time_s))
        return Event("monitored-again", self._sample, self._time_s, message, {"what": again})


def _listed(parts: list[Message]) -> list[Message]:
    return with_more(parts[:_NAMED], len(parts) - _NAMED)


def with_more(parts: list[Message], more: int) -> list[Message]:
    """The parts that are named, and how many more there are."""
    return [*parts, Message("and {count} more", count=more)] if more > 0 else parts


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
