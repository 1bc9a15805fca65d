"""What all trackers have in common: their interface, counters, the effective time, and checks of their input."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats, Integers
from livebode.core import Block, Emit, Event, Responses, SignalError, Stage, Stateful, StatefulBase, ignore, same_rate
from livebode.estimation.spectra import SpectraRows
from livebode.estimation.tracker_settings import Settings
from livebode.language import Message


class Centre(StatefulBase):
    """Scheduling signal at the centre of each window, (N − 1)/2 samples before its newest sample.

    For an even N the centre is between two samples, and the result is their mean.
    """

    _stage = Stage("centre", 1)
    _STATE = ("_past",)

    def __init__(self, window: int) -> None:
        self._early, self._late = window // 2, (window - 1) // 2
        self._past = np.full(self._early, np.nan)

    def restart(self) -> None:
        self._past[:] = np.nan

    def at(self, schedule: Floats | None, position: NDArray[np.int64]) -> Floats:
        """Schedule at the centres of the windows that end at these positions of the next stretch, `schedule`.

        NaN without a schedule.
        """
        if schedule is None:
            return np.full(position.size, np.nan)
        known = np.concatenate([self._past, schedule])
        self._past = known[known.size - self._early :]
        return np.asarray((known[position] + known[position + self._early - self._late]) / 2)


_KINDS = {
    "non-finite": Message("a sample is not finite"),
    "implausible": Message("a sample is more than 1e8 times larger than all in the period before"),
    "spike": Message("a sample differs strongly from the previous periods and is excluded"),
}


class StreamCounters(StatefulBase):
    """Counts and Events of a stream of Blocks.

    Events are appended to `events`. `kinds` are reasons for exclusion, `also` further counts, and `last` the sample at
    which each kind was before the first one.
    """

    _STATE = ("_next", "_last", "counts")

    def __init__(self, events: list[Event], kinds: Iterable[str], last: int, also: tuple[str, ...] = ()) -> None:
        self._kinds = tuple(kinds)
        self._next = -1
        self._last = dict.fromkeys(self._kinds, last)
        self.counts = dict.fromkeys(("samples", "gaps", "missing", *also, *self._kinds), 0)
        self._events = events

    def _report(self, kind: str, block: Block, sample: int, message: str, **details: int) -> None:
        self._events.append(Event(kind, sample, block.origin_s + sample / block.rate_hz, message, dict(details)))


W = TypeVar("W", bound=StreamCounters)


class InputStatistics(StreamCounters):
    """Counts and Events of a stream of Blocks."""

    _stage = Stage("sample-counts", 1)

    def __init__(self, events: list[Event], window: int) -> None:
        super().__init__(events, _KINDS, -window)
        self._window = window

    def starts(self, block: Block) -> bool:
        """Whether this block does not follow the previous samples; adds an Event where samples are missing."""
        first = self._next < 0
        missing = 0 if first else block.start - self._next
        if missing < 0:
            raise SignalError(
                "repeated",
                f"samples {block.start} to {self._next - 1} came twice",
                "let blocks follow each other: drop what repeats",
                first_sample=block.start,
                last_sample=self._next - 1,
            )
        gap = not first and (missing > 0 or block.gap)
        self._next = block.stop
        self.counts["samples"] += len(block)
        if gap:
            self.counts["gaps"] += 1
            self.counts["missing"] += missing
            message = Message(
                "an unknown number of samples is missing before sample {at_sample}", at_sample=block.start
            )
            if missing:
                message = Message(
                    "{missing_samples} samples are missing before sample {at_sample}",
                    missing_samples=missing,
                    at_sample=block.start,
                )
            self._exclude("gap", block, block.start, message, missing_samples=missing)
        return first or gap

    def count(self, block: Block, rows: SpectraRows) -> None:
        """Count the excluded samples; one Event for all that are within a window of each other."""
        excluded = {"non-finite": rows.not_finite, "implausible": rows.implausible, "spike": rows.spikes}
        new: list[tuple[int, str]] = []
        for kind, position in excluded.items():
            if not position.size:
                continue
            self.counts[kind] += position.size
            number = block.start + position
            apart = np.diff(number, prepend=self._last[kind]) >= self._window
            self._last[kind] = int(number[-1])
            new += [(int(sample), kind) for sample in number[apart]]
        for sample, kind in sorted(new):
            self._exclude(kind, block, sample, _KINDS[kind])

    def _exclude(self, kind: str, block: Block, sample: int, cause: str, **details: int) -> None:
        message = Message(
            "{what}; responses are invalid until a window of {window} samples is complete again",
            what=cause,
            window=self._window,
        )
        self._report(kind, block, sample, message, **details)


class Follower(Stateful, Protocol):
    """Turns the samples of a run into responses: a Tracker, or a MotionCorrection, which delays some of them.

    For a drive that sends spectra it is a SpectraTracker.
    """

    settings: Settings

    @property
    def counts(self) -> dict[str, int]: ...

    def found(self) -> dict[str, Any]: ...

    def process(self, block: Block, emit: Emit = ignore, /) -> Responses: ...

    def finish(self, emit: Emit = ignore, /) -> Responses | None: ...

    def set_aside(self, spans: Integers, /) -> None: ...

    def excitation_power(self) -> Floats: ...

    def repeatability(self) -> Floats: ...


class ResponseStage(Protocol):
    """What makes responses of spectra, or of samples: a LineStage or a NonPeriodicStage."""

    def found(self) -> dict[str, Any]: ...

    def excitation_power(self) -> Floats: ...

    def repeatability(self) -> Floats: ...


class StreamEstimator(StatefulBase, Generic[W]):
    """Base of the classes that feed a stage. A subclass sets these parts and returns `_nothing` if it has none."""

    _lines: ResponseStage
    _watch: W
    _parts: Mapping[str, StatefulBase]
    _events: list[Event]
    _nothing: Responses | None = None

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of received and missing samples, and of samples or spectra that were excluded for each reason."""
        return self._watch.counts

    def found(self) -> dict[str, Any]:
        """The basis of the responses as plain data for a record: rate, window, lines, hop."""
        return self._lines.found()

    def excitation_power(self) -> Floats:
        """Mean |R|² of the reference at each line over the remembered windows, shape (lines,); NaN before the first."""
        return self._lines.excitation_power()

    def repeatability(self) -> Floats:
        """Share of the reference's power that repeats from period to period, shape (lines,); see `LineStage`."""
        return self._lines.repeatability()

    def set_aside(self, _spans: Integers, /) -> None:
        """See `Tracker.set_aside`; no effect where a response does not depend on the windows before it."""

    def finish(self, _emit: Emit = ignore, /) -> Responses | None:
        """Remaining responses at the end: always an empty batch; None where no samples came."""
        return self._nothing

    def _ends_with(self, responses: Responses) -> None:
        """What `finish` returns after these responses: an empty batch with their unit."""
        if self._nothing is None or self._nothing.unit != responses.unit:
            self._nothing = responses[0:0]

    def _state(self) -> dict[str, Any]:
        return dict(self._parts)

    def _load(self, state: dict[str, Any]) -> None:
        for name, part in self._parts.items():
            part.restore(state[name])


def signals_of(block: Block, settings: Settings) -> tuple[Floats, Floats | None]:
    """Signals of a Block in the order of the settings' roles, (signals, samples), and its schedule, if there is one.

    SignalError if it has no samples, another rate than the lines, or not the channels.
    """
    if not same_rate(block.rate_hz, settings.lines.rate_hz):
        raise SignalError(
            "rate-differs",
            f"the block has {block.rate_hz:g} samples per second, but the lines are for {settings.lines.rate_hz:g}",
            "make the lines for the block's rate",
            rate_hz=block.rate_hz,
            lines_rate_hz=settings.lines.rate_hz,
        )
    if not len(block):
        raise SignalError("empty", "the block is empty", "leave it out")
    data = block.rows([settings.channel(role) or "" for role in settings.roles])
    return data, block[settings.schedule] if settings.schedule else None
