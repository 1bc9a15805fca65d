"""Steps and torque noise of the described loop and of a trial, as `livebode tune` predicts them, for the page."""

from __future__ import annotations

from typing import Any

import numpy as np

from livebode.analysis import stable
from livebode.arrays import Floats
from livebode.core import Model, TuneError
from livebode_control.tuning.plant_band import PlantBand
from livebode_control.tuning.predicted_steps import PredictedStep, predicted_steps
from livebode_control.tuning.problem import TuningProblem
from livebode_control.tuning.proposal import margins_of
from livebode_control.tuning.specification import LoopSpecification
from livebode_control.tuning.structure import FeedbackStructure

_TIMES = 200
_BANDWIDTHS = 3.0  # shown time times the lower bandwidth, as in tune.png
_LOWEST = 1e-2  # of the lowest line: the lowest bandwidth for which the time is chosen


def trial_steps(plant: PlantBand, described: Model, tried: Model, *, of_plant: bool) -> dict[str, Any]:
    """As plain data; `after` is None where the tried loop is unstable, `before` where the described one is.

    The steps are those of the first place. Bands are None where a plant within the bounds may be unstable: what is
    drawn around the measured plant has no step then. The noise is the rms of the plant input for white noise of 1 at
    the output, of the worst place, with its range over all plants within the bounds.

    Parameters
    ----------
    plant
        The plant with its bounds.
    described, tried
        F before and after.
    of_plant
        Whether `plant` is the plant. Else it is L, and neither a disturbance at its input nor its input has a unit.
    """
    models = {"before": described, "after": tried}
    kept = {side: one for side, one in models.items() if _stable(plant, one)}
    if "after" not in kept:
        return {"before": None, "after": None}
    time_s = np.linspace(0, _BANDWIDTHS / min(_bandwidth_hz(plant, one) for one in kept.values()), _TIMES)
    found = {side: _side(plant, one, described, time_s, of_plant) for side, one in kept.items()}
    return {"time_ms": (1e3 * time_s).tolist(), "before": None, **found}


def _stable(plant: PlantBand, feedback: Model) -> bool:
    """At every place, by Nyquist's criterion."""
    return bool(stable(plant.value * feedback.response(plant.frequency_hz), plant.frequency_hz).all())


def _bandwidth_hz(plant: PlantBand, feedback: Model) -> float:
    """Between limits, so that the shown time is one."""
    return float(
        np.clip(margins_of(plant, feedback, 0.0).bandwidth_hz, _LOWEST * plant.lines_hz[0], plant.lines_hz[-1])
    )


def _side(plant: PlantBand, feedback: Model, described: Model, time_s: Floats, of_plant: bool) -> dict[str, Any]:
    banded = _certain(plant, feedback)
    reference, disturbance = predicted_steps(plant.at([0]), feedback, time_s)
    return {
        "reference": _plain(reference, banded),
        "disturbance": _plain(disturbance, banded) if of_plant else None,
        "noise": _noise(plant, feedback, described, banded) if of_plant else None,
    }


def _distances(plant: PlantBand, feedback: Model) -> tuple[Floats, Floats]:
    """|1 + L|, and how much less or more it may be within the bounds; above the lines only |L| is limited."""
    behind = feedback.response(plant.frequency_hz)
    loop, radius = plant.value * behind, plant.radius * np.abs(behind)
    return np.where(plant.above, 1.0, np.abs(1 + loop)), np.where(plant.above, np.abs(loop), radius)


def _certain(plant: PlantBand, feedback: Model) -> bool:
    """Whether no plant within the bounds is unstable: none makes L reach −1."""
    middle, reach = _distances(plant, feedback)
    return bool((reach < middle).all())


def _plain(step: PredictedStep, banded: bool) -> dict[str, Any]:
    band = {"low": step.low.tolist(), "high": step.high.tolist()} if banded else {"low": None, "high": None}
    return {"value": step.value.ravel().tolist(), **band}


def _noise(plant: PlantBand, feedback: Model, described: Model, banded: bool) -> dict[str, float | None] | None:
    """None for a controller that `livebode tune` does not know."""
    f = plant.frequency_hz
    try:
        problem = TuningProblem(FeedbackStructure(described, f), plant, LoopSpecification())
    except TuneError:
        return None
    behind = feedback.response(f)
    power = problem.noise_powers(behind)
    found = {"value": _rms(power)}
    if not banded:
        return {**found, "low": None, "high": None}
    middle, reach = _distances(plant, feedback)
    own = power * np.abs(1 + plant.value * behind) ** 2
    return {**found, "low": _rms(own / (middle + reach) ** 2), "high": _rms(own / (middle - reach) ** 2)}


def _rms(power: Floats) -> float:
    return float(np.sqrt(power.sum(axis=1).max()))
