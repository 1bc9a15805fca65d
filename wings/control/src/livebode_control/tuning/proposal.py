"""tune: a controller for the measured plant, with what it promises and what limits it."""

from __future__ import annotations

from dataclasses import asdict, replace
from math import inf
from typing import Any

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import Lines, Loop, Model, PositionPD, Responses, TuneError
from livebode.dataclass import dataclass
from livebode_control.tuning.coverage import check_coverage, missing_resonances
from livebode_control.tuning.missing_lines import MissingLines
from livebode_control.tuning.plant_band import PlantBand
from livebode_control.tuning.predicted import PredictedMargins, predicted
from livebode_control.tuning.problem import TuningProblem, noise_power
from livebode_control.tuning.reach import PromiseReach, lines_above
from livebode_control.tuning.search import SearchResult, search
from livebode_control.tuning.specification import LoopSpecification
from livebode_control.tuning.structure import TunedFeedback

_ACTIVE = 0.02  # clearance, of 1 + |L|, up to which a point limits the loop
_REACHED = 1 - 1e-3


@dataclass(frozen=True, eq=False)
class ControllerProposal:
    """A proposed controller. It is only a proposal: livebode writes nothing to a machine.

    Attributes
    ----------
    feedback
        The proposed controller and its filters.
    before, after
        Margins of the measured plant with the described and with the proposed controller, worst place; `before` is
        None where the described loop would be unstable.
    before_worst, promised
        The same for the worst plant within the band; `before_worst` without a resonance above the highest line.
    reach
        Up to which frequency `promised` holds, and above it for which resonances.
    noise
        Rms of the plant input, before and after, worst place: for the rounding to `encoder_step` in the unit of the
        input, else for white noise of 1 at the output. NaN before where the described loop would be unstable.
    specification
        What was asked.
    met
        Whether the promise has the required bandwidth.
    limited_by
        What prevents a higher bandwidth, the nearest first; sentences.
    plant
        The plant with its band.
    loop
        The described loop.
    """

    feedback: TunedFeedback
    before: PredictedMargins | None
    before_worst: PredictedMargins | None
    after: PredictedMargins
    promised: PredictedMargins
    reach: PromiseReach
    noise: tuple[float, float]
    specification: LoopSpecification
    met: bool
    limited_by: tuple[str, ...]
    plant: PlantBand
    loop: Loop

    @property
    def sentence(self) -> str:
        """The result for people."""
        limits = "; ".join(self.limited_by)
        limits = f"; limited by {limits}" if limits else ""
        if self.met:
            return f"a bandwidth of {self.promised.bandwidth_hz:.4g} Hz is promised{limits}"
        return (
            f"no controller of this structure promises a bandwidth of {self.specification.bandwidth_hz:g} Hz: the best "
            f"promises {self.promised.bandwidth_hz:.4g} Hz{limits}"
        )

    def open_loop(self, feedback: Model) -> Complex:
        """L with a feedback on the grid of `plant`, shape (places, frequencies)."""
        return np.asarray(self.plant.value * feedback.response(self.plant.frequency_hz))

    def noise_up_to(self, feedback: Model) -> Floats:
        """Rms of the plant input with a feedback, of the noise up to each frequency, worst place; ends as `noise`."""
        of_position = isinstance(self.feedback.controller, PositionPD)
        power = noise_power(self.plant.frequency_hz, self.specification.encoder_step, of_position=of_position)
        behind = feedback.response(self.plant.frequency_hz)
        total = np.cumsum(np.abs(behind / (1 + self.open_loop(feedback))) ** 2 * power, axis=1)
        return np.asarray(np.sqrt(total[int(np.argmax(total[:, -1]))]))

    def plain(self) -> dict[str, Any]:
        """For JSON; infinite margins are null."""
        return {
            "met": self.met,
            "sentence": self.sentence,
            "limited_by": list(self.limited_by),
            "specification": asdict(self.specification),
            "controller": _plain(asdict(self.feedback.controller)),
            "notches": [
                {"frequency_hz": f, "depth_db": depth, "damping": damping}
                for f, depth, damping in self.feedback.notches
            ],
            "low_passes_hz": list(self.feedback.low_passes),
            "biquads": [
                {"rate_hz": biquad.rate_hz, "b": list(biquad.b), "a": [1.0, *biquad.a]}
                for biquad in self.feedback.biquads
            ],
            "before": _margins(self.before),
            "before_worst": _margins(self.before_worst),
            "after": _margins(self.after),
            "promised": _margins(self.promised),
            "reach": self.reach.plain(),
            "noise": {"before": self.noise[0] if self.noise[0] == self.noise[0] else None, "after": self.noise[1]},
        }


