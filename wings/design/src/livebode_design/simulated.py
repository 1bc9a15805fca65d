"""A simulated controller in real time: the belt axis of an experiment, on which `measure --simulated` plays."""

from __future__ import annotations

import time
from typing import ClassVar

import numpy as np

from livebode.arrays import Floats, Integers
from livebode.core import MeasurementError
from livebode.excitation import Waveform
from livebode.simulation import BeltAxis, SimulatedAxis
from livebode.sources.live import Address, Batch, LiveSource, MeasureSection, Player, SourceSettings

_BATCHES_PER_S = 100
_REACTION_S = 0.3
"""From a sample to a request here."""


class SimulatedSource(LiveSource):
    """Sends the samples of a simulated axis in real time; its excitation is what `player` plays."""

    format: ClassVar[str] = "simulated"

    def __init__(self, axis: BeltAxis, player: SimulatedPlayer) -> None:
        super().__init__(SourceSettings(url="stdin:"), Address("simulated", path="[belt]"))
        self._machine, self._player = SimulatedAxis(axis), player

    def _receive(self) -> bool:
        self._established()
        rate_hz, began = self._machine.rate_hz, time.monotonic()
        for block, _ in self._machine.pairs(round(rate_hz / _BATCHES_PER_S), self._player.excitation):
            if self._stop.wait(max(0.0, began + block.stop / rate_hz - time.monotonic())):
                return False
            self._deliver(Batch(block.start, np.asarray(block.data), block.channels, rate_hz, epoch=1))
        return True


class SimulatedPlayer(Player):
    """Adds the excitation to the torque of a simulated axis, with linear ramps at both ends.

    Parameters
    ----------
    axis
        The machine; its own excitation is replaced, and it has no end.
    section
        [measure].
    """

    source: SimulatedSource

    def __init__(self, axis: BeltAxis, section: MeasureSection) -> None:
        self.source = SimulatedSource(axis, self)
        self.stop_s = section.ramp_down_s + _REACTION_S
        self._rate_hz = axis.drive.rate_hz
        self._down = max(1, round(section.ramp_down_s * self._rate_hz))
        self._waveform: Waveform | None = None
        self._ends = False
        self._first: int | None = None
        self._stop: int | None = None

    def check(self, waveform: Waveform) -> str:
        if waveform.lines.rate_hz != self._rate_hz:
            raise MeasurementError(
                "not-connected",
                f"the simulated axis runs at {self._rate_hz:.9g} Hz, but the excitation is for "
                f"{waveform.lines.rate_hz:.9g} Hz",
                "set belt.drive.rate_hz",
                player="simulated",
            )
        return "a simulation in real time, in this process; nothing moves"

    def excitation(self, number: Integers) -> Floats:
        """The excitation at these consecutive samples, which are the next ones."""
        waveform = self._waveform
        if waveform is None:
            return np.zeros(number.size)
        if self._first is None:
            self._first = int(number[0])
        if self._ends and self._stop is None:
            self._stop = int(number[0])
        played, up = number - self._first, waveform.ramp_periods * waveform.lines.window
        size = np.minimum((played + 1) / up, 1.0)
        if self._stop is not None:
            size = np.minimum(size, (self._stop - self._first) / up) * np.clip(
                1 - (number - self._stop) / self._down, 0.0, 1.0
            )
        return np.asarray(waveform.samples[played % waveform.lines.window] * size)

    def start(self, waveform: Waveform) -> None:
        self._waveform = waveform

    def keep(self, played: int) -> None:
        """The simulation continues by itself."""

    def ramp_down(self) -> None:
        self._ends = True

    def off(self) -> None:
        self._waveform = None

    def close(self) -> None:
        self.source.close()
