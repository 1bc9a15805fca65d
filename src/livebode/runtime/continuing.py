"""The samples of a run that is continued."""

from __future__ import annotations

from pathlib import Path

from livebode.core import Block, RecordError, Stage, decode, encode
from livebode.dataclass import dataclass
from livebode.sources.live import ClockReading, LiveBlock, Position

SOURCE = "source"
"""Name of a live source's position in the state of a run."""

_STAGE = Stage("stream-position", 1)


@dataclass(frozen=True, eq=False)
class PreviousRun:
    """The run that another run continues with the next sample.

    `name` is its directory, `sample` and `time_s` are those of the next sample, `counts` are the counts of its
    follower.
    """

    name: str
    sample: int
    time_s: float
    counts: dict[str, int]


class StreamPosition:
    """Where a live source continues, as a part of the run's state.

    One instance while the source is open, for all runs that record it.

    Parameters
    ----------
    state
        State in the record to be continued; empty for a new one.
    """

    def __init__(self, state: bytes = b"") -> None:
        self._state = state
        self._newest: LiveBlock | None = None

    @property
    def left_at(self) -> Position | None:
        """Where the record to be continued ended; None for a new one, or one without samples."""
        if not self._state:
            return None
        place = decode(_STAGE, self._state)["left_at"]
        return None if place is None else Position.from_plain(place)

    def take(self, block: Block) -> None:
        """The next sample is the one after this block."""
        if isinstance(block, LiveBlock):
            self._newest = block

    def snapshot(self) -> bytes:
        """State as bytes; see `restore`."""
        block = self._newest
        if block is None or block.origin is None:
            return self._state or encode(_STAGE, {"left_at": None})
        origin = block.origin
        arrived = ClockReading.at(block.arrived_s)
        place = Position(block.stop, origin.epoch, block.stop + origin.offset, block.rate_hz, arrived, origin.mark)
        return encode(_STAGE, {"left_at": place.to_plain()})

    def restore(self, snapshot: bytes) -> None:
        """Check that the source continues where the record ends."""
        decode(_STAGE, snapshot)
        if snapshot != (self._state or encode(_STAGE, {"left_at": None})):
            raise RecordError(
                "changed-meanwhile", "the record changed while its source was opened", "run the same command again"
            )


def stream_position(run: Path) -> StreamPosition:
    """Position at which the source continues, from the newest commit of this run; of a new run if there is none."""
    from livebode.records import last_commit  # needs a POSIX system

    commit = last_commit(run)
    return StreamPosition(b"" if commit is None else commit.states.get(SOURCE, b""))
