"""The plants on which people try gains and filters: the page's numbers and the steps are those of the same plant."""

from __future__ import annotations

from typing import Any

from livebode.core import Gain, ServerError
from livebode.dashboard import Past, Quantities
from livebode_control.trial.loop_trial import filter_rate_hz, loop_trial, plant_band
from livebode_control.trial.trial_feedback import trial_feedback
from livebode_control.trial.trial_steps import trial_steps
from livebode_control.tuning.plant_band import PlantBand


class LoopTrials:
    """Used in the reading thread of a board. One plant of each axis is retained, so that a step needs no record."""

    def __init__(self) -> None:
        self._plants: dict[int, tuple[Quantities, PlantBand]] = {}

    def facts(self, axis: int, past: Past, quantities: Quantities, summary: dict[str, Any]) -> dict[str, Any]:
        """What the page needs to try other gains and filters, read again."""
        return loop_trial(past, quantities, summary, lambda: self._read(axis, past, quantities))

    def steps(self, axis: int, past: Past, quantities: Quantities, text: str) -> dict[str, Any]:
        """Steps and torque noise before and after, of the plant that the page has."""
        feedback = quantities.feedback
        if feedback is None and quantities.own != "open loop":
            raise ServerError("quantity-unavailable", quantities.why_not("open loop"), "describe the loop under [loop]")
        model = feedback or Gain(1.0)
        tried = trial_feedback(text, model, filter_rate_hz(model, quantities.lines.rate_hz))
        known, plant = self._plants.get(axis, (None, None))
        if plant is None or known is not quantities:
            plant = self._read(axis, past, quantities)
        found = trial_steps(plant, model, tried, of_plant=feedback is not None)
        return {**found, "unit": quantities.unit_of("plant"), "places": len(plant.value)}

    def _read(self, axis: int, past: Past, quantities: Quantities) -> PlantBand:
        plant = plant_band(past, quantities)
        self._plants[axis] = quantities, plant
        return plant
