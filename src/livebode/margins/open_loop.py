"""The open loop of a fitted plant and its controllers, for many fits at once, at any frequency."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebode.core import FitError, Loop, Model
from livebode.fitting import EvaluationGrid, PhysicalModel
from livebode.fitting.physical import Hold

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_LOWEST = 1e-7  # of the rate: far below every corner of a drive's controllers
_PER_DECADE_OUTSIDE, _PER_DECADE = 30, 150
_POINTS_IN_A_PEAK = 3.0  # in half the width of a resonance
_POINTS_MAX = 4000


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
        behind = self.loop.feedback_at(frequency_hz)
        for part in self.filters:
            behind = behind * part.response(frequency_hz)
        return np.asarray(plant * behind)

    def behind(self, extra: Model) -> OpenLoop:
        """The same with one more filter in series."""
        return replace(self, filters=(*self.filters, extra))

    def unstable_poles(self, values: Floats) -> NDArray[np.int64]:
        """Quantities of the plant, for each row."""
        poles = self.plant.continuous(values).poles()
        return np.asarray(np.count_nonzero(poles.real > 0, axis=-1))

    def frequencies(self, values: Floats, band_hz: tuple[float, float]) -> Floats:
        """Frequencies up to half the rate that are dense enough for every crossing and peak of these rows.

        Logarithmic; denser in and around the band, and around a resonance of the model as dense as its damping
        requires.
        """
        nyquist = self.rate_hz / 2
        low, high = band_hz[0] / 10, nyquist
        parts = [_spaced(_LOWEST * self.rate_hz, low, _PER_DECADE_OUTSIDE), _spaced(low, high, _PER_DECADE)]
        for centre_hz, damping in self._peaks(values):
            span = np.min(centre_hz) / 1.1, min(np.max(centre_hz) * 1.1, nyquist)
            if span[0] < nyquist:
                parts.append(_spaced(*span, _POINTS_IN_A_PEAK * np.log(10) / max(np.min(damping), 1e-4)))
        found = np.unique(np.concatenate(parts))
        return np.asarray(found[found <= nyquist])

    def _peaks(self, values: Floats) -> list[tuple[Floats, Floats]]:
        """Frequency, Hz, and damping ratio of each mode and each pair of zeros, over the rows."""
        names = (*self.plant.names, *self.plant.derived_names)
        every = np.concatenate([values, self.plant.derived(values)], axis=-1) if self.plant.derived_names else values
        column = {name: every[..., i] for i, name in enumerate(names)}
        pairs = [(column[n], np.abs(column[f"{n}_damping"])) for n in names if f"{n}_damping" in column]
        return [(f[kept], z[kept]) for f, z in pairs if (kept := np.isfinite(f) & np.isfinite(z) & (f > 0)).any()]


def _spaced(low: float, high: float, per_decade: float) -> Floats:
    count = min(2 + int(per_decade * np.log10(high / low)), _POINTS_MAX)
    return np.geomspace(low, high, count)
