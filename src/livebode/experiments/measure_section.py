"""[measure] of experiment.toml: how the excitation is played, and what ends it."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]


class MeasureSection(BaseModel):
    """[measure]: how `livebode measure` plays the excitation, and what ends it.

    Parameters
    ----------
    limits
        Limits of channels, in their units: `u = 14.5` for a magnitude, `x = [0.2, 1.8]` for a range. Default: the
        that of the input is `limits.torque_n_m_max`.
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