def tune(
    responses: Responses,
    loop: Loop,
    specification: LoopSpecification | None = None,
    *,
    loop_checked: bool,
    rate_hz: float | None = None,
) -> ControllerProposal:
    """Propose gains and filters for the described cascade, robust for every plant within the bounds and every place.

    No model of the plant is fitted: limits are kept at the measured lines and between them (`PlantBand`). Gains, times
    and filters are optimised by SLSQP on the frequency responses, as Karimi and Kammer (A data-driven approach to
    robust control of multivariable systems by convex optimization, Automatica 85, 2017) and Hast, Åström, Bernhardsson
    and Boyd (PID design by convex-concave optimization, ECC 2013) do by convex programs; Boyd, Hast and Åström (MIMO
    PID tuning via iterated LMI restriction, Int. J. Robust Nonlinear Control 26, 2016). Without a required bandwidth,
    the weighted logarithms of the gains are maximised.

    Bias: a resonance between two lines that neither shows is not seen; `reach` has what is promised above the highest.

    Parameters
    ----------
    responses
        Of the plant, a row for each place.
    loop
        The loop with its controllers, a PID, Cascade or PositionPD.
    specification
        Limits; the defaults of LoopSpecification if None.
    loop_checked
        Whether the description of the loop was compared with the machine.
    rate_hz
        Of the loop; that of the responses by default.

    Raises
    ------
    TuneError
        If the loop was not checked, the lines have too little coherence or do not cover crossover and resonances, or
        no controller keeps the limits.

    Examples
    --------
    >>> from livebode import PID, Lines
    >>> from livebode.fitting import EvaluationGrid, TwoMass
    >>> lines = Lines.parse("2:400:2", rate_hz=4000, window=2000)
    >>> belt = TwoMass(radius_m=0.019)
    >>> values = [{"Js": 0.0028, "mL": 6.7, "Keff": 5e5, "bs": 130.0}.get(name, 0.0) for name in belt.names]
    >>> plant = np.atleast_2d(belt.at(values, EvaluationGrid.of(lines)))
    >>> ones, row = np.ones(plant.shape), np.zeros(1, dtype=int)
    >>> exact = Responses(lines, plant, 0 * ones, row + np.inf, ones, ones > 0, row, row, row + 0.0, row + 0.0)
    >>> proposal = tune(exact, Loop(PID(gain=0.2, integral_time_s=0.2, rate_hz=4000, delay_ticks=4)), loop_checked=True)
    >>> proposal.met, proposal.promised.max_sensitivity <= 2.001
    (True, True)
    """
    if not loop_checked:
        raise TuneError(
            "loop-unchecked",
            "it was not checked that the described controllers are those of the machine",
            "compare them with the recording by livebode validate --loop RUN, or confirm it",
            argument="loop_checked",
        )
    asked = specification or LoopSpecification()
    rate = rate_hz or responses.lines.rate_hz
    plant = PlantBand.of(responses, rate, coherence=asked.coherence, confidence=asked.confidence)
    best = _best(loop.feedback, plant, asked)
    if best is None:
        raise _no_start(loop.feedback, plant, asked, responses.lines)
    structure = best.problem.structure
    feedback = structure.feedback(best.x)
    open_loop = plant.value * structure.response(best.x)[0]
    check_coverage(plant, open_loop, responses.lines)
    promised = margins_of(plant, feedback.model, 1.0)
    required = asked.bandwidth_hz
    return ControllerProposal(
        feedback=feedback,
        before=_stable_margins(plant, loop, 0.0),
        before_worst=_stable_margins(plant.without_modes_above(), loop, 1.0),
        after=margins_of(plant, feedback.model, 0.0),
        promised=promised,
        reach=PromiseReach.of(plant, open_loop, promised.largest_unknown),
        noise=_input_noise(best.problem, loop, best.x),
        specification=asked,
        met=required is None or promised.bandwidth_hz >= _REACHED * required,
        limited_by=_limits(best, responses.lines),
        plant=plant,
        loop=loop,
    )


def _best(controller: Model | None, plant: PlantBand, asked: LoopSpecification) -> SearchResult | None:
    """The most robust controller with the required bandwidth; where there is none, the fastest."""
    result = search(controller, plant, asked)
    if asked.bandwidth_hz is None:
        return result
    if result is not None and _promises(result, plant, asked.bandwidth_hz):
        return result
    return search(controller, plant, replace(asked, bandwidth_hz=None))


def _promises(result: SearchResult, plant: PlantBand, bandwidth_hz: float) -> bool:
    feedback = result.problem.structure.feedback(result.x)
    return margins_of(plant, feedback.model, 1.0).bandwidth_hz >= _REACHED * bandwidth_hz


