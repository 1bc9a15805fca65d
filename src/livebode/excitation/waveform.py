"""Waveform: one period of an excitation with its lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import DesignError, Lines, UsageError
from livebode.dataclass import dataclass
from livebode.excitation._quantised import quantised

_CHANGED_MAX = 0.5  # of a line's amplitude: beyond it, rounding dominates the line


@dataclass(frozen=True, eq=False)
class Waveform:
    """One period of an excitation, N m, and its parameters.

    Parameters
    ----------
    lines
        Lines of the measurement; the period is their window.
    samples
        One period, shape (window,).
    about
        Parameters that reproduce it: kind, seed, amplitude and so on, as plain data.

    Raises
    ------
    LivebodeError
        If the samples are not one finite period of the window, or a line has no power.
    """

    lines: Lines
    samples: Floats
    about: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        samples = np.array(self.samples, dtype=np.float64)
        samples.flags.writeable = False
        object.__setattr__(self, "samples", samples)
        if samples.shape != (self.lines.window,) or not np.all(np.isfinite(samples)):
            raise UsageError(
                "wrong-shape",
                f"the excitation has shape {samples.shape} or is not finite",
                f"give one period of {self.lines.window} finite samples",
                argument="samples",
                shape=list(samples.shape),
                window=self.lines.window,
            )
        if np.any(np.abs(self.spectrum[list(self.lines.bins)]) <= 1e-9 * np.max(np.abs(samples))):
            weakest = int(np.argmin(np.abs(self.spectrum[list(self.lines.bins)])))
            raise DesignError(
                "line-without-power",
                f"the excitation has no power at {self.lines.frequency_hz[weakest]:g} Hz",
                "leave out that line, or specify an amplitude above 0",
                frequency_hz=float(self.lines.frequency_hz[weakest]),
            )

    @property
    def spectrum(self) -> Complex:
        """Amplitudes of bins 0 … N/2, scaled so that |X_k| is a line's amplitude, shape (N//2 + 1,)."""
        return np.asarray(np.fft.rfft(self.samples) * (2 / self.lines.window))

    @property
    def amplitude(self) -> Floats:
        """Amplitude of each line, shape (lines,)."""
        return np.abs(self.spectrum[list(self.lines.bins)])

    @property
    def peak(self) -> float:
        return float(np.max(np.abs(self.samples)))

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.samples**2)))

    @property
    def crest_factor(self) -> float:
        """Peak over rms of the samples with the hold of the drive."""
        return self.peak / self.rms

    @property
    def ramp_periods(self) -> int:
        """Periods of the ramp: those of ramp_s in `about`, by default one."""
        return max(1, round(float(self.about.get("ramp_s", 0.0)) * self.lines.rate_hz / self.lines.window))

    def scaled(self, factor: float) -> Waveform:
        """Excitation multiplied by `factor`."""
        return replace(self, samples=self.samples * factor)

    def quantised(self, step: float) -> Waveform:
        """The excitation in steps of the drive; see `livebode.excitation.quantised`.

        Raises
        ------
        DesignError
            Also where rounding changes a line by more than half; the message has a step that does not.
        """
        stepped = replace(self, samples=quantised(self.samples, step), about={**self.about, "resolution_n_m": step})
        changed = self._changed_by(stepped)
        if np.max(changed) > _CHANGED_MAX:
            worst = int(np.argmax(changed))
            fine = step
            while np.max(self._changed_by(replace(self, samples=quantised(self.samples, fine)))) > _CHANGED_MAX:
                fine /= 2
            amplitude = np.abs(self.spectrum[self.lines.bins[worst]])
            whole = self.about.get("kind") in ("prbs", "chirp")
            remedy = "raise the amplitude" if whole else "raise it, leave it out"
            raise DesignError(
                "rounded-away",
                f"the line at {self.lines.frequency_hz[worst]:g} Hz has {amplitude:.3g} "
                f"N m, which rounding to steps of {step:g} N m changes by {100 * changed[worst]:.0f} "
                "%",
                f"{remedy}, or take steps of {fine!r} N m",
                frequency_hz=float(self.lines.frequency_hz[worst]),
                step_n_m=step,
                fitting_step_n_m=fine,
            )
        return stepped

    def _changed_by(self, other: Waveform) -> Floats:
        """Distance of each line from that of another waveform, as a share of it, shape (lines,)."""
        own, its = self.spectrum[list(self.lines.bins)], other.spectrum[list(self.lines.bins)]
        return np.asarray(np.abs(its - own) / np.abs(own))
