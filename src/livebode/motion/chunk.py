"""The samples of one fit, their buffer, their windows of steady motion, and the responses that wait for them."""

from __future__ import annotations

from dataclasses import field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import PER_LINE, PER_RESPONSE, Block, Lines, Responses, Stage, StatefulBase
from livebode.dataclass import dataclass
from livebode.estimation import PlausibleRange
from livebode.kernel import SlidingDFT


@dataclass(frozen=True, eq=False)
class Chunk:
    """Consecutive samples of w, u, y, x, shape (samples,) each.

    `start` is the number of the first one, `first` that of the first new one; the samples before it are the lead, in
    which the model reaches the machine's state. `stop` is the number after the last new one; one more window may
    follow. `missing` (samples,) is True where a sample was not finite or implausibly large; it then has the value of
    the previous one. `torque` (rows, lines) is |U| at the lines of each of the chunk's responses.
    """

    start: int
    first: int
    stop: int
    w: Floats
    u: Floats
    y: Floats
    x: Floats
    missing: NDArray[np.bool_]
    rate_hz: float
    torque: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    def at_rows(self, lines: Lines, sample: NDArray[np.int64]) -> Chunk:
        """Chunk with the torque of the responses whose windows end at these samples, at least one."""
        apart = int(np.gcd.reduce(np.append(np.diff(sample), lines.window)))
        dft = SlidingDFT(lines.window, lines.bins)
        # Zeros in front, so that a row is due at each of the samples.
        before = (self.start - int(sample[0]) - 1) % apart
        dft.advance(np.zeros(before))
        rows = dft.process(self.u[: int(sample[-1]) + 1 - self.start], hop=apart)
        return replace(self, torque=np.abs(rows[(sample + 1 - self.start + before) // apart - 1]))

    def drag(self, window: int, sample: NDArray[np.int64], inertia_kg_m2: float) -> Floats:
        """Drag torque in the direction of motion, without acceleration, over two windows up to each sample, (rows,)."""
        u = self._windows(self.u, 2 * window, sample).mean(axis=1)
        before, after = (self._windows(self.y, window, end).mean(axis=1) for end in (sample - window, sample))
        return np.asarray((u - inertia_kg_m2 * (after - before) * self.rate_hz / window) * np.sign(after))

    def _windows(self, signal: Floats, window: int, sample: NDArray[np.int64]) -> Floats:
        return np.lib.stride_tricks.sliding_window_view(signal, window)[sample - self.start - window + 1]


class RecentSamples(StatefulBase):
    """The newest samples of w, u, y, x, as many as the next chunk needs."""

    _stage = Stage("recorded-samples", 1)

    def __init__(self, names: list[str], lines: Lines) -> None:
        self._names, self._rate_hz = names, lines.rate_hz
        self._range = PlausibleRange(3, lines.window)
        self.forget()

    def forget(self) -> None:
        """Drop all samples; the size of the previous ones still limits what is plausible."""
        self._parts: list[Floats] = []
        self.start = self.stop = 0

    def __bool__(self) -> bool:
        return self.stop > self.start

    def append(self, block: Block) -> None:
        if not self:
            self.start = block.start
        data = block.data[[block.index(name) for name in self._names]]
        signals: NDArray[np.bool_] = np.asarray(np.isfinite(data[:3]).all(axis=0))
        implausible = self._range.process(np.where(signals, data[:3], 0.0))
        signals[implausible] = False
        data[:3, ~signals] = np.nan
        self._parts.append(data)
        self.stop = block.stop

    def drop(self, before: int) -> None:
        """Forget the samples before this number."""
        if before > self.start:
            self._parts = [self._whole()[:, before - self.start :].copy()]
            self.start = before

    def chunk(self, first: int, stop: int, end: int) -> Chunk:
        """All samples before the number `end`."""
        data = self._whole()[:, : end - self.start]
        missing = np.isnan(data[0])
        if not np.isfinite(data).all():
            known = np.where(np.isfinite(data), np.arange(data.shape[1]), -1)
            last = np.maximum.accumulate(known, axis=1)
            data = np.where(last >= 0, np.take_along_axis(data, last.clip(0), axis=1), 0.0)
        return Chunk(self.start, first, stop, data[0], data[1], data[2], data[3], missing, self._rate_hz)

    def _whole(self) -> Floats:
        if len(self._parts) > 1:
            self._parts = [np.concatenate(self._parts, axis=1)]
        return self._parts[0]

    def _state(self) -> dict[str, Any]:
        data = self._whole() if self else np.zeros((len(self._names), 0))
        return {"range": self._range, "data": data, "start": self.start}

    def _load(self, state: dict[str, Any]) -> None:
        data = state["data"]
        if len(data) != len(self._names):
            raise ValueError(f"samples of {len(data)} channels")
        self.forget()
        self._range.restore(state["range"])
        self._parts = [data] if data.size else []
        self.start = int(state["start"])
        self.stop = self.start + data.shape[1]


_ARRAYS = PER_LINE + PER_RESPONSE


class PendingResponses(StatefulBase):
    """The Tracker's responses from the newest chunk on."""

    _stage = Stage("waiting-responses", 1)

    def __init__(self, lines: Lines) -> None:
        self._lines = lines
        self._parts: list[Responses] = []

    def append(self, responses: Responses) -> None:
        self._parts.append(responses)

    def pop(self, stop: int) -> Responses:
        """Remove and return those whose newest sample is before `stop`."""
        whole = Responses.join(self._parts)
        count = int(np.searchsorted(whole.sample, stop))
        # Joining copies, so that the removed responses do not remain in memory behind a view.
        self._parts = [Responses.join([whole[count:]])]
        return whole[:count]

    def _state(self) -> dict[str, Any]:
        if not self._parts:
            return {"unit": None}
        whole = Responses.join(self._parts)
        return {name: getattr(whole, name) for name in _ARRAYS} | {"unit": whole.unit}

    def _load(self, state: dict[str, Any]) -> None:
        arrays = {name: array for name, array in state.items() if name != "unit"}
        self._parts = [Responses(lines=self._lines, unit=state["unit"], **arrays)] if arrays else []


_UNEVEN = 0.1
_STANDSTILL = 0.5
FLAT_M = 1e-3  # a chunk with less travel has no curves to fit


def steady_rows(sample: NDArray[np.int64], chunk: Chunk, window: int) -> NDArray[np.bool_]:
    """Rows whose window and the previous one have a constant speed that is near the usual one.

    Elsewhere accelerations excite oscillations, and dry friction may stop the axis. Constant: the travel of the two
    windows differs by up to 10 % from twice that of one. Near the usual speed: at least half of the farthest travel of
    the stretch, and more than 1 mm.
    """
    x, last = chunk.x, sample - chunk.start
    known = last >= 2 * window
    here, middle, there = (x[(last - back).clip(0)] for back in (0, window, 2 * window))
    travel = np.abs(here - there)
    even = np.abs(here - 2 * middle + there) <= _UNEVEN * travel
    return np.asarray(known & even & (travel >= max(_STANDSTILL * np.max(travel, initial=0.0), FLAT_M)))
