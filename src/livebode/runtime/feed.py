"""Feed: how the samples of a run reach its loop, and what is known of them. That of a live source is `LiveFeed`."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any, Protocol

from livebode.core import Block, Channel, Emit, Event
from livebode.runtime.run_control import RunControl

if TYPE_CHECKING:
    from livebode.runtime.continuing import PreviousRun, StreamPosition
    from livebode.runtime.joining import Steps
    from livebode.runtime.recorder import Recorder
    from livebode.runtime.shedding import LoadShedding
    from livebode.sources.live import LiveSource


class Source(Protocol):
    """Source of the samples of a run: a recording or a simulated machine."""

    @property
    def channels(self) -> tuple[Channel, ...]: ...

    @property
    def samples(self) -> int | None: ...

    @property
    def blocks(self) -> Callable[..., Iterator[Block]]: ...


class Feed:
    """The samples of a recording or a simulated machine.

    Parameters
    ----------
    source
        Source of the samples.
    control
        Requests from other threads.
    noticed
        Events on the whole recording, found before tracking.
    recorded
        Gives the date of a recording, as in run.json, from the time after its last sample.
    started
        `time.perf_counter()` when opening the source began, to include it in the speed.
    again
        Whether the source begins with the same samples each time; else its numbers continue.
    delivery
        Arguments for the source's `blocks`.
    """

    live: LiveSource | None = None
    """The live source."""
    shedding: LoadShedding | None = None
    """What a live run has time for."""
    position: StreamPosition | None = None
    """Where a live source continues."""
    previous: PreviousRun | None = None
    """The run that this one continues."""
    record_wait: AbstractContextManager[object] = nullcontext()
    """The context in which the loop waits for its record."""

    def __init__(
        self,
        source: Source,
        control: RunControl | None = None,
        *,
        noticed: Sequence[Event] = (),
        recorded: Callable[[float], dict[str, Any]] | None = None,
        started: float | None = None,
        again: bool = True,
        **delivery: Any,
    ) -> None:
        self.source, self.control, self.noticed, self.again = source, control or RunControl(), noticed, again
        self.started = time.perf_counter() if started is None else started
        self._recorded, self._delivery = recorded, delivery

    def blocks(self, channels: Sequence[str]) -> Iterator[Block | None]:
        """Blocks with the run's numbers; None while the source is silent."""
        return self.source.blocks(channels, **self._delivery)

    def run(self, steps: Steps, recorder: Recorder) -> None:
        """Do the steps of the loop."""
        for _ in steps:
            recorder.catch_up()

    @property
    def asks_commit(self) -> bool:
        """Whether the sender sends no more until more of what it sent is recorded."""
        return False

    def is_due(self, samples: int) -> bool:  # noqa: ARG002 - for live sources
        """Whether the next samples are processed at once; else they wait until `samples` complete a response."""
        return False

    def resume(self, recorder: Recorder) -> None:
        """Continue with the clock and the numbers of a record."""

    def clock(self, begun: str | None) -> dict[str, Any]:  # noqa: ARG002 - for live sources
        """Entries of run.json on the clock of a live source, of a run that began at this date."""
        return {}

    def add(self, block: Block, begun: str | None, emit: Emit) -> dict[str, Any]:  # noqa: ARG002 - for live sources
        """Entries of run.json that this Block changes: numbers of the sender, clock; `emit` receives events."""
        return {}

    def events(self, stop: int) -> list[Event]:  # noqa: ARG002 - a recording has all of them at the start
        """Events of the source, when all samples before number `stop` were tracked."""
        return []

    def remaining_events(self, stop: int) -> list[Event]:  # noqa: ARG002 - as above
        """The last events of the source, at the end of the run."""
        return []

    def load_events(self, sample: int, time_s: float) -> list[Event]:  # noqa: ARG002 - for live sources
        """Events on the backlog at this sample."""
        return []

    def last_events(self, sample: int, time_s: float) -> list[Event]:  # noqa: ARG002 - for live sources
        """Events on omitted work, at the end of the run."""
        return []

    def date(self, to_s: float, begun: str | None) -> dict[str, Any] | None:  # noqa: ARG002 - for live sources
        """Date of the samples up to the time after the last one, as in run.json; None where it is not known."""
        return None if self._recorded is None else self._recorded(to_s)
