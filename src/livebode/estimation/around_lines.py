"""What a Tracker and a SpectraTracker have in common: the line stage behind them, and their snapshots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from livebode.core import Event, Responses
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
    """Whatever feeds a LineStage. A subclass sets these parts, and gives out `_nothing` when it has no responses."""

    _lines: LineStage
    _watch: W
    _parts: Mapping[str, Part]
    _nothing: Responses | None = None

    @property
    def _identity(self) -> str:
        """What a snapshot must have been taken of to be gone on with."""
        raise NotImplementedError

    @property
    def counts(self) -> dict[str, int]:
        """How many samples came, were missing, and how many samples or spectra were left out for each reason."""
        return self._watch.counts

    def found(self) -> dict[str, Any]:
        """What the responses stand on, as plain data for a record: rate, window, lines, hop."""
        return self._lines.found()

    def excitation_power(self) -> Floats:
        """Mean |R|² of the reference at each line over the remembered windows, shape (lines,); NaN before the first."""
        return self._lines.excitation_power()

    def repeatability(self) -> Floats:
        """Share of the reference's power that repeats from period to period, shape (lines,); see `LineStage`."""
        return self._lines.repeatability()

    def drain_events(self) -> list[Event]:
        """Events since the last call: what is missing, what was left out, and how lines were judged."""
        return sorted(self._watch.drain() + self._lines.drain(), key=lambda event: event.sample)

    def finish(self) -> Responses | None:
        """What is held back at the end: nothing, every response has come; None where nothing came."""
        return self._nothing

    def snapshot(self) -> bytes:
        """Everything that the next result depends on, exact; see `restore`."""
        return snapshots.pack({name: part.state() for name, part in self._parts.items()}, self._identity)

    def restore(self, snapshot: bytes) -> None:
        """Go on from a snapshot of one with the same settings.

        Raises
        ------
        SignalError
            If the snapshot is damaged or belongs to other settings; all is then as it was.
        """
        for name, state in snapshots.unpack(snapshot, self._identity).items():
            self._parts[name].load(state)
