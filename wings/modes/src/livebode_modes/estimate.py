"""OutputOnly: the modes of a machine over time, from its outputs alone, without an input and without responses."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from livebode.configuration import Axis
from livebode.core import Block, Channel, Event, Parameters, SignalError, Stateful
from livebode.language import Message
from livebode.records import PARAMETERS
from livebode.runtime import Document, Estimate, FitResults, Outcome, versions
from livebode_modes.mode_summaries import ModeSummaries
from livebode_modes.mode_tracker import ModeTracker, WindowModes
from livebode_modes.settings import OutputOnlySettings
from livebode_modes.tracks import Tracks

_NO_MODES = Message(
    "no mode was found: no pole is repeated by models of several orders; choose a band around the expected frequency, "
    "or a longer window"
)


class OutputOnly(Estimate):
    """The modes of a recording.

    Parameters
    ----------
    axis
        Its configuration, with [output_only].
    settings
        Outputs, band and window.
    """

    tables: ClassVar = {"parameters": PARAMETERS}
    alone = True
    readiness = detection = None

    def __init__(self, axis: Axis, settings: OutputOnlySettings) -> None:
        self.axis, self.settings = axis, settings
        self._tracker, self._tracks = ModeTracker(settings), Tracks(settings.hops)
        self._summaries = ModeSummaries()
        self._windows: Counter[str] = Counter()
        self._threads = ThreadpoolController()

    @property
    def rate_hz(self) -> float:
        return self.settings.rate_hz

    @property
    def window(self) -> int:
        return self.settings.window

    @property
    def step(self) -> int:
        return self.settings.hop

    @property
    def signals(self) -> list[str]:
        return list(self.settings.outputs)

    @property
    def reference(self) -> str:
        return self.settings.outputs[0]

    @property
    def channels(self) -> list[str]:
        return list(dict.fromkeys([*self.settings.outputs, *filter(None, [self.settings.schedule])]))

    @property
    def counts(self) -> dict[str, int]:
        return self._tracker.counts

    @property
    def parts(self) -> Mapping[str, Stateful]:
        """None: a stopped run begins again."""
        return {}

    def process(self, block: Block) -> list[WindowModes]:
        with self._threads.limit(limits=1, user_api="blas"):  # small matrices: threads would wait for each other
            return self._tracker.process(block, self.run.events.append)

    def valid(self, results: list[WindowModes]) -> NDArray[np.bool_]:
        return np.array([[window.status == "ok"] for window in results], dtype=np.bool_).reshape(-1, 1)

    def documents(self, results: list[WindowModes]) -> Iterator[Document]:
        for window in results:
            self._windows[window.status] += 1
            yield from self._rows(self._tracks.take(window))

    def _rows(self, parts: list[Parameters]) -> Iterator[Document]:
        if parts:
            yield FitResults(tuple(parts))
            for part in parts:
                self._summaries.take(part)

    def judge(self) -> Iterable[Document]:
        if not self._windows:
            raise SignalError(
                "too-short",
                f"the recording has no window of {self.settings.window} samples with what the filter needs",
                "choose a shorter window, or record more",
                window=self.settings.window,
            )
        return self._rows(self._tracks.finish())

    def describe(self, about: Mapping[str, Any], channels: Sequence[Channel]) -> dict[str, Any]:  # noqa: ARG002
        found = self.settings.found() | about["found"]
        return {"output_only": True} | dict(about) | {"found": found, "versions": versions()}

    def summary(self, sample: int, time_s: float) -> tuple[dict[str, Any], list[Event]]:
        run_s, recorded_s = self.run.counts.run_s, self.counts["samples"] / self.rate_hz
        events = self._summaries.harmonic_events(sample, time_s)
        if not self._summaries.modes:
            events.append(Event("no-modes", sample, time_s, _NO_MODES))
        done = self.describe(self.run.about, self.run.source.channels) | {
            "counts": self.counts | {"windows": self._windows.total()},
            "windows": dict(self._windows),
            "speed": {"recorded_s": recorded_s, "run_s": run_s, "times_real_time": recorded_s / run_s},
            "modes": self._summaries.modes,
            "harmonics": self._summaries.harmonics,
        }
        return done, events

    def outcome(self, directory: Path, summary: dict[str, Any]) -> Outcome:
        return Outcome(directory, summary)
