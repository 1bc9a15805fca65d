"""OutputOnlySettings: what is tracked from the outputs alone, and how."""

from __future__ import annotations

from typing import Any

from livebode.configuration import OUTPUTS_MAX
from livebode.core import SignalError, UsageError
from livebode.dataclass import dataclass

HOPS, HOPS_MIN, HOPS_MAX = 20, 10, 200
"""Hops in a window: default, and limits. The bounds follow from their scatter."""
HOP_SAMPLES, HOP_SAMPLES_MIN = 50, 12
"""Samples in a hop at the reduced rate: default, and least."""
ROWS_MAX, SIZE_MAX = 26, 160
"""Most block rows of the Hankel matrix, and most rows."""
WINDOW_SAMPLES_MAX = 1 << 20
"""Samples in a window at the reduced rate, for each output."""
OVERSAMPLING = 2.5
"""Reduced rate divided by the highest frequency of the band, at least."""


@dataclass(frozen=True)
class OutputOnlySettings:
    """Outputs, band and window of an output-only run.

    Attributes
    ----------
    outputs
        Channels.
    rate_hz
        Of the samples.
    band_hz
        Lowest and highest frequency of a mode.
    factor
        Samples for each one at the reduced rate, at which the modes are identified.
    hop_samples
        Samples between results, at the reduced rate.
    hops
        Hops in a window.
    schedule
        Channel whose value at the centre of a window is recorded with its modes.
    """

    outputs: tuple[str, ...]
    rate_hz: float
    band_hz: tuple[float, float]
    factor: int
    hop_samples: int = HOP_SAMPLES
    hops: int = HOPS
    schedule: str | None = None

    def __post_init__(self) -> None:
        low_hz, high_hz = self.band_hz
        if not 0 <= low_hz < high_hz <= self.rate_hz / OVERSAMPLING:
            raise UsageError(
                "out-of-range",
                f"the band {low_hz:g} … {high_hz:g} Hz is not between 0 and {self.rate_hz / OVERSAMPLING:g} Hz, the "
                f"sample rate divided by {OVERSAMPLING:g}",
                "choose other limits",
                argument="band_hz",
            )
        if len(self.outputs) > OUTPUTS_MAX or len(set(self.outputs)) < len(self.outputs):
            raise UsageError(
                "out-of-range",
                f"{len(self.outputs)} outputs are named, or one of them twice",
                f"name 1 to {OUTPUTS_MAX} different outputs",
                argument="output",
            )
        self._check_window()

    def _check_window(self) -> None:
        if not HOPS_MIN <= self.hops <= HOPS_MAX or self.hop_samples < HOP_SAMPLES_MIN:
            raise UsageError(
                "out-of-range",
                f"a window of {self.window} samples has {self.hops} hops of {self.hop}",
                f"choose {HOPS_MIN} to {HOPS_MAX} hops of at least {HOP_SAMPLES_MIN * self.factor} samples, or for a "
                "shorter hop a band that reaches higher",
                argument="window",
                window=self.window,
                hop=self.hop,
            )
        if self.hop_samples * self.hops > WINDOW_SAMPLES_MAX:
            raise UsageError(
                "out-of-range",
                f"the window of {self.window} samples is {self.hop_samples * self.hops} at the reduced rate",
                f"choose a window of at most {WINDOW_SAMPLES_MAX * self.factor} samples",
                argument="window",
                window=self.window,
            )

    @property
    def reduced_rate_hz(self) -> float:
        return self.rate_hz / self.factor

    @property
    def hop(self) -> int:
        """Samples of the recording between results."""
        return self.hop_samples * self.factor

    @property
    def window(self) -> int:
        """Samples of the recording in a window."""
        return self.hop * self.hops

    @property
    def rows(self) -> int:
        """Block rows of the Hankel matrix."""
        return min(ROWS_MAX, SIZE_MAX // len(self.outputs), self.hop_samples)

    @property
    def lags(self) -> int:
        """Lags of the correlations, at the reduced rate."""
        return 2 * self.rows - 1

    @property
    def highpass_hz(self) -> float:
        """Corner of the high-pass that removes offset and drift."""
        return max(self.band_hz[0] / 2, self.band_hz[1] / 100)

    def found(self) -> dict[str, Any]:
        """Plain data for a record."""
        return {
            "rate_hz": self.rate_hz,
            "outputs": list(self.outputs),
            "band_hz": list(self.band_hz),
            "reduced_rate_hz": self.reduced_rate_hz,
            "window": self.window,
            "hop": self.hop,
            "lags": self.lags,
        }


def reduced(rate_hz: float, high_hz: float) -> int:
    """The factor by which the rate can be reduced for a band up to this frequency.

    >>> reduced(2000.0, 60.0)
    13
    """
    return max(1, int(rate_hz / (OVERSAMPLING * high_hz)))


def window_of(factor: int, window: int | None, hop: int | None, samples: int | None, lost: int) -> tuple[int, int]:
    """Samples of a hop at the reduced rate, and hops in a window.

    Parameters
    ----------
    factor
        Of the reduced rate.
    window, hop
        Specified numbers of samples; None: as default, a window of 20 hops of 50 samples at the reduced rate, or half
        of a recording that is shorter than two of them.
    samples
        Of the recording, if known.
    lost
        Samples that the filter and the lags need beyond the window.

    Raises
    ------
    SignalError
        If the recording is too short.
    """
    least = HOPS_MIN * HOP_SAMPLES_MIN * factor + lost
    if samples is not None and samples < least:
        raise SignalError(
            "too-short",
            f"the recording has {samples} samples, less than the {least} that a window needs at least",
            "choose a band that reaches higher, or record more",
            samples=samples,
            window=least,
        )
    if window is None:
        window = HOPS * (hop or HOP_SAMPLES * factor)
        if samples is not None:
            window = min(window, max((samples - lost) // 2, least - lost))
    if hop is None:
        hops = HOPS if window >= HOPS * HOP_SAMPLES_MIN * factor else HOPS_MIN
        return window // (hops * factor), hops
    hop_samples = max(round(hop / factor), 1)
    return hop_samples, round(window / (hop_samples * factor))
