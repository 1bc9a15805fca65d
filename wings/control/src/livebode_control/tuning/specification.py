"""LoopSpecification: what a proposed controller has to keep for every plant within the bounds."""

from __future__ import annotations

from math import isfinite

from livebode.core import UsageError
from livebode.dataclass import dataclass


@dataclass(frozen=True, kw_only=True)
class LoopSpecification:
    """Limits of the loop, promised for every plant within the bounds and every place.

    Parameters
    ----------
    bandwidth_hz
        Required bandwidth (|T| first falls 3 dB below one), Hz; the most robust controller with it is proposed.
        None: as high as the other limits permit.
    gain_margin_db
        dB by which the loop gain may rise.
    phase_margin_deg
        Smallest rotation of L, deg, that makes it −1.
    max_sensitivity
        Largest peak sensitivity Ms.
    disk_margin
        Smallest balanced disk margin α (Seiler, Packard and Gahinet 2020, skew 0): gain and phase may change together;
        0 for none.
    noise_gain
        Largest rms of the plant input for white noise with an rms of 1 at the output; None for no limit.
    encoder_step
        Step of the encoder, in rad for a velocity in rad/s (2π/counts per turn), else in the unit of the position.
    input_noise
        Largest rms of the plant input, in its unit, that the rounding to `encoder_step` causes; None for no limit.
    notches
        Most notches in series with the controller, 0 … 4.
    low_pass
        Whether a low-pass of second order in series (a torque filter) may be added.
    coherence
        Lines with a lower coherence are not used.
    confidence
        Probability with which the true plant is within the bounds at all lines and places together.

    Raises
    ------
    UsageError
        If a limit is out of its range.
    """

    bandwidth_hz: float | None = None
    gain_margin_db: float = 6.0
    phase_margin_deg: float = 30.0
    max_sensitivity: float = 2.0
    disk_margin: float = 0.0
    noise_gain: float | None = None
    encoder_step: float | None = None
    input_noise: float | None = None
    notches: int = 2
    low_pass: bool = True
    coherence: float = 0.5
    confidence: float = 0.95

    def __post_init__(self) -> None:
        inf = float("inf")
        self._check("bandwidth_hz", 0.0, inf, "a positive bandwidth")
        self._check("gain_margin_db", 0.0, 60.0, "for example 6")
        self._check("phase_margin_deg", 0.0, 90.0, "for example 30 … 60")
        self._check("max_sensitivity", 1.0, inf, "for example 1.4 … 2")
        self._check("noise_gain", 0.0, inf, "a positive limit")
        self._check("encoder_step", 0.0, inf, "a positive step")
        self._check("input_noise", 0.0, inf, "a positive limit")
        if self.input_noise is not None and (self.encoder_step is None or self.noise_gain is not None):
            raise UsageError(
                "conflict",
                "input_noise is a limit for the rounding of an encoder",
                "specify encoder_step with it, and no noise_gain",
                argument="input_noise",
                value=self.input_noise,
            )
        self._check("confidence", 0.0, 1.0, "for example 0.95")
        self._check("disk_margin", -1e-300, 2.0, "for example 0.5 … 0.8")
        self._check("coherence", -1e-300, 1.0, "for example 0.5")
        self._check("notches", -1, 5, "0 … 4")

    @property
    def noise_limit(self) -> float | None:
        """Largest rms of the plant input, for the noise of `encoder_step`, else for white noise of 1."""
        return self.noise_gain if self.encoder_step is None else self.input_noise

    def _check(self, name: str, low: float, high: float, usual: str) -> None:
        """UsageError if the value is not between the two."""
        value = getattr(self, name)
        if value is not None and not (isfinite(value) and low < value < high):
            raise UsageError(
                "out-of-range", f"{name}={value} is out of range", f"choose {usual}", argument=name, value=value
            )
