"""Interface of the object that turns samples into responses."""

from __future__ import annotations

from typing import Any, Protocol

from numpy import float64
from numpy.typing import NDArray

from livebode.core import Block, Emit, Responses, ignore
from livebode.estimation import Settings


class Follower(Protocol):
    """Turns the samples of a run into responses: a Tracker, or a MotionCorrection, which delays some of them.

    For a drive that sends spectra it is a SpectraTracker.
    """

    settings: Settings

    @property
    def counts(self) -> dict[str, int]: ...

    def found(self) -> dict[str, Any]: ...

    def process(self, block: Block, emit: Emit = ignore, /) -> Responses: ...

    def finish(self, emit: Emit = ignore, /) -> Responses | None: ...

    def excitation_power(self) -> NDArray[float64]: ...

    def repeatability(self) -> NDArray[float64]: ...

    def snapshot(self) -> bytes: ...

    def restore(self, snapshot: bytes) -> None: ...
