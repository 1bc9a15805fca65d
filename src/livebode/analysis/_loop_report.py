"""The loop of a run: its margins, also over the schedule."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from livebode.analysis._margins import CONTRADICTED, Margins, against_lines, peak_sensitivity_at_lines, worst
from livebode.analysis.fit_margins import among_competitors
from livebode.analysis.fits import by_place
from livebode.analysis.margin_reading import margins
from livebode.analysis.open_loop import OpenLoop
from livebode.configuration import LoopSection, without_null
from livebode.core import FitError, Loop, Parameters, Responses
from livebode.dataclass import dataclass
from livebode.fitting import Fit, Fitter, mean_response
from livebode.language import Message
from livebode.records import read_loop_check


@dataclass(frozen=True)
class CheckedLoop:
    """Whether the description of a loop was checked, in short.

    Attributes
    ----------
    verdict
        "as described", "one change", "not explained", or "not checked".
    sentence
        The result, or why there is none.
    """

    verdict: str
    sentence: str


NOT_CHECKED = CheckedLoop("not checked", "loop not checked: its description was not compared with the signals")
CHANGED = CheckedLoop("not checked", "loop not checked: another description was compared with the signals")


def checked_loop(directory: Path, section: LoopSection, entry: tuple[str, str] | None = None) -> CheckedLoop:
    """What is known of this description of a run's loop: the newest check, if it was of the same description.

    With the output and the input of an `entry` of a matrix run, `section` describes its controller alone.
    """
    stored = read_loop_check(directory)
    if stored is None:
        return NOT_CHECKED
    try:
        of = LoopSection.model_validate(without_null(stored["loop"]))
        if entry is not None:
            of, stored = of.of_controller(*entry), stored["controllers"]["/".join(entry)]
    except (ValueError, AttributeError, KeyError, TypeError):
        return CHANGED
    return CheckedLoop(str(stored.get("verdict")), str(stored["sentence"])) if of == section else CHANGED


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
    places, fits
        Margins over the schedule, if the run has one, and the fits that they are of; else the same as `margins`.
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
    fits: Parameters
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

    def plain(self, tuning: dict[str, Any] | None) -> dict[str, Any]:
        """For JSON, with the proposed filter, if one was looked for."""
        bound = self.margins.bound()[0]
        margins = {
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
            "margins": margins,
            "peak_sensitivity_at_lines": {"at_least": size, "bound": around, "frequency_hz": at_hz},
            "places": len(self.places),
            "worst_over_places": worst(self.places),
            **({} if tuning is None else {"tuning": tuning}),
            "loop_check": asdict(self.checked),
        }


def loop_report(fit: Fit, words: str, responses: Responses, loop: Loop) -> LoopReport:
    """The report of a fit and of its responses, with what the lines do not rule out in the bounds of its margins."""
    if fit.status != "ok":
        raise FitError(
            "not-fitted",
            f"margins need a valid fit: {fit.sentence}",
            "set fit.output, or fit another model",
            models=[fit.model.name],
        )
    every_model, fit = fit, fit.with_unseen()
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
    read = among_competitors(margins(fits, around, fit.band_hz), every_model, loop)
    every = against_lines(read, measured, loop)
    return LoopReport(
        fit=fit,
        of=words,
        loop=around,
        margins=every[-1:],
        at_lines=tuple(float(x[0]) for x in peak_sensitivity_at_lines(fitted_to, loop)),  # type: ignore[arg-type]
        places=every,
        fits=fits,
        responses=mean,
    )
