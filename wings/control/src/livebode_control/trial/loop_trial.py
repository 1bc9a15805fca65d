"""What the page needs to try other gains and filters: the controllers in parts, and the plant with its bounds.

The page computes L, its margins and those of the worst plant within the bounds from these numbers alone, so that a
slider needs no request. The definitions are those of `livebode tune`.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.analysis import by_place, checked_loop
from livebode.configuration import recorded_loop
from livebode.core import Cascade, Gain, LivebodeError, Model, Responses
from livebode.dashboard import Past, Quantities, grid_hz
from livebode.language import for_page
from livebode_control.trial.proposal_files import proposed_controller
from livebode_control.tuning.feedback_parts import FeedbackParts, FeedbackTerm
from livebode_control.tuning.gains_text import parameter_keys
from livebode_control.tuning.plant_band import PlantBand
from livebode_control.tuning.specification import LoopSpecification

_READ_BYTES = 16 << 20  # a longer run is averaged from its overview, every n-th response


def loop_trial(
    past: Past, quantities: Quantities, summary: dict[str, Any], plant: Callable[[], PlantBand]
) -> dict[str, Any]:
    """For the page, as plain data; `why_not` if nothing can be tried, `band_why_not` if the bounds are unknown."""
    feedback = quantities.feedback
    if feedback is None and quantities.own != "open loop":
        return {"why_not": for_page(quantities.why_not("open loop"))}
    checked = checked_loop(past.directory, recorded_loop(summary))
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
    found = {
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
    return {"band": found, "band_why_not": ""}


def _responses(past: Past) -> Responses:
    """Those that `livebode tune` uses, if they can be read soon."""
    if past.readable and _size_bytes(past.directory) <= _READ_BYTES:
        return Responses.join(list(past.record().steady_batches()))
    found = next(past.all_between(-inf, inf)) if past.overview is None else past.overview
    return found[np.flatnonzero(found.ready)]


def _size_bytes(directory: Path) -> int:
    return sum(path.stat().st_size for path in directory.rglob("responses*.parquet"))


def filter_rate_hz(model: Model, rate_hz: float) -> float:
    """Of the innermost controller, with which filters are computed."""
    inner = model.velocity if isinstance(model, Cascade) else model
    return float(getattr(inner, "rate_hz", rate_hz))


def _parts(parts: FeedbackParts) -> dict[str, Any]:
    def term(one: FeedbackTerm) -> dict[str, Any]:
        return {"name": one.name, "power": one.power, **_complex(one.curve)}

    return {"terms": [term(one) for one in parts.terms], "outer": None if parts.outer is None else term(parts.outer)}


def _complex(values: NDArray[np.complex128]) -> dict[str, list[float]]:
    return {"re": values.real.tolist(), "im": values.imag.tolist()}
