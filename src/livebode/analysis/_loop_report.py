"""The loop of a run: its margins, also over the schedule, and a proposal that increases them."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from livebode.analysis.fits import fit_run
from livebode.analysis.loop_verdict import NOT_CHECKED, CheckedLoop, checked_loop
from livebode.analysis.place_fits import by_place
from livebode.configuration import Axis, FitSection, LoopSection, recorded_configuration
from livebode.core import FitError, Loop, Parameters, Responses
from livebode.fitting import Fit, Fitter, mean_response
from livebode.language import Message
from livebode.margins import (
    CONTRADICTED,
    Margins,
    OpenLoop,
    Tuning,
    against_lines,
    margins,
    peak_sensitivity_at_lines,
    tuning,
    worst,
)
from livebode.records import RunRecord


@dataclass(frozen=True, eq=False)
class LoopReport:
    """Properties of the loop of a run.

    Attributes
    ----------
    fit, of
        The fitted plant, and a description of what it was fitted to.
    loop
        The open loop around it.
    margins
        One row, of `fit`.
    at_lines
        Largest |S| at a line with its bound, and that line in Hz: known without a model.
    places
        Margins over the schedule, if the run has one; else the same as `margins`.
    tuning
        Proposed change, judged over the places.
    responses
        Measured response, one row.
    checked
        Whether the description of the controllers was checked.
    """

    fit: Fit
    of: str
    loop: OpenLoop
    margins: Margins
    at_lines: tuple[float, float, float]
    places: Margins
    tuning: Tuning
    responses: Responses
    checked: CheckedLoop = NOT_CHECKED

    @property
    def message(self) -> str:
        """Why there are no margins; empty if there are."""
        status = str(self.margins.status[0])
        if status == CONTRADICTED:
            size, _, at_hz = self.at_lines
            return Message(
                "the {model} model contradicts the lines: they show Ms of at least {size:.3g} at {at_hz:g} Hz, more "
                "than the model allows; free a parameter (a delay: --free delay), choose another model, or correct "
                "the description of the controllers under [loop]",
                model=self.fit.model.name,
                size=size,
                at_hz=at_hz,
            )
        return (
            ""
            if self.margins.ok[0]
            else Message("{why}; check the loop's description and the fit", why=Message(status))
        )

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        bound = self.margins.bound()[0]
        found = {
            name: {
                "value": float(self.margins.value[0, i]),
                "bound_95": float(bound[i]),
                "unit": self.margins.units[i],
                "frequency_hz": float(self.margins.frequency_hz[0, i]),
                "place": str(self.margins.place[0, i]),
            }
            for i, name in enumerate(self.margins.names)
        }
        size, around, at_hz = self.at_lines
        return {
            "fitted_to": self.of,
            "model": self.fit.model.name,
            "status": str(self.margins.status[0]),
            "message": self.message,
            "margins": found,
            "peak_sensitivity_at_lines": {"at_least": size, "bound": around, "frequency_hz": at_hz},
            "places": len(self.places),
            "worst_over_places": worst(self.places),
            "tuning": self.tuning.plain(),
            "loop_check": asdict(self.checked),
        }


def loop_of_run(
    directory: Path,
    section: FitSection | None = None,
    axis: Axis | None = None,
    peak_sensitivity: float = 2.0,
    entry: str | None = None,
) -> LoopReport:
    """The report of a finished run; loop and model are from `axis` and `section`, else from its configuration.

    Of a matrix run that of one `entry`, with the controller between its output and its input; all other loops are open.

    Raises
    ------
    UsageError
        If the loop's feedback is missing.
    FitError
        If no model could be fitted.
    """
    run = RunRecord.open(directory, entry=entry)
    own_words = recorded_configuration(run.summary)
    loop = axis.loop if axis is not None else LoopSection.model_validate(own_words.get("loop", {}))
    if section is None:
        own = axis.fit if axis is not None else None
        section = own or FitSection.model_validate(own_words.get("fit", {}))
    found, words = fit_run(directory, section, entry)
    responses = Responses.join(list(run.steady_batches()))  # the fitted responses
    report = loop_report(found, words, responses, loop.build(responses.lines.rate_hz), peak_sensitivity)
    return replace(report, checked=checked_loop(directory, loop, run.selected))


def loop_report(fit: Fit, words: str, responses: Responses, loop: Loop, peak_sensitivity: float = 2.0) -> LoopReport:
    """The report of a fit and of its responses."""
    if fit.status != "ok":
        raise FitError(
            "not-fitted",
            f"margins need a valid fit: {fit.sentence}",
            "fit another model",
            models=[fit.model.name],
        )
    around = OpenLoop(fit.model, loop, fit.rate_hz, fit.hold)
    fits, mean = fit.parameters, mean_response(responses)
    fitted_to = fit.measured if fit.measured is not None else mean
    measured = fitted_to
    if len(places := by_place(responses)) > 1:
        free = [name for name in fit.model.names if name not in fit.held]
        over = Fitter(fit.model, fixed=fit.held, free=free, band_hz=fit.band_hz, hold=fit.hold).process(places)
        # The fit may belong to one time, and is not better than the worst of them.
        if over.ok.sum() > len(places) // 2:
            fits, measured = Parameters.join([over, fits]), Responses.join([places, fitted_to])
    every = against_lines(margins(fits, around, fit.band_hz), measured, loop)
    return LoopReport(
        fit=fit,
        of=words,
        loop=around,
        margins=every[-1:],
        at_lines=tuple(float(x[0]) for x in peak_sensitivity_at_lines(fitted_to, loop)),  # type: ignore[arg-type]
        places=every,
        tuning=_tuned(fits, every, around, fit.band_hz, peak_sensitivity),
        responses=mean,
    )


def _tuned(
    fits: Parameters, read: Margins, loop: OpenLoop, band_hz: tuple[float, float], peak_sensitivity: float
) -> Tuning:
    """A filter from the fits; none if the lines contradict one of them."""
    if wrong := int(np.count_nonzero(read.status == CONTRADICTED)):
        sentence = Message(
            "the lines contradict {wrong} of {count} fits: a filter cannot be judged with such a model",
            wrong=wrong,
            count=len(read),
        )
        return Tuning("refused", sentence, read)
    rate_hz = getattr(getattr(loop.loop.feedback, "velocity", loop.loop.feedback), "rate_hz", None)
    return tuning(fits, loop, band_hz, controller_rate_hz=rate_hz, peak_sensitivity=peak_sensitivity)
