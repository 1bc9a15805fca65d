"""The open loop of a fitted plant and its controllers at any frequency, for many fits at once, and its stability."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import FitError, Loop, Model
from livebode.dataclass import dataclass
from livebode.fitting import EvaluationGrid, Hold, PhysicalModel, described
from livebode.kernel import FeedbackSeries, FitModel, MarginGrid

_LOWEST = 1e-7  # of the rate: far below every corner of a drive's controllers
_PER_DECADE_OUTSIDE, _PER_DECADE = 30, 150
_POINTS_IN_A_PEAK = 3.0  # in half the width of a resonance
_POINTS_MAX = 4000  # a resonance far beyond the band may ask for more
_FREQUENCY_STEP, _DAMPING_STEP = 1.25, 2.0  # factors, to which resonances are rounded
_STEPS_MAX, _NO_PEAK = 1000, 1 << 20
_KNOWN_MAX = 32  # grids in memory; a run needs few, because resonances are rounded

# Of the series of the controllers.
_DEGREE = 15
_PIECES, _PIECES_MAX = 128, 4096
_ERROR_MAX = 1e-12  # of the largest |F| in a piece
_ROUNDING = 2e-15  # of z − 1, by which sampled integrators are inexact, times the rate over the frequency


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
        """Open loop with one more filter in series."""
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
        frequencies = np.unique(np.concatenate(parts))
        return np.asarray(frequencies[frequencies <= nyquist])

    def _peaks(self, values: Floats) -> NDArray[np.int64]:
        """Step of the frequency and of the damping ratio of each mode and each pair of zeros, (rows, 2·peaks)."""
        names = (*self.plant.names, *self.plant.derived_names)
        every = np.concatenate([values, self.plant.derived(values)], axis=-1) if self.plant.derived_names else values
        column = {name: every[..., i] for i, name in enumerate(names)}
        pairs = [(column[n], np.abs(column[f"{n}_damping"])) for n in names if f"{n}_damping" in column]
        steps_of_peaks = np.full((len(values), 2 * len(pairs)), _NO_PEAK)
        for i, (frequency_hz, damping) in enumerate(pairs):
            kept = np.isfinite(frequency_hz) & np.isfinite(damping) & (frequency_hz > 0)
            steps = np.log(frequency_hz[kept]) / np.log(_FREQUENCY_STEP)
            steps_of_peaks[kept, 2 * i] = np.floor(steps).clip(-_STEPS_MAX, _STEPS_MAX)
            steps = np.log(np.maximum(damping[kept], 1e-4)) / np.log(_DAMPING_STEP)
            steps_of_peaks[kept, 2 * i + 1] = np.floor(steps).clip(-_STEPS_MAX, _STEPS_MAX)
        return steps_of_peaks


def _spaced(low: float, high: float, per_decade: float) -> Floats:
    count = min(2 + int(per_decade * np.log10(high / low)), _POINTS_MAX)
    return np.geomspace(low, high, count)


def series_of(response: Callable[[Floats], Complex], low_hz: float, high_hz: float) -> FeedbackSeries | None:
    """Controllers as a Chebyshev series over the logarithm of the frequency, for the kernel.

    It has degree 15 in pieces, as many as it takes to be exact to 1e-12 (at low frequencies to the rounding of
    `response`); None if 4096 are too few.

    Examples
    --------
    >>> series_of(lambda f: np.exp(-2j * np.pi * f / 500), 0.01, 2000.0).coefficients.shape
    (128, 16)
    >>> series_of(lambda f: np.where(f < 100, 1.0, 2.0 + 0j), 0.01, 2000.0) is None
    True
    """
    begin, end = np.log([low_hz, high_hz])
    order = np.arange(_DEGREE + 1)
    angle = np.pi * (order + 0.5) / (_DEGREE + 1)
    to_series = 2 / (_DEGREE + 1) * np.cos(order[:, np.newaxis] * angle)
    to_series[0] /= 2
    tested = np.array([-1.0, -0.95, -0.31, 0.05, 0.52, 0.97, 1.0])
    polynomials = np.cos(order[:, np.newaxis] * np.arccos(tested))
    pieces = _PIECES
    while pieces <= _PIECES_MAX:
        width = (end - begin) / pieces
        middle = begin + width * (np.arange(pieces) + 0.5)[:, np.newaxis]
        sampled, expected = (
            response(np.exp(middle + width / 2 * x).ravel()).reshape(pieces, -1) for x in (np.cos(angle), tested)
        )
        coefficients = np.asarray(sampled @ to_series.T, dtype=np.complex128)
        error = np.abs(coefficients @ polynomials - expected).max(axis=1)
        permitted = _ERROR_MAX + _ROUNDING * high_hz / np.exp(middle[:, 0])
        if (error <= permitted * np.abs(expected).max(axis=1)).all():
            return FeedbackSeries(float(begin), float(width), np.ascontiguousarray(coefficients))
        pieces *= 2
    return None


def stable(open_loop: Complex, frequency_hz: Floats, unstable_poles: NDArray[np.int64] | int = 0) -> NDArray[np.bool_]:
    """By Nyquist's criterion for a sampled loop, shape (rows,).

    Along the upper half of the unit circle, and around its integrators at z = 1, the angle of 1 + L turns by π times
    the closed loop's poles inside less the open loop's poles inside. As both have equally many, it ends at π times
    (the open loop's unstable poles less those of the closed loop). With ν integrators it begins at −ν·π/2.

    Parameters
    ----------
    open_loop
        L, shape (rows, frequencies), from where only its integrators matter up to half the rate, and close enough that
        1 + L turns by less than half a turn between neighbours.
    frequency_hz
        Ascending; the last is half the rate.
    unstable_poles
        Of the open loop, outside the unit circle.
    """
    size = np.log(np.abs(open_loop[:, :2]))
    integrators = np.rint(-(size[:, 1] - size[:, 0]) / np.log(frequency_hz[1] / frequency_hz[0]))
    angle = np.unwrap(np.angle(1 + open_loop), axis=1)
    begin = -integrators * np.pi / 2
    turns = np.rint((angle[:, 0] - begin) / (2 * np.pi))
    end = angle[:, -1] - 2 * np.pi * turns
    return np.asarray(np.abs(end - np.pi * unstable_poles) < np.pi / 2)
