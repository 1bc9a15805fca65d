"""What the kernel found at the lines, converted into the quantity that is wanted, and restricted to valid lines."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from livebode.arrays import Complex, Flags, Floats
from livebode.estimation.quantities import from_plant
from livebode.estimation.tracker_settings import Settings
from livebode.kernel import LineRows


@dataclass(frozen=True, eq=False)
class LineEstimates:
    """What is known of each line, as the Responses have it: shapes (rows, lines)."""

    value: Complex
    sigma: Floats
    coherence: Floats
    input_coherence: Floats
    weight: Complex
    distortion: Floats
    valid: Flags

    @classmethod
    def of(cls, rows: LineRows) -> LineEstimates:
        """Estimates of the kernel."""
        coherence = rows.coherence, rows.input_coherence
        return cls(rows.value, rows.sigma, *coherence, rows.weight, rows.distortion, rows.valid)

    def with_ripple(self, ripple: Floats, input_power: Floats) -> LineEstimates:
        """With the share of a ripple that is added to an input of this power."""
        return replace(self, sigma=np.hypot(self.sigma, np.abs(self.value) * np.sqrt(ripple / input_power)))

    def converted(self, settings: Settings) -> LineEstimates:
        """The plant from a closed-loop response, and another quantity from the plant."""
        loop, f, value, slope = settings.loop, settings.lines.frequency_hz, self.value, np.ones_like(self.value)
        weight = self.weight
        if settings.method.through_loop:
            value, slope = loop.plant(value, f)
            weight = self.value / value  # U/W is (Y/W)/G
        if settings.quantity != "plant":
            # Output, input and excitation over the excitation, each correlated with it.
            signals = value * weight, weight, np.ones_like(value)
            value, by_plant = from_plant(settings.quantity, value, loop, signals, f)
            slope, weight = slope * by_plant, np.full_like(value, complex(np.nan, np.nan))
        scale, valid = np.abs(slope), self.valid & np.isfinite(value)
        distortion = np.where(valid, self.distortion * scale, np.nan)
        return replace(self, value=value, sigma=self.sigma * scale, weight=weight, distortion=distortion).only(valid)

    def without(self, against: Flags) -> LineEstimates:
        """Lines that are invalid because of an error that repeats have an infinite one."""
        distortion = np.where(self.valid & against, np.inf, self.distortion)
        return replace(self, distortion=distortion).only(self.valid & ~against)

    def only(self, valid: Flags) -> LineEstimates:
        """NaN at all other lines, except for the distortion."""
        nothing = complex(np.nan, np.nan)
        return LineEstimates(
            np.where(valid, self.value, nothing),
            np.where(valid, self.sigma, np.nan),
            np.where(valid, self.coherence, np.nan),
            np.where(valid, self.input_coherence, np.nan),
            np.where(valid, self.weight, nothing),
            self.distortion,
            valid,
        )
