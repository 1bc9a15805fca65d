"""Estimate: what a run computes from its samples. The loop knows this interface only.

A kind of estimate is a subclass in a file of its own and a row in `livebode.estimates.ESTIMATES`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from livebode.analysis import Overview
from livebode.configuration import Axis
from livebode.core import Block, Channel, ClockKind, Event, Responses, SignalError, Stateful, nearest_name
from livebode.dataclass import dataclass
from livebode.records import ColumnTable
from livebode.runtime.change_detection import BaselineComparison
from livebode.runtime.documents import Document
from livebode.runtime.run_counts import RunCounts

if TYPE_CHECKING:
    from livebode.core import MatrixResponses, Response
    from livebode.fitting import Fit
    from livebode.runtime.feed import Feed, Source
    from livebode.runtime.joining import WaitingSpectra
    from livebode.runtime.readiness import Readiness
    from livebode.runtime.recorder import Recorder
    from livebode.runtime.shedding import LoadShedding
    from livebode.sources.live import LiveSource

SEEN_AGAIN_BYTES = 256 << 20
"""Previous results for a picture of a continued run, in addition to new ones."""


@dataclass(frozen=True, eq=False)
class RunContext:
    """The run of an estimate.

    Attributes
    ----------
    feed
        Its samples.
    about
        Entries of run.json that do not depend on the estimate.
    counts
        Counts of the run.
    recorder
        Its record.
    events
        Receives events of the samples that are processed; they are published after the results.
    """

    feed: Feed
    about: dict[str, Any]
    counts: RunCounts
    recorder: Recorder
    events: list[Event]

    @property
    def source(self) -> Source:
        """Source of the samples."""
        return self.feed.source


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a run.

    Attributes
    ----------
    directory
        Its directory.
    summary
        As in run.json.
    overview
        A thinned copy of its responses; None of an estimate without a single response.
    fit
        The newest valid fit.
    average
        The average of a run that averages; its result.
    matrix
        The newest matrix of a matrix run.
    """

    directory: Path
    summary: dict[str, Any]
    overview: Responses | None = None
    fit: Fit | None = None
    average: Response | None = None
    matrix: MatrixResponses | None = None

    @property
    def responses(self) -> Responses:
        """A thinned copy of its responses; RuntimeError of a run without a single response."""
        if self.overview is None:
            raise RuntimeError("the run has no single response: read its record")
        return self.overview


@dataclass(frozen=True, eq=False)
class ExaminedRecording:
    """A recording, or several, examined as a whole, and the estimate on it.

    Attributes
    ----------
    axis
        Configuration with the names of its channels.
    source, estimate
        Its samples, and what is computed from them.
    found
        Entries of run.json.
    clock
        Kind of its clock.
    recorded
        Gives its date, as in run.json, from the time after its last sample.
    noticed
        Events on the whole of it.
    digests
        Checksums of its files, where they are known already.
    """

    axis: Axis
    source: Source
    estimate: Estimate
    found: dict[str, Any]
    clock: ClockKind
    recorded: Callable[[float], dict[str, Any]]
    noticed: Sequence[Event] = ()
    digests: Sequence[str] = ()


