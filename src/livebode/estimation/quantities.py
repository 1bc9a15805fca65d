"""Plant, open loop, closed loop and sensitivity from the same lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Loop, Quantity
from livebode.dataclass import dataclass
from livebode.estimation.tracker_settings import Settings
from livebode.kernel import LineRows


def convert(quantity: Quantity, plant: Complex, feedback: Complex) -> tuple[Complex, Complex]:
    """The quantity from plant G and feedback F, and its derivative by G.

    Open loop L = F·G, sensitivity S = 1/(1 + L), closed loop T = L/(1 + L), all at the plant input, where the
    excitation enters: L is the response of the loop cut there.

    Returns
    -------
    value, derivative
        Shape of `plant`; sigma of the quantity is |derivative|·sigma of the plant to first order.

    Examples
    --------
    >>> value, slope = convert("closed loop", np.array([1 + 0j]), np.array([1 + 0j]))
    >>> value, slope
    (array([0.5+0.j]), array([0.25+0.j]))
    """
    if quantity == "plant":
        return plant, np.ones_like(plant)
    open_loop = feedback * plant
    if quantity == "open loop":
        return open_loop, np.broadcast_to(feedback, plant.shape)
    sensitivity = 1 / (1 + open_loop)
    if quantity == "sensitivity":
        return sensitivity, -feedback * sensitivity**2
    return open_loop * sensitivity, feedback * sensitivity**2


def from_plant(
    quantity: Quantity, plant: Complex, loop: Loop, signals: tuple[Complex, Complex, Complex], frequency_hz: Floats
) -> tuple[Complex, Complex]:
    """The quantity from plant G, and its derivative by G; the feedback is that of the loop, or of the signals.

    Without a description of the controller the signals contain its action, F·y = E·w − u. `signals` are output, input
    and excitation, each correlated with the excitation.
    """
    if loop.feedback is not None:
        return convert(quantity, plant, loop.feedback_at(frequency_hz))
    output, input_, excitation = signals
    return convert(quantity, plant, (loop.entry_at(frequency_hz) * excitation - input_) / output)


@dataclass(frozen=True, eq=False)
class LineEstimates:
    """Estimates at each line, as the Responses have it: shapes (rows, lines)."""

    value: Complex
    sigma: Floats
    coherence: Floats
    input_coherence: Floats
    weight: Complex
    distortion: Floats
    variation: Floats
    valid: Flags

    @classmethod
    def of(cls, rows: LineRows) -> LineEstimates:
        """Estimates of the kernel."""
        coherence = rows.coherence, rows.input_coherence
        return cls(rows.value, rows.sigma, *coherence, rows.weight, rows.distortion, rows.variation, rows.valid)

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
        sigma, variation = self.sigma * scale, self.variation * scale
        converted = replace(self, value=value, sigma=sigma, weight=weight, distortion=distortion, variation=variation)
        return converted.only(valid)

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
            np.where(valid, self.variation, np.nan),
            valid,
        )
