"""Position: where a stream continues, in the sender's numbers and in ours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.dataclass import dataclass
from livebode.sources.live.computer_clock import ClockReading

Mark = Mapping[str, Any]
"""Position of a batch in a source that can be read again, as plain data."""


@dataclass(frozen=True)
class Origin:
    """How the samples of a Block are numbered by their sender: our number plus `offset`, in this `epoch`."""

    epoch: int
    offset: int
    mark: Mark | None = None


@dataclass(frozen=True)
class Position:
    """Where a stream continues.

    Parameters
    ----------
    sample
        Our number of the next sample.
    epoch, number
        The sender's epoch, and its number of the next sample.
    rate_hz
        Samples per second.
    mark
        Position of the previous samples in a source that can be read again.
    arrived
        This computer's clocks when the last sample arrived.
    """

    sample: int
    epoch: int
    number: int
    rate_hz: float
    arrived: ClockReading
    mark: Mark | None = None

    def to_plain(self) -> dict[str, Any]:
        """The position as plain data: what `asdict` gives, which copies each value of it again."""
        return {**vars(self), "arrived": dict(vars(self.arrived))}

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any]) -> Position:
        """Position from plain data."""
        return cls(**{**plain, "arrived": ClockReading(**plain["arrived"])})
