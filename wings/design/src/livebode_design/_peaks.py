"""Peaks of an experiment: the excitation's in the loop's periodic state, on top of the motion's own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.dataclass import dataclass
from livebode.excitation import Waveform
from livebode_design.machine import QUANTITIES, Machine, OperatingPoint, Quantity, within

_POWERLESS = 1e-12  # of the largest bin: rounding


@dataclass(frozen=True)
class Peak:
    """The extremes of one quantity at one place.

    Attributes
    ----------
    quantity, place
        The quantity and its place.
    excited
        Lowest and highest value that the excitation adds.
    own
        Lowest and highest value of the motion alone; None where it is not known.
    """

    quantity: Quantity
    place: str
    excited: tuple[float, float]
    own: tuple[float, float] | None

    @property
    def low(self) -> float:
        """Sum of both at the worst alignment; the excitation's alone where the motion is not known."""
        return self.excited[0] + (self.own[0] if self.own else 0.0)

    @property
    def high(self) -> float:
        return self.excited[1] + (self.own[1] if self.own else 0.0)

    @property
    def size(self) -> float:
        return max(self.high, -self.low)


def peaks(waveform: Waveform, machine: Machine) -> tuple[Peak, ...]:
    """Every quantity at every place.

    The excitation's part is the sum of its bins times their closed-loop responses, over one period: exact for a linear
    machine in the periodic state. From rest the loop reaches this state in some seconds, and the position may drift
    further meanwhile: ramp the excitation up slowly. Excitation and motion are not synchronous, so their extremes at
    each place are added. Lines that the rounding of a quantised excitation adds outside of the machine's known band are
    not included.

    Raises
    ------
    GridError
        If the excitation has power where the machine is not known.
    """
    window, rate_hz = waveform.lines.window, waveform.lines.rate_hz
    spectrum, excited = played(waveform, machine)
    return tuple(
        _peak(quantity, place, response, spectrum, excited, window)
        for place in machine.places
        for quantity, response in machine.responses(place, excited * rate_hz / window).items()
    )


def played(waveform: Waveform, machine: Machine) -> tuple[NDArray[np.complex128], NDArray[np.int64]]:
    """Spectrum of a period, and the bins with power at which the machine is known."""
    window, rate_hz = waveform.lines.window, waveform.lines.rate_hz
    spectrum = np.fft.rfft(waveform.samples)
    # The integrators of the loop remove a constant.
    excited = np.flatnonzero(np.abs(spectrum) > _POWERLESS * np.max(np.abs(spectrum)))
    excited = excited[excited > 0]
    if machine.band_hz is not None and "resolution_n_m" in waveform.about:
        excited = excited[within(excited * rate_hz / window, machine.band_hz)]
    return spectrum, excited


def _peak(
    quantity: Quantity,
    place: OperatingPoint,
    response: NDArray[np.complex128],
    spectrum: NDArray[np.complex128],
    excited: NDArray[np.int64],
    window: int,
) -> Peak:
    answered = np.zeros_like(spectrum)
    answered[excited] = spectrum[excited] * response
    period = np.fft.irfft(answered, window)
    return Peak(quantity, place.name, (float(period.min()), float(period.max())), place.motion.get(quantity))


def worst(peaks: tuple[Peak, ...]) -> dict[Quantity, Peak]:
    """Both extremes of each quantity over all places; its place is that of the larger one, the travel has none."""
    return {name: _ends([p for p in peaks if p.quantity == name]) for name in QUANTITIES}


def _ends(of: list[Peak]) -> Peak:
    low, high = min(of, key=lambda p: p.low), max(of, key=lambda p: p.high)
    place = "" if low.quantity == "travel" else (high if high.high >= -low.low else low).place
    own = (low.own[0], high.own[1]) if low.own and high.own else None
    return Peak(low.quantity, place, (low.excited[0], high.excited[1]), own)
