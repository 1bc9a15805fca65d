"""The plants on which people try gains and filters: the page's numbers and the steps are those of the same plant."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from livebode.core import Gain, ServerError
from livebode.dashboard import Answer, Quantities, ShownRun
from livebode_control.trial.loop_trial import filter_rate_hz, loop_trial, plant_band
from livebode_control.trial.trial_feedback import trial_feedback
from livebode_control.trial.trial_steps import trial_steps
from livebode_control.tuning.plant_band import PlantBand


class LoopTrials:
    """Answers to "What if"; one plant of each axis is retained, so that a step needs no record."""

    static, script = Path(__file__).parent / "static", "whatif-card.js"

    def __init__(self) -> None:
        self._plants: dict[int, tuple[Quantities, PlantBand]] = {}

    def answers(self) -> Mapping[str, Answer]:
        """Loop and steps."""
        return {"loop": self.facts, "steps": self.steps}

    def facts(self, run: ShownRun, _asked: Mapping[str, str]) -> dict[str, Any]:
        """What the page needs to try other gains and filters, read again; `why_not` if nothing can be tried."""
        return loop_trial(run.past, run.quantities, run.summary, lambda: self._read(run))

    def steps(self, run: ShownRun, asked: Mapping[str, str]) -> dict[str, Any]:
        """Steps and torque noise before and after, of the plant that the page has; `trial` is the text of the page."""
        quantities = run.quantities
        feedback = quantities.feedback
        if feedback is None and quantities.own != "open loop":
            raise ServerError("quantity-unavailable", quantities.why_not("open loop"), "describe the loop under [loop]")
        model = feedback or Gain(1.0)
        tried = trial_feedback(asked.get("trial", ""), model, filter_rate_hz(model, quantities.lines.rate_hz))
        known, plant = self._plants.get(run.axis, (None, None))
        if plant is None or known is not quantities:
            plant = self._read(run)
        steps = trial_steps(plant, model, tried, of_plant=feedback is not None)
        return {**steps, "unit": quantities.unit_of("plant"), "places": len(plant.value)}

    def _read(self, run: ShownRun) -> PlantBand:
        plant = plant_band(run.past, run.quantities)
        self._plants[run.axis] = run.quantities, plant
        return plant
