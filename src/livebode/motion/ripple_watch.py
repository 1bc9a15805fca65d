"""Ripple in a model's residual of an axis's strokes: its orders, their size, and their effect on the bounds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase
from livebode.estimation import RippleOrder, RippleSpeed, Settings, ripple_power
from livebode.motion.chunk import Chunk
from livebode.motion.fit import sampled
from livebode.motion.model import MovingModel
from livebode.motion.orders import OrderSpectrum, shaft_position
from livebode.motion.steady import steady_rows

_SLOWER = 0.5  # of the first stroke's speed: lowest speed of a later one
_GRID = 64  # frequencies at which the model's gain is computed


class RippleMonitor(StatefulBase):
    """Orders of a ripple that the settings name, or that the previous strokes show (`OrderSpectrum`).

    Five strokes whose order does not meet a line are needed to find it. Delay: an order is used from the chunk on in
    which it is found. A ripple that meets a line in every stroke is not found; name it in the settings then.
    """

    _stage = Stage("ripple-watch", 1)

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._spectrum: OrderSpectrum | None = None
        self._made_for = np.zeros(2)  # way and slowest speed
        self.orders = settings.ripple
        """The known orders."""

    def take(self, residual: Floats, chunk: Chunk, model: MovingModel) -> None:
        """Process a model's residual of a chunk, (samples,)."""
        if self._settings.ripple:
            return
        strokes = list(self._strokes(residual, chunk))
        if not strokes:
            return
        slowest = min(abs(x[-1] - x[0]) * chunk.rate_hz / (x.size - 1) for _, x in strokes)
        spectrum = self._spectrum or self._make(np.array([model.high_m - model.low_m, _SLOWER * slowest]))
        for rest, position_m in strokes:
            spectrum.add(rest, position_m, _Gain(model, float(position_m.mean()), self._settings))
        found = spectrum.found()
        sizes = spectrum.amplitudes(found)
        self.orders = tuple(RippleOrder(float(k), float(a)) for k, a in zip(found, sizes) if a > 0)

    def power(self, chunk: Chunk, sample: NDArray[np.int64]) -> Floats:
        """Power of the ripple at the lines of windows that end at these samples, (rows, lines)."""
        speed = RippleSpeed(self._settings.lines).at(chunk.x, sample - chunk.start)
        return ripple_power(self.orders, self._settings.lines, speed)

    def _make(self, made_for: Floats) -> OrderSpectrum:
        self._made_for = made_for
        self._spectrum = OrderSpectrum(self._settings.lines, float(made_for[0]), float(made_for[1]))
        return self._spectrum

    def _strokes(self, residual: Floats, chunk: Chunk) -> Iterator[tuple[Floats, Floats]]:
        """Residual and shaft's position of consecutive steady windows."""
        window = self._settings.lines.window
        newest = np.arange(chunk.first + window - 1, chunk.stop, window)
        begin = newest - chunk.start - window + 1
        whole = np.array([np.isfinite(residual[b : b + window]).all() for b in begin], dtype=np.bool_)
        steady = np.flatnonzero(steady_rows(newest, chunk, window) & whole)
        if not steady.size:
            return
        shaft_m = shaft_position(chunk.x, chunk.y, window, chunk.rate_hz)
        for piece in np.split(steady, np.flatnonzero(np.diff(steady) > 1) + 1):
            cut = slice(int(begin[piece[0]]), int(begin[piece[-1]]) + window)
            yield residual[cut], shaft_m[cut]

    def _state(self) -> dict[str, Any]:
        orders = [[order.cycles, order.amplitude] for order in self.orders]
        return {"orders": orders, "made_for": self._made_for, "spectrum": self._spectrum}

    def _load(self, state: dict[str, Any]) -> None:
        self.orders = tuple(RippleOrder(float(cycles), float(amplitude)) for cycles, amplitude in state["orders"])
        self._spectrum, self._made_for = None, state["made_for"]
        if state["spectrum"] is not None:
            self._make(self._made_for).restore(state["spectrum"])


class _Gain:
    """|G| of a model at a fixed position, interpolated between frequencies."""

    def __init__(self, model: MovingModel, position_m: float, settings: Settings) -> None:
        rate_hz = settings.lines.rate_hz
        highest = 2 * float(settings.lines.frequency_hz[-1])
        self._at = np.linspace(highest / _GRID, highest, _GRID)
        z = np.exp(2j * np.pi * self._at / rate_hz)
        self._gain = np.abs(sampled(model, np.array([position_m]), z, rate_hz))[0]

    def __call__(self, frequency_hz: Floats) -> Floats:
        return np.asarray(np.interp(frequency_hz, self._at, self._gain))
