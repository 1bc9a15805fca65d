"""Whether an excitation reverses motor or load while the axis moves, so that dry friction reverses with them."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import rounded_down
from livebode.dataclass import dataclass
from livebode.excitation import Waveform
from livebode_design._peaks import played
from livebode_design.machine import Machine

_MOVES = 1e-6  # of the largest speed


@dataclass(frozen=True)
class Reversal:
    """The largest speed, m/s, that an excitation adds at motor or load, and the speed of the slowest stroke."""

    part: str
    place: str
    excited_m_per_s: float
    stroke_m_per_s: float

    @property
    def share(self) -> float:
        """Of the amplitude that reverses neither."""
        return self.stroke_m_per_s / self.excited_m_per_s

    def words(self, amplitude_n_m: float | None) -> tuple[str, str]:
        """Value and reason for the table of a design; of amplitudes that differ only the share is named."""
        value = f"{self.excited_m_per_s:.3g} m/s of the {self.part}"
        slowest = f"{self.stroke_m_per_s:.3g} m/s of the slowest stroke"
        where = f", {self.place}" if self.place else ""
        if self.share >= 1:
            return value, f"below the {slowest}: dry friction does not reverse within a period{where}"
        most = f"{100 * rounded_down(self.share):.4g} % of the amplitude"
        if amplitude_n_m is not None:
            most = f"{rounded_down(self.share * amplitude_n_m):g} N m"
        why = f"WARNING: above the {slowest}: dry friction reverses within a period and distorts the responses"
        return value, f"{why}; take at most {most}, or move faster{where}"


def reversal(waveform: Waveform, machine: Machine) -> Reversal | None:
    """The larger one of motor and load at the worst place; None for an axis at standstill, or of unknown speed."""
    if machine.slowest_m_per_s is None:
        return None
    spectrum, bins = played(waveform, machine)
    f = bins * waveform.lines.rate_hz / waveform.lines.window
    found: list[tuple[float, str, str]] = []
    for place in machine.places:
        responses = machine.responses(place, f)
        for part, response in (("motor", responses["speed"]), ("load", responses["travel"] * 2j * np.pi * f)):
            answered = np.zeros_like(spectrum)
            answered[bins] = spectrum[bins] * response
            peak = float(np.abs(np.fft.irfft(answered, waveform.lines.window)).max())
            found.append((peak, part, place.name))
    excited, part, where = max(found)
    return Reversal(part, where, excited, machine.slowest_m_per_s) if excited > 0 else None


def slowest_stroke(speed_m_per_s: Floats) -> float | None:
    """Largest speed of the slowest one of the strokes of a motion, None at standstill.

    >>> slowest_stroke(np.array([0.0, 0.1, 0.4, 0.1, 0.0, -0.2, -0.2, 0.0]))
    0.2
    """
    size = np.abs(speed_m_per_s)
    direction = np.where(size > _MOVES * size.max(initial=0.0), np.sign(speed_m_per_s), 0.0)
    edges = np.flatnonzero(np.diff(direction)) + 1
    peaks = [part.max() for part in np.split(size, edges) if part.size and part.max() > 0]
    return float(min(peaks)) if peaks else None
