"""What the page needs to try other gains and filters, and the answers to it: numbers and steps of the same plant.

The controllers are sent in parts, and the plant with its bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.analysis import by_place, checked_loop
from livebode.configuration import recorded_loop
from livebode.core import PID, Cascade, Gain, LivebodeError, Model, PositionPD, Responses, ServerError
from livebode.dashboard import Answer, Past, Quantities, ShownRun, grid_hz
from livebode.language import for_page
from livebode_control.proposal.stored_proposal import stored_proposal
from livebode_control.trial.trial_steps import trial_feedback, trial_steps
from livebode_control.tuning.feedback_parts import FeedbackParts, FeedbackTerm
from livebode_control.tuning.gains_text import gains_in, parameter_keys
from livebode_control.tuning.plant_band import PlantBand
from livebode_control.tuning.specification import LoopSpecification


def proposed_controller(directory: Path, controller: Model, entry: str | None = None) -> dict[str, Any] | None:
    """Gains, notches and low-passes from tune.json; None if it is missing, damaged, or of another entry.

    The gains are None if they are those of another controller than the described one.
    """
    try:
        stored = stored_proposal(directory)
    except LivebodeError:
        return None
    if stored is None or stored.entry != entry:
        return None
    gains = gains_in({"loop": _tables(stored.controller, controller)}, controller)
    notches = [
        {"hz": notch.frequency_hz, "depth_db": notch.depth_db, "damping": notch.damping} for notch in stored.notches
    ]
    nothing = gains is None and not notches and not stored.low_passes_hz
    return None if nothing else {"gains": gains, "notches": notches, "low_passes_hz": stored.low_passes_hz}


def _tables(values: Mapping[str, Any], controller: Model) -> Mapping[str, Any]:
    """The values of a controller as the tables of [loop]."""
    if isinstance(controller, PID):
        return {"velocity": values}
    return {"position_pd": values} if isinstance(controller, PositionPD) else values


_READ_BYTES = 16 << 20  # a longer run is averaged from its overview, every n-th response


def loop_trial(run: ShownRun, plant: Callable[[], PlantBand]) -> dict[str, Any]:
    """For the page, as plain data; `why_not` if nothing can be tried, `band_why_not` if the bounds are unknown."""
    past, quantities = run.past, run.quantities
    feedback = quantities.feedback
    if feedback is None and quantities.own != "open loop":
        return {"why_not": for_page(quantities.why_not("open loop"))}
    entry = None if run.group is None else run.group.entry(run.axis)
    checked = checked_loop(past.directory, recorded_loop(run.summary), entry)
    model = feedback or Gain(1.0)  # without a description the measured L is the plant, and F is a factor
    drawn_hz, rate_hz = grid_hz(quantities.lines), quantities.lines.rate_hz
    parts = FeedbackParts.of(model, drawn_hz)
    return {
        "why_not": "",
        "described": feedback is not None,
        "verdict": checked.verdict,
        "sentence": checked.sentence,
        "tables": parameter_keys(model),
        "values": dict(parts.values),
        "rate_hz": filter_rate_hz(model, rate_hz),
        "frequency_hz": drawn_hz.tolist(),
        "parts": _parts(parts),
        "proposed": proposed_controller(past.directory, model, past.entry),
        **_band(plant, model),
    }


def plant_band(past: Past, quantities: Quantities) -> PlantBand:
    """The plant at each place with its bounds; without a description of the loop, L.

    Raises
    ------
    TuneError
        If too few lines are valid.
    """
    limits = LoopSpecification()
    mean = by_place(_responses(past))
    if quantities.feedback is not None:
        mean = quantities.of_responses(mean, "plant")
    return PlantBand.of(mean, quantities.lines.rate_hz, coherence=limits.coherence, confidence=limits.confidence)


def _band(plant: Callable[[], PlantBand], model: Model) -> dict[str, Any]:
    """The plant at each place with its radius, and the parts of F on the same frequencies."""
    try:
        band = plant()
    except LivebodeError as error:
        return {"band": None, "band_why_not": for_page(error.words)}
    plain_band = {
        "frequency_hz": band.frequency_hz.tolist(),
        "known": int(np.count_nonzero(~band.above)),
        "lines_hz": band.lines_hz.tolist(),
        "dropped": len(band.dropped_hz),
        "confidence": LoopSpecification().confidence,
        "places": [
            {**_complex(value), "radius": radius.tolist(), "rise": rise.tolist()}
            for value, radius, rise in zip(band.value, band.radius, band.rise[:, band.above])
        ],
        "parts": _parts(FeedbackParts.of(model, band.frequency_hz)),
    }  # fmt: skip
    return {"band": plain_band, "band_why_not": ""}


def _responses(past: Past) -> Responses:
    """The responses that `livebode tune` uses, if they can be read soon."""
    if past.readable and _size_bytes(past.directory) <= _READ_BYTES:
        return Responses.join(list(past.record().steady_batches()))
    responses = next(past.all_between(-inf, inf)) if past.overview is None else past.overview
    return responses[np.flatnonzero(responses.ready)]


def _size_bytes(directory: Path) -> int:
    return sum(path.stat().st_size for path in directory.rglob("responses*.parquet"))


def filter_rate_hz(model: Model, rate_hz: float) -> float:
    """Rate of the innermost controller, with which filters are computed."""
    inner = model.velocity if isinstance(model, Cascade) else model
    return float(getattr(inner, "rate_hz", rate_hz))


def _parts(parts: FeedbackParts) -> dict[str, Any]:
    def term(curve: FeedbackTerm) -> dict[str, Any]:
        return {"name": curve.name, "power": curve.power, **_complex(curve.curve)}

    return {"terms": [term(part) for part in parts.terms], "outer": None if parts.outer is None else term(parts.outer)}


def _complex(values: NDArray[np.complex128]) -> dict[str, list[float]]:
    return {"re": values.real.tolist(), "im": values.imag.tolist()}


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
        return loop_trial(run, lambda: self._read(run))

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