def margins_of(plant: PlantBand, feedback: Model, share: float) -> PredictedMargins:
    """Margins with this share of the band's radius, over the lines and between them.

    With a share also above the highest line, where only the largest |L| is known.
    """
    behind, known = feedback.response(plant.frequency_hz), ~plant.above
    loop, radius = plant.value * behind, share * plant.radius * np.abs(behind)
    margins = predicted(plant.frequency_hz[known], loop[:, known], radius[:, known])
    return margins.with_unknown(float((plant.rise * np.abs(loop))[:, plant.above].max())) if share else margins


def _stable_margins(plant: PlantBand, loop: Loop, share: float) -> PredictedMargins | None:
    """Margins of the described loop; None where the measured plant makes it unstable."""
    from livebode.analysis import stable

    feedback = loop.feedback
    assert feedback is not None
    around = plant.value * loop.feedback_at(plant.frequency_hz)
    return margins_of(plant, feedback, share) if stable(around, plant.frequency_hz).all() else None


def _input_noise(problem: TuningProblem, loop: Loop, x: Floats) -> tuple[float, float]:
    """Rms of the plant input, before and after."""
    before = np.nan
    if _stable_margins(problem.plant, loop, 0.0) is not None:
        behind = loop.feedback_at(problem.plant.frequency_hz)
        before = float(np.sqrt(problem.noise_powers(behind).sum(axis=1).max()))
    return before, problem.noise_gain(x)[0]


def _limits(best: SearchResult, lines: Lines) -> tuple[str, ...]:
    """The points of the curve that touch a limit, one for each limit."""
    problem, x = best.problem, best.x
    value = problem.clearances(x)
    behind = problem.structure.response(x)[0]
    loop = problem.plant.value * behind
    nearest: dict[str, tuple[float, str]] = {}
    for place, column in zip(*np.nonzero(value < _ACTIVE)):
        f, distance = problem.plant.frequency_hz[column], float(value[place, column])
        if problem.plant.above[column]:
            name, words = "above", _unknown_above(problem.plant)
            if missing := lines_above(problem.plant, loop, lines):
                words += f" ({missing.remedy})"
        else:
            name = problem.region.nearest(loop[place, column])
            share = problem.plant.radius[place, column] / np.abs(problem.plant.value[place, column])
            words = f"the {name} at {f:.4g} Hz (bound there ± {100 * share:.2g} %)"
        if name not in nearest or distance < nearest[name][0]:
            nearest[name] = distance, words
    limit = problem.specification.noise_limit
    if limit is not None and problem.noise_gain(x)[0] > 0.99 * limit:
        name_of_limit = "noise gain" if problem.specification.encoder_step is None else "input noise"
        nearest["noise"] = 0.0, f"the {name_of_limit} of {limit:g}"
    return tuple(words for _, words in sorted(nearest.values()))


def _unknown_above(plant: PlantBand) -> str:
    """What may be above the highest line, in words."""
    shown = plant.lowest_shown_hz
    reason = "the plant is unknown" if shown is None else f"the lines show a mode near {shown:.4g} Hz"
    return f"the highest line, {plant.lines_hz[-1]:g} Hz: above it {reason}"


def _no_start(controller: Model | None, plant: PlantBand, asked: LoopSpecification, lines: Lines) -> TuneError:
    """Why no setting keeps the limits: lines that do not resolve the plant, a mode above them, or wide bounds."""
    free = search(controller, plant.without_modes_above(), asked)
    if free is not None:
        loop = plant.value * free.problem.structure.response(free.x)[0]
        if above := lines_above(plant, loop, lines):
            reason = "no controller keeps the limits for all that the lines permit above them"
            return _lines_missing(f"{reason}: {_unknown_above(plant)}", above)
    if missing := missing_resonances(plant, lines):
        reason = "the lines do not resolve the response, and no controller is safe for all that it may be between them"
        return _lines_missing(reason, missing)
    share = plant.radius / np.abs(plant.value)
    index = np.unravel_index(int(np.argmax(np.where(plant.above, 0, share))), share.shape)
    return TuneError(
        "no-stable-start",
        "no controller of the described structure keeps the limits for every plant within the bounds, which are up to "
        f"± {100 * share[index]:.2g} % (at {plant.frequency_hz[index[1]]:.4g} Hz)",
        "measure longer or with more amplitude, or ask for smaller margins",
        bound=float(share[index]),
        frequency_hz=float(plant.frequency_hz[index[1]]),
    )


def _lines_missing(reason: str, missing: MissingLines) -> TuneError:
    return TuneError("lines-missing", reason, missing.remedy, lines=missing.lines, window=missing.window)


def _margins(of: PredictedMargins | None) -> dict[str, float | None] | None:
    return None if of is None else of.plain()


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    return {k: _plain(v) if isinstance(v, dict) else (None if v == inf else v) for k, v in values.items()}
