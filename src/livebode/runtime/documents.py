"""Documents: what a run publishes while it runs, in this order, to each of its subscribers.

A subscriber is any function of one document. It is called in the thread that tracks, after the record was written, so
it must return at once and must not raise; longer work belongs to another thread. All documents are immutable.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, Union

from livebode.core import Block, Channel, Event, Responses
from livebode.dataclass import dataclass

if TYPE_CHECKING:
    from livebode.analysis import Overview
    from livebode.core import MatrixResponses, Parameters
    from livebode.runtime.run_control import RunControl

VERSION = 1
"""Version of the documents; it is raised when the meaning of one changes, not when one gets another field."""


@dataclass(frozen=True, eq=False)
class RunStarted:
    """The run begins.

    It comes again, after `RunEnded`, where an edited configuration makes another run continue with the next sample.

    Attributes
    ----------
    directory
        Directory of the run.
    summary
        run.json at the beginning: configuration, findings, versions.
    control
        Requests to the run, and the health of its source; in this process only.
    overview
        Thinned copy of its responses, which grows with the run; in this process only.
    version
        Version of the documents.
    """

    directory: Path
    summary: Mapping[str, Any]
    control: RunControl
    overview: Overview
    version: int = VERSION


@dataclass(frozen=True, eq=False)
class Channels:
    """The channels in use, each with its unit, and their rate in samples per second."""

    channels: tuple[Channel, ...]
    rate_hz: float


@dataclass(frozen=True, eq=False)
class ClockSet:
    """Relation of the run's seconds to the time of day, as in `RunClock`; again when it is more accurate."""

    pieces: tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class FitResults:
    """The fits of the responses before, quantities derived from them, and margins: one Parameters each."""

    parts: tuple[Parameters, ...]


@dataclass(frozen=True, eq=False)
class TrackerResults:
    """All results of this Block were published, except those of checks; a LiveBlock contains its time of arrival.

    `samples` is the number of tracked samples, `samples_total` that of the whole source (None if it is not known).
    """

    block: Block
    samples: int
    samples_total: int | None


@dataclass(frozen=True)
class RunStep:
    """What the run does from now.

    Attributes
    ----------
    name
        "opening", "lines" (their search), "examining" and "tracking" of a recording; "ending" of every run: no samples
        follow, and pictures are drawn.
    """

    name: str


@dataclass(frozen=True, eq=False)
class RunEnded:
    """The run ended; `summary` is the final run.json."""

    summary: Mapping[str, Any]


Document: TypeAlias = Union[  # a name in it is that of a type which only a matrix run loads
    RunStarted,
    Channels,
    ClockSet,
    Responses,
    "MatrixResponses",
    FitResults,
    Event,
    TrackerResults,
    RunStep,
    RunEnded,
]
"""New `Responses`, of a matrix run `MatrixResponses` (when a run continues, first the newest previous ones), an
`Event`, or one of the classes here."""
Subscriber = Callable[[Document], None]
