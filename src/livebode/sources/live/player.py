"""Player: what plays an excitation on a controller, and [measure] of experiment.toml, which says how.

The player of a kind of source is in the table of the kinds.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Annotated

from pydantic import BaseModel, ConfigDict, Field

from livebode.sources.live.source import LiveSource

if TYPE_CHECKING:
    from livebode.excitation import Waveform

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]


class MeasureSection(BaseModel):
    """[measure]: how `livebode measure` plays the excitation, and what ends it.

    Parameters
    ----------
    limits
        Limits of channels, in SI units where theirs are recognised: `u = 14.5` for a magnitude, `x = [0.2, 1.8]` for a
        range. Default: that of the input is `limits.torque_n_m_max`.
    ramp_down_s
        Duration of the ramp to zero, in seconds.
    lead_s
        How far the excitation is sent ahead, in seconds: it is played to there if livebode is killed (hal).
    streamer
        Number of the streamer (hal).
    silence_s
        Time without samples after which the excitation is ramped down, in seconds; with ads also the time after which
        the PLC does so by itself.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    limits: dict[str, Number | tuple[Number, Number]] = {}
    ramp_down_s: Annotated[float, Field(strict=True, gt=0, le=60)] = 0.5
    lead_s: Annotated[float, Field(strict=True, ge=0.05, le=10)] = 0.4
    streamer: Annotated[int, Field(strict=True, ge=0, le=7)] = 0
    silence_s: Annotated[float, Field(strict=True, ge=0.2, le=60)] = 1.0

    def ranges(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest permitted value of each limited channel."""
        return {
            name: limit if isinstance(limit, tuple) else (-abs(limit), abs(limit))
            for name, limit in self.limits.items()
        }


class Player(ABC):
    """Plays an excitation on the controller whose samples `source` receives.

    Whatever happens to livebode, the excitation ends: within `stop_s` after it was requested, and by itself if this
    process is killed.
    """

    source: LiveSource
    stop_s: float
    """Longest time from a request until the excitation is zero, in seconds."""

    @abstractmethod
    def __init__(self, source: LiveSource, section: MeasureSection, excitation: str) -> None: ...

    @abstractmethod
    def check(self, waveform: Waveform) -> str:
        """How the controller is connected, as a sentence; changes nothing.

        Raises
        ------
        MeasurementError
            If it cannot play this excitation so that it ends by itself.
        SourceError
            If its samples cannot be received.
        """

    @abstractmethod
    def start(self, waveform: Waveform) -> None:
        """Ramp up, then repeat the period, whose samples are in the unit of the controller's channel."""

    @abstractmethod
    def keep(self, played: int) -> None:
        """Continue; to be called at least every 0.1 s. `played`: samples received since the excitation began."""

    @abstractmethod
    def ramp_down(self) -> None:
        """Ramp down; the rest does not need this process."""

    @abstractmethod
    def off(self) -> None:
        """End without a ramp, as fast as the controller can."""

    @abstractmethod
    def close(self) -> None:
        """Release what the player uses; what is not ended is ramped down."""