class Estimate(ABC):
    """What a run computes from its samples. A new one has no state yet, and belongs to one run.

    Attributes
    ----------
    axis
        Configuration from which it was created; None if it was assembled in Python.
    readiness
        Whether the machine is ready, if a channel shows it.
    detection
        Detects changes, or reports that it cannot.
    run
        Its run, as soon as it has one.
    events
        Receives events of the samples that are processed: of its run, or of who processes without one.
    shedding
        What a live run has time for.
    """

    tables: ClassVar[Mapping[str, ColumnTable]]
    """Tables of its record."""
    alone: ClassVar[bool] = False
    """Whether it does not run together with others."""

    axis: Axis | None
    readiness: Readiness | None
    detection: BaselineComparison[Any] | None
    run: RunContext
    events: list[Event]
    shedding: LoadShedding | None = None

    @classmethod
    def live(cls, axis: Axis, source: LiveSource) -> Self:
        """For a live source, whose channels and rate are known; LivebodeError if they do not fit."""
        raise NotImplementedError(f"the configuration permits no live source for {cls.__name__}")

    @property
    @abstractmethod
    def rate_hz(self) -> float:
        """Of the samples."""

    @property
    @abstractmethod
    def window(self) -> int:
        """Samples that a result is computed from."""

    @property
    @abstractmethod
    def step(self) -> int:
        """Samples between results."""

    @property
    @abstractmethod
    def signals(self) -> list[str]:
        """Channels that are correlated."""

    @property
    @abstractmethod
    def reference(self) -> str:
        """The channel whose power is that of the excitation."""

    @property
    @abstractmethod
    def counts(self) -> dict[str, int]:
        """Counts of samples, gaps and the like."""

    @property
    @abstractmethod
    def parts(self) -> Mapping[str, Stateful]:
        """Stages with a state, by name."""

    @cached_property
    def overview(self) -> Overview:
        """Thinned copy of the responses."""
        return Overview()

    @property
    def channels(self) -> list[str]:
        """All channels in use, each once."""
        ready = [] if self.readiness is None else [self.readiness.condition.channel]
        return list(dict.fromkeys([*self.signals, *ready]))

    @property
    def compared_with(self) -> dict[str, Any]:
        """Entry ``monitoring`` of run.json at the beginning, if changes are detected."""
        return {} if self.detection is None else {"monitoring": self.detection.compared_with}

    def begin(self, run: RunContext) -> None:
        """The run begins."""
        self.run, self.events, self.shedding = run, run.events, run.feed.shedding

    def take_over(self, before: Estimate) -> bool:  # noqa: ARG002 - for kinds with live sources
        """Continue with the state of the previous one, if the settings that it depends on are unchanged.

        Returns whether its tracker continues, so that no window is lost; else it begins again.
        """
        return False

    def resume(self) -> Iterable[Document]:
        """Take the newest results of the record that the run continues, and return them for its subscribers."""
        return ()

    def monitor(self, block: Block) -> Iterable[Event]:  # noqa: ARG002 - for kinds that monitor
        """Events of the samples, before they are processed."""
        return ()

    def waiting_spectra(self, block: Block) -> WaitingSpectra | None:  # noqa: ARG002 - for kinds that are joined
        """What of this Block can be tracked together with other axes; `process` gives the same results."""
        return None

    @abstractmethod
    def process(self, block: Block) -> Any:
        """The results of the samples."""

    def finish(self) -> Any:
        """Delayed results, at the end of the samples; None if there are none."""
        return None

    @abstractmethod
    def valid(self, results: Any) -> NDArray[np.bool_]:
        """Where they are valid, (rows, …)."""

    @abstractmethod
    def documents(self, results: Any) -> Iterator[Document]:
        """What is recorded and published of them."""

    def check(self, block: Block) -> Iterable[Event]:  # noqa: ARG002 - for kinds that check
        """Findings on the signals of a live run."""
        return ()

    def last_findings(self) -> Iterable[Event]:
        """Findings on the signals that are not reported yet, at the end of the run."""
        return ()

    @abstractmethod
    def judge(self) -> Iterable[Document]:
        """The last documents; SignalError if the results are invalid."""

    @abstractmethod
    def describe(self, about: Mapping[str, Any], channels: Sequence[Channel]) -> dict[str, Any]:
        """run.json at the beginning."""

    @abstractmethod
    def summary(self, sample: int, time_s: float) -> tuple[dict[str, Any], list[Event]]:
        """run.json at the end, and events on the whole run at the next sample and its time."""

    @abstractmethod
    def outcome(self, directory: Path, summary: dict[str, Any]) -> Outcome:
        """The result of the run."""

    def monitored(self) -> dict[str, Any]:
        """Entries of run.json on the machine's state and on changes."""
        found: dict[str, Any] = {}
        if self.readiness is not None:
            found["readiness"] = self.readiness.summary(self.rate_hz)
        if self.detection is not None:
            suppressed_s = found["readiness"]["suppressed_s"] if found else 0.0
            found["monitoring"] = self.detection.summary(suppressed_s)
        return found


def check_channels(used: Sequence[str], source: LiveSource) -> None:
    """SignalError if a live source has not all of these channels."""
    names = [channel.name for channel in source.channels]
    for name in used:
        if name not in names:
            computed = ", and a live source computes no expressions" if set(name) & set("+-*/(") else ""
            raise SignalError(
                "channel-unknown",
                f"there is no channel {name!r}{computed}",
                nearest_name(name, names),
                channel=name,
                allowed=names,
            )
