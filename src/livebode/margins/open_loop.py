"""The open loop of a fitted plant and its controllers, for many fits at once, at any frequency."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import FitError, Loop, Model
from livebode.fitting import EvaluationGrid, Hold, PhysicalModel, described
from livebode.kernel import FeedbackSeries, FitModel, MarginGrid
from livebode.margins.feedback import series_of

_LOWEST = 1e-7  # of the rate: far below every corner of a drive's controllers
_PER_DECADE_OUTSIDE, _PER_DECADE = 30, 150
_POINTS_IN_A_PEAK = 3.0  # in half the width of a resonance
_POINTS_MAX = 4000
_FREQUENCY_STEP, _DAMPING_STEP = 1.25, 2.0  # factors, to which resonances are rounded
_STEPS_MAX, _NO_PEAK = 1000, 1 << 20
_KNOWN_MAX = 32


@dataclass(frozen=True)
class OpenLoop:
    """L = F·G at the plant input, broken there: G by a fitted model, F by the Loop's controllers.

    Parameters
    ----------
    plant
        The fitted model.
    loop
        The controllers with their rates, holds and delays.
    rate_hz
        Of the loop, which is that of the recording; L is known up to half of it.
    hold
        Hold of the plant's input between ticks.
    filters
        Models in series with the controllers, such as a notch under test.

    Raises
    ------
    FitError
        If the loop has no feedback.
    """

    plant: PhysicalModel
    loop: Loop
    rate_hz: float
    hold: Hold = "zero-order"
    filters: tuple[Model, ...] = ()

    def __post_init__(self) -> None:
        if self.loop.feedback is None:
            raise FitError(
                "loop-unknown",
                "margins need the loop's controllers, and the loop has none",
                "describe them under [loop] (docs/how-to/loop.md)",
                key="loop",
            )

    def at(self, values: Floats, frequency_hz: Floats) -> Complex:
        """L for values (rows, parameters) at frequencies (lines,) or (rows, lines): shape (rows, lines)."""
        plant = self.plant.at(values, EvaluationGrid(frequency_hz, self.rate_hz, self.hold))
        return np.asarray(plant * self._behind(frequency_hz))

    def _behind(self, frequency_hz: Floats) -> Complex:
        """F with the filters."""
        behind = self.loop.feedback_at(frequency_hz)
        for part in self.filters:
            behind = behind * part.response(frequency_hz)
        return np.asarray(behind)

    @cached_property
    def native(self) -> tuple[FitModel, FeedbackSeries] | None:
        """The plant and F as the kernel evaluates them; None where only NumPy can.

        F is not smooth enough where it was measured, for example.
        """
        model = described(self.plant, {}) if self.hold == "zero-order" else None
        if model is None:
            return None
        series = series_of(self._behind, 0.99 * _LOWEST * self.rate_hz, 1.01 * self.rate_hz / 2)
        return None if series is None else (model, series)

    @cached_property
    def _known(self) -> dict[object, MarginGrid]:
        """Grids that similar fits share."""
        return {}

    def behind(self, extra: Model) -> OpenLoop:
        """The same with one more filter in series."""
        return replace(self, filters=(*self.filters, extra))

    def unstable_poles(self, values: Floats) -> NDArray[np.int64]:
        """Quantities of the plant, for each row."""
        poles = self.plant.continuous(values).poles()
        return np.asarray(np.count_nonzero(poles.real > 0, axis=-1))

    def grids(self, values: Floats, band_hz: tuple[float, float]) -> Iterator[tuple[NDArray[np.int64], MarginGrid]]:
        """Rows with the same grid, which goes up to half the rate, dense enough for every crossing and peak.

        Logarithmic; denser in and around the band, and around a resonance of the model as dense as its damping
        requires. Resonances and dampings are rounded to steps, so that similar rows share a grid, which is the one that
        each of them has alone: its results do not depend on the other rows.
        """
        peaks = self._peaks(values)
        if len(peaks) == 1:
            yield np.zeros(1, dtype=np.int64), self._grid(peaks[0], band_hz)
            return
        kinds, kind = np.unique(peaks, axis=0, return_inverse=True)
        for number, steps in enumerate(kinds):
            yield np.flatnonzero(kind.ravel() == number), self._grid(steps, band_hz)

    def _grid(self, peaks: NDArray[np.int64], band_hz: tuple[float, float]) -> MarginGrid:
        key = peaks.tobytes(), band_hz
        if key not in self._known:
            if len(self._known) >= _KNOWN_MAX:
                self._known.clear()
            frequency_hz = self._spaced(peaks.reshape(-1, 2), band_hz)
            self._known[key] = MarginGrid(frequency_hz, self._behind(frequency_hz), self.rate_hz)
        return self._known[key]

    def _spaced(self, peaks: NDArray[np.int64], band_hz: tuple[float, float]) -> Floats:
        nyquist = self.rate_hz / 2
        low, high = band_hz[0] / 10, nyquist
        parts = [_spaced(_LOWEST * self.rate_hz, low, _PER_DECADE_OUTSIDE), _spaced(low, high, _PER_DECADE)]
        for frequency_step, damping_step in peaks[peaks[:, 0] != _NO_PEAK]:
            begin_hz = _FREQUENCY_STEP ** int(frequency_step)
            span = begin_hz / 1.1, min(begin_hz * _FREQUENCY_STEP * 1.1, nyquist)
            if span[0] < nyquist:
                damping = _DAMPING_STEP ** int(damping_step)
                parts.append(_spaced(*span, _POINTS_IN_A_PEAK * np.log(10) / max(damping, 1e-4)))
        found = np.unique(np.concatenate(parts))
        return np.asarray(found[found <= nyquist])

    def _peaks(self, values: Floats) -> NDArray[np.int64]:
        """Step of the frequency and of the damping ratio of each mode and each pair of zeros, (rows, 2·peaks)."""
        names = (*self.plant.names, *self.plant.derived_names)
        every = np.concatenate([values, self.plant.derived(values)], axis=-1) if self.plant.derived_names else values
        column = {name: every[..., i] for i, name in enumerate(names)}
        pairs = [(column[n], np.abs(column[f"{n}_damping"])) for n in names if f"{n}_damping" in column]
        found = np.full((len(values), 2 * len(pairs)), _NO_PEAK)
        for i, (frequency_hz, damping) in enumerate(pairs):
            kept = np.isfinite(frequency_hz) & np.isfinite(damping) & (frequency_hz > 0)
            steps = np.log(frequency_hz[kept]) / np.log(_FREQUENCY_STEP)
            found[kept, 2 * i] = np.floor(steps).clip(-_STEPS_MAX, _STEPS_MAX)
            steps = np.log(np.maximum(damping[kept], 1e-4)) / np.log(_DAMPING_STEP)
            found[kept, 2 * i + 1] = np.floor(steps).clip(-_STEPS_MAX, _STEPS_MAX)
        return found


def _spaced(low: float, high: float, per_decade: float) -> Floats:
    count = min(2 + int(per_decade * np.log10(high / low)), _POINTS_MAX)
    return np.geomspace(low, high, count)
