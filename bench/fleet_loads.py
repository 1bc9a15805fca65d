"""Simulated axes of a fleet, by the kind of messages that they send: samples, samples with [motion], or spectra."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from livebode.configuration import Axis
from livebode.core import Channel, Lines, SpectraLayout
from livebode.excitation import multisine
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis, Strokes
from livebode.sources.live import AnyBatch, Batch, SpectraBatch
from livebode_plant.fleet.fleet_settings import machine_key
from livebode_plant.fleet.message import write_message

RATE_HZ, WINDOW, FREQUENCIES = 4000.0, 400, "20:140:20"
NAMES = ("w", "u", "velocity")
_SIMULATED_S = 8.0
_STROKES = Strokes(start_m=0.25, end_m=1.6, speed_m_per_s=0.38, dwell_s=0.5)
_MOTION = {"radius_m": 0.02, "chunk_s": 2.0}


@dataclass(frozen=True)
class AxisLoad:
    """What each axis sends.

    Attributes
    ----------
    period_s
        From one message to the next.
    spectra
        Whether a message is one spectrum of the drive; otherwise it has the samples of the period.
    motion
        Whether the samples have the position of an axis that moves, and the configuration [motion].
    """

    name: str
    period_s: float
    spectra: bool = False
    motion: bool = False

    @property
    def samples(self) -> int:
        """Of a message, or from one spectrum to the next."""
        return round(self.period_s * RATE_HZ)

    def axes(self, count: int) -> dict[str, Axis]:
        """Configurations by key, in the order in which they are numbered."""
        axes = (self._axis(number) for number in range(count))
        return {machine_key(axis, "load"): axis for axis in axes}

    def _axis(self, number: int) -> Axis:
        signals = {"output": "velocity", "input": "u", "excitation": "w"}
        machine = {"site": "hall", "machine": f"machine {number // 2}", "axis": "xy"[number % 2]}
        about = {
            "machine": machine,
            "source": {"url": "udp://127.0.0.1:5000"},
            "signals": signals | ({"schedule": "x"} if self.motion else {}),
            "lines": {"frequencies": FREQUENCIES, "window": WINDOW},
        }
        return Axis.of(about | ({"motion": _MOTION} if self.motion else {}), "load")

    def message(self, axis: int, number: int) -> bytes:
        """Message `number` of an axis; each has noise of its own."""
        return write_message(self._spectrum(axis, number) if self.spectra else self._batch(axis, number))

    def _batch(self, axis: int, number: int) -> AnyBatch:
        signals, channels = samples_of(self.motion)
        first = number * self.samples
        data = signals[:, np.arange(first, first + self.samples) % signals.shape[1]]
        noise = np.random.default_rng([axis, number]).standard_normal(self.samples)
        data[2] = data[2] * (1 + 0.001 * axis) + 1e-3 * noise
        return Batch(first, data.astype("f4").astype("f8"), channels, RATE_HZ, epoch=axis + 1)

    def _spectrum(self, axis: int, number: int) -> AnyBatch:
        sums, layout = _sums(self.samples)
        noise = np.random.default_rng([axis, number]).standard_normal((*sums.shape, 2)) @ [0.1, 0.1j]
        one = (sums + noise).astype("c8").astype("c16")
        empty = np.zeros((0, 1))
        state = np.zeros(1, np.uint32)
        return SpectraBatch(number * self.samples, one, empty, state, layout, RATE_HZ, epoch=axis + 1)


SAMPLES_500 = AxisLoad("samples, 500 ms", 0.5)
SAMPLES_100 = AxisLoad("samples, 100 ms", 0.1)
SPECTRA = AxisLoad("spectra, 2/s", 0.5, spectra=True)
MOTION = replace(SAMPLES_500, name="samples, 500 ms, [motion]", motion=True)


@cache
def samples_of(moving: bool) -> tuple[np.ndarray, tuple[Channel, ...]]:
    excitation = multisine(Lines.parse(FREQUENCIES, RATE_HZ, WINDOW))
    motion = {"motion": _STROKES} if moving else {}
    axis = BeltAxis(excitation_n_m=excitation, sensor=Sensor(), seconds=_SIMULATED_S, run_in_s=0.5, **motion)
    block, _ = SimulatedAxis(axis).run()
    names = (*NAMES, "x") if moving else NAMES
    channels = tuple(next(one for one in block.channels if one.name == name) for name in names)
    return np.array([block[name] for name in names]), channels


@cache
def _sums(hop: int) -> tuple[np.ndarray, SpectraLayout]:
    """Sums of one spectrum of the simulated axis, shape (signals, 1, lines)."""
    signals, channels = samples_of(moving=False)
    bins = Lines.parse(FREQUENCIES, RATE_HZ, WINDOW).bins
    layout = SpectraLayout(channels, (), window=WINDOW, hop=hop, lines=tuple(map(int, bins)))
    return np.fft.rfft(signals[:, :WINDOW])[:, np.newaxis, list(layout.lines)], layout
