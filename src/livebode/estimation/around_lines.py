"""Common part of Tracker and SpectraTracker: the line stage that follows them, and their snapshots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from livebode.core import Emit, Event, Responses, ignore
from livebode.estimation import snapshots
from livebode.estimation.counted import Counted
from livebode.estimation.line_stage import LineStage

Floats = NDArray[np.float64]
W = TypeVar("W", bound=Counted)


class Part(Protocol):
    """Something with a state of its own."""

    def state(self) -> dict[str, NDArray[np.generic]]: ...

    def load(self, state: dict[str, NDArray[np.generic]]) -> None: ...


class AroundLines(Generic[W]):
    """Base of the classes that feed a LineStage. A subclass sets these parts and returns `_nothing` if it has none."""

    _lines: LineStage
    _watch: W
    _parts: Mapping[str, Part]
    _events: list[Event]
    _nothing: Responses | None = None

    @property
    def _identity(self) -> str:
        """Identity that a snapshot must have to be restored."""
        raise NotImplementedError

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

    def finish(self, _emit: Emit = ignore, /) -> Responses | None:
        """Remaining responses at the end: always an empty batch; None where no samples came."""
        return self._nothing

    def _hand_over(self, emit: Emit) -> None:
        """Emit the events that its parts found in this batch: missing and excluded samples, and verdicts on lines."""
        for event in sorted(self._events, key=lambda event: event.sample):
            emit(event)
        self._events.clear()

    def snapshot(self) -> bytes:
        """Everything that the next result depends on, exact; see `restore`."""
        return snapshots.pack({name: part.state() for name, part in self._parts.items()}, self._identity)

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot of a tracker with the same settings.

        Raises
        ------
        SignalError
            If the snapshot is damaged or belongs to other settings; the state is then unchanged.
        """
        for name, state in snapshots.unpack(snapshot, self._identity).items():
            self._parts[name].load(state)
