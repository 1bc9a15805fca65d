"""Design: a chosen experiment, with its prediction and its reasons."""

from __future__ import annotations

from typing import Any

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.excitation import Waveform
from livebode_design._peaks import Peak, worst
from livebode_design.accuracy import LineAccuracy, encoder_counts
from livebode_design.limits import MachineLimits
from livebode_design.machine import UNITS, Machine
from livebode_design.spec import ExperimentSpec


@dataclass(frozen=True)
class Choice:
    """One row of the table that explains a design."""

    what: str
    value: str
    why: str


@dataclass(frozen=True, eq=False)
class Design:
    """An experiment: the excitation, its effect on the machine, and the predicted accuracy.

    Attributes
    ----------
    waveform
        The excitation as the drive plays it.
    amplitude_n_m
        Of each line, chirp, step or bit; of shaped lines their rms, of listed ones the list.
    limits, peaks
        Limits of the machine, and the predicted peaks at each place.
    accuracy, windows
        Accuracy of one window, and the number of windows that brings every line's 95 % bound within `spec.accuracy`.
    recording_s
        Recording time for that.
    hop
        Samples between responses.
    choices
        All of it as rows of a table.
    """

    spec: ExperimentSpec
    machine: Machine
    waveform: Waveform
    amplitude_n_m: float | list[float]
    limits: MachineLimits
    peaks: tuple[Peak, ...]
    accuracy: LineAccuracy
    windows: int
    recording_s: float
    hop: int
    choices: tuple[Choice, ...]

    def __repr__(self) -> str:
        shown = (choice for choice in self.choices if choice.what in ("lines", "window", "amplitude", "recording"))
        return f"<Design: {'; '.join(f'{choice.what} {choice.value}' for choice in shown)}>"

    @property
    def ramp_s(self) -> float:
        """Duration of the ramp of the excitation, whole periods: the peaks are those of the periodic state."""
        return self.waveform.ramp_periods * self.waveform.lines.window / self.waveform.lines.rate_hz

    @property
    def encoder_counts(self) -> Floats | None:
        """Amplitude of each line at the motor's encoder, counts, shape (lines,); None where its step is not known."""
        return encoder_counts(self.waveform, self.machine)

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        counts = self.encoder_counts
        lines = self.waveform.lines
        low_high = {name: {"low": p.low, "high": p.high, "unit": UNITS[name], "place": p.place, "motion_alone": p.own}
                    for name, p in worst(self.peaks).items()}  # fmt: skip
        return {
            "excitation": dict(self.waveform.about),
            "rate_hz": lines.rate_hz,
            "window": lines.window,
            "frequency_hz": lines.frequency_hz.tolist(),
            "amplitude_n_m": self.waveform.amplitude.tolist(),
            "peak_n_m": self.waveform.peak,
            "rms_n_m": self.waveform.rms,
            "crest_factor": self.waveform.crest_factor,
            "predicted": low_high,
            "sigma": self.accuracy.sigma.tolist(),
            "sigma_relative": self.accuracy.relative.tolist(),
            "bound_95_relative": self.accuracy.reached(self.windows).tolist(),
            "encoder_counts": None if counts is None else counts.tolist(),
            "windows": self.windows,
            "recording_s": self.recording_s,
            "hop": self.hop,
            "ramp_s": self.ramp_s,
            "choices": [vars(choice) for choice in self.choices],
            "notes": list(self.machine.notes),
        }
