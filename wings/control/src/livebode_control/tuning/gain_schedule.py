"""Gains that follow the position, safe at the places and between them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import Loop, Responses, UsageError
from livebode.dataclass import dataclass
from livebode_control.tuning.plant_band import PlantBand
from livebode_control.tuning.predicted import PredictedMargins
from livebode_control.tuning.problem import TuningProblem
from livebode_control.tuning.proposal import ControllerProposal, margins_of, tune
from livebode_control.tuning.reach import PromiseReach
from livebode_control.tuning.search import improved, search
from livebode_control.tuning.specification import LoopSpecification
from livebode_control.tuning.structure import FeedbackStructure, TunedFeedback

_BETWEEN = np.linspace(0, 1, 5)
_BACK = 5  # steps of the way back to one controller for all places
_DOWN = (0.0, 0.02, 0.05, 0.1)  # of the logarithm of the gain


@dataclass(frozen=True, eq=False)
class GainSchedule:
    """Gains at each place; between two places their logarithms are interpolated linearly over the position.

    Attributes
    ----------
    common
        The proposal of one controller for all places; its filters are those of every place.
    position
        Of the places, ascending, shape (places,).
    share
        Part of the way from the common gains to those of each place alone; 0: the common gains everywhere.
    names
        Of the gains and times.
    logarithms
        Shape (places, names).
    common_logarithms
        Of the common gains, shape (names,).
    promised, common_promised
        Margins at each place, of the worst plant within the band, with its gains and with the common ones.
    reach
        Up to which frequency `promised` holds, and above it for which resonances, at the worst place.
    """

    common: ControllerProposal
    position: Floats
    share: float
    names: tuple[str, ...]
    logarithms: Floats
    common_logarithms: Floats
    promised: tuple[PredictedMargins, ...]
    common_promised: tuple[PredictedMargins, ...]
    reach: PromiseReach

    def at(self, position: float) -> TunedFeedback:
        """The controller and its filters at a position; beyond the places that of the nearest one."""
        x = np.array([np.interp(position, self.position, column) for column in self.logarithms.T])
        return _structure(self.common).feedback(x)

    def csv(self) -> str:
        """A line for each place: position, gains and times."""
        rows = np.column_stack([self.position, np.exp(self.logarithms)]).tolist()
        return "\n".join([",".join(("position", *self.names)), *(",".join(map(repr, row)) for row in rows), ""])

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "share": self.share,
            "position": self.position.tolist(),
            **{name: np.exp(column).tolist() for name, column in zip(self.names, self.logarithms.T)},
            "promised": [place.plain() for place in self.promised],
            "common_promised": [place.plain() for place in self.common_promised],
            "reach": self.reach.plain(),
        }


def gain_schedule(
    responses: Responses, loop: Loop, specification: LoopSpecification, *, loop_checked: bool
) -> GainSchedule:
    """Gains for each place that keep the limits also with the plants of its neighbours; filters do not change.

    Between two places, the interpolated gains keep the limits with every plant within the bounds of either place,
    tested at five points. Where they do not, the gains are lowered by up to 10 %,
    and all move towards the common ones, until they do. The position is
    taken as constant while the loop settles.

    Parameters
    ----------
    responses
        Of the plant, a row for each place, with a schedule.
    loop, specification, loop_checked
        As of `tune`.

    Raises
    ------
    TuneError
        As `tune`, for one controller for all places.
    UsageError
        If there are fewer than two places.
    """
    responses = responses[np.argsort(responses.schedule, kind="stable")]
    position = responses.schedule
    if position.size < 2 or not np.all(np.diff(position) > 0):
        raise UsageError(
            "missing",
            f"gains over the position need two places or more, and the run has {int(np.isfinite(position).sum())}",
            "set signals.schedule to the position, and move the axis",
            argument="responses",
        )
    common = tune(responses, loop, specification, loop_checked=loop_checked)
    plain = replace(specification, notches=0, low_pass=False)
    structure = _structure(common)
    whole = structure.start
    alone = np.stack([_alone(common, plain, place, whole) for place in range(position.size)])
    share, x = _safest(structure, common.plant, plain, whole, alone)
    places = range(position.size)
    promised = tuple(_promised(structure, common.plant, x[place], place) for place in places)
    common_promised = tuple(_promised(structure, common.plant, whole, place) for place in places)
    open_loop = np.stack([structure.response(x[place])[0] for place in places]) * common.plant.value
    reach = PromiseReach.of(common.plant, open_loop, min(margins.largest_unknown for margins in promised))
    return GainSchedule(common, position, share, structure.names, x, whole, promised, common_promised, reach)


def _structure(common: ControllerProposal) -> FeedbackStructure:
    """The gains of the proposed controller, with its filters as they are."""
    feedback = common.feedback
    return FeedbackStructure(feedback.controller, common.plant.frequency_hz, fixed=feedback)


def _alone(common: ControllerProposal, specification: LoopSpecification, place: int, whole: Floats) -> Floats:
    """Logarithms of the gains for a place and its neighbours: the better of two searches, one from the common gains."""
    plant = common.plant.at([i for i in (place - 1, place, place + 1) if 0 <= i < len(common.plant.value)])
    nearby = improved(TuningProblem(_structure(common), plant, specification), whole)
    result = search(common.loop.feedback, plant, specification, common.feedback)
    return nearby.x if result is None or result.merit < nearby.merit else result.x


def _safest(
    structure: FeedbackStructure, plant: PlantBand, specification: LoopSpecification, common: Floats, alone: Floats
) -> tuple[float, Floats]:
    """The largest part of the way to the gains of each place, and these gains, reduced until the limits are kept."""
    for share in np.linspace(1, 0, _BACK, endpoint=False):
        for down in _DOWN:
            x = common + share * (alone - common)
            x[:, 0] -= down
            if _safe(structure, plant, specification, x):
                return float(share), x
    return 0.0, np.broadcast_to(common, alone.shape)


def _safe(structure: FeedbackStructure, plant: PlantBand, specification: LoopSpecification, x: Floats) -> bool:
    """Whether the gains keep the limits at every place and between neighbours, with the plants of both."""
    for i in range(len(x) - 1):
        problem = TuningProblem(structure, plant.at([i, i + 1]), specification)
        if not all(problem.feasible(x[i] + part * (x[i + 1] - x[i])) for part in _BETWEEN):
            return False
    return True


def _promised(structure: FeedbackStructure, plant: PlantBand, x: Floats, place: int) -> PredictedMargins:
    return margins_of(plant.at([place]), structure.feedback(x).model, 1.0)
