"""A trial of the page: its controllers and filters, from the text of the address, and its steps and torque noise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.analysis import stable
from livebode.arrays import Floats
from livebode.core import Algebra, Model, TuneError, UsageError
from livebode.dataclass import dataclass
from livebode_control.tuning.feedback_parts import FeedbackParts
from livebode_control.tuning.filters import Biquad, low_pass, notch
from livebode_control.tuning.plant_band import PlantBand
from livebode_control.tuning.predicted_steps import PredictedStep, predicted_steps
from livebode_control.tuning.problem import TuningProblem
from livebode_control.tuning.proposal import margins_of
from livebode_control.tuning.specification import LoopSpecification
from livebode_control.tuning.structure import FeedbackStructure

_NOTCHES_MAX = 4
_SIZE = (1e-12, 1e12)  # of a gain or a time
_DEPTH_DB_MAX = 200.0
_DAMPING = (1e-6, 1e3)
_DELAY_MS_MAX = 10_000.0


@dataclass(frozen=True)
class TrialFeedback(Algebra):
    """F with other parameters, filters in series and a delay.

    Attributes
    ----------
    controller
        The described one.
    values
        Parameters of FeedbackParts that differ from the described ones.
    filters
        In series with it.
    delay_s
        Additional delay.
    """

    controller: Model
    values: Mapping[str, float]
    filters: tuple[Biquad, ...] = ()
    delay_s: float = 0.0

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        f = np.asarray(frequency_hz, dtype=np.float64)
        response = FeedbackParts.of(self.controller, f).response(self.values)
        for filter_ in self.filters:
            response = response * filter_.response(f)
        return np.asarray(response * np.exp(-2j * np.pi * f * self.delay_s))


def trial_feedback(text: str, controller: Model, rate_hz: float) -> TrialFeedback:
    """From "gain~0.4~~notch~60~20~0.3~~low-pass~300~~delay~0.5"; the notch has Hz, dB and damping, the delay is in ms.

    Raises
    ------
    UsageError
        If the text is not a trial, or a value is out of its range.

    Examples
    --------
    >>> from livebode import PID
    >>> feedback = trial_feedback("gain~0.4~~delay~0.5", PID(gain=0.2, rate_hz=4000), 4000)
    >>> feedback.values, feedback.delay_s
    ({'gain': 0.4}, 0.0005)
    """
    known = FeedbackParts.of(controller, np.array([rate_hz / 8])).values
    values: dict[str, float] = {}
    notches: list[Biquad] = []
    low_passes: list[Biquad] = []
    delay_ms = 0.0
    for part in filter(None, text.split("~~")):
        name, *words = part.split("~")
        numbers = [_number(word, part) for word in words]
        if name == "notch" and len(numbers) == 3 and len(notches) < _NOTCHES_MAX:
            hz, depth_db, damping = numbers
            _check(part, abs(depth_db) <= _DEPTH_DB_MAX and _DAMPING[0] <= damping <= _DAMPING[1] and hz > 0)
            notches.append(notch(hz, depth_db, damping, rate_hz))
        elif name == "low-pass" and len(numbers) == 1 and not low_passes:
            _check(part, numbers[0] > 0)
            low_passes.append(low_pass(numbers[0], rate_hz))
        elif name == "delay" and len(numbers) == 1:
            _check(part, 0 <= numbers[0] <= _DELAY_MS_MAX)
            delay_ms = numbers[0]
        else:
            _check(part, name in known and len(numbers) == 1 and _SIZE[0] <= abs(numbers[0]) <= _SIZE[1])
            values[name] = numbers[0]
    return TrialFeedback(controller, values, (*notches, *low_passes), delay_ms / 1000)


def _number(word: str, part: str) -> float:
    try:
        return float(word[:40])
    except ValueError:
        raise _not_a_trial(part) from None


def _check(part: str, good: bool) -> None:
    if not good:
        raise _not_a_trial(part)


def _not_a_trial(part: str) -> UsageError:
    return UsageError(
        "unreadable",
        f"trial={part[:60]!r} is not a gain, time or filter of this loop within its range",
        "reset the sliders, or reload the page",
        argument="trial",
        value=part[:60],
    )


_TIMES = 200
_BANDWIDTHS = 3.0  # shown time times the lower bandwidth, as in tune.svg
_LOWEST = 1e-2  # of the lowest line: the lowest bandwidth for which the time is chosen


def trial_steps(plant: PlantBand, described: Model, tried: Model, *, of_plant: bool) -> dict[str, Any]:
    """Steps as plain data; `after` is None where the tried loop is unstable, `before` where the described one is.

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
    kept = {side: model for side, model in models.items() if _stable(plant, model)}
    if "after" not in kept:
        return {"before": None, "after": None}
    time_s = np.linspace(0, _BANDWIDTHS / min(_bandwidth_hz(plant, model) for model in kept.values()), _TIMES)
    sides = {side: _side(plant, model, described, time_s, of_plant) for side, model in kept.items()}
    return {"time_ms": (1e3 * time_s).tolist(), "before": None, **sides}


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
    values = {"value": _rms(power)}
    if not banded:
        return {**values, "low": None, "high": None}
    middle, reach = _distances(plant, feedback)
    own = power * np.abs(1 + plant.value * behind) ** 2
    return {**values, "low": _rms(own / (middle + reach) ** 2), "high": _rms(own / (middle - reach) ** 2)}


def _rms(power: Floats) -> float:
    return float(np.sqrt(power.sum(axis=1).max()))
