"""Margins of the loop of a run, and a filter that increases them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from livebode.analysis import CONTRADICTED, LoopReport, checked_loop, fit_run, loop_report
from livebode.configuration import Axis, FitSection, LoopSection, recorded_configuration
from livebode.core import Responses
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.records import RunRecord
from livebode_control.tuning.filter_proposal import Tuning, tuning


@dataclass(frozen=True, eq=False)
class LoopMargins:
    """The report of a loop, and the proposed filter, judged over its places."""

    report: LoopReport
    tuning: Tuning

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return self.report.plain(self.tuning.plain())


def margins_of_run(
    directory: Path,
    section: FitSection | None = None,
    axis: Axis | None = None,
    peak_sensitivity: float = 2.0,
    entry: str | None = None,
) -> LoopMargins:
    """Margins and filter of a finished run; loop and model are from `axis` and `section`, else from its configuration.

    Of a matrix run those of one `entry`, with the controller between its output and its input; all other loops are
    open.

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
    fit, words = fit_run(directory, section, entry)
    responses = Responses.join(list(run.steady_batches()))  # the fitted responses
    report = loop_report(fit, words, responses, loop.build(responses.lines.rate_hz))
    report = replace(report, checked=checked_loop(directory, loop, run.selected))
    return LoopMargins(report, filter_of(report, peak_sensitivity))


def filter_of(report: LoopReport, peak_sensitivity: float = 2.0) -> Tuning:
    """A filter for the loop; none if the lines contradict one of the fits."""
    if wrong := int(np.count_nonzero(report.places.status == CONTRADICTED)):
        sentence = Message(
            "the lines contradict {wrong} of {count} fits: a filter cannot be judged with such a model",
            wrong=wrong,
            count=len(report.places),
        )
        return Tuning("refused", sentence, report.places)
    feedback = report.loop.loop.feedback
    rate_hz = getattr(getattr(feedback, "velocity", feedback), "rate_hz", None)
    return tuning(
        report.fits, report.loop, report.fit.band_hz, controller_rate_hz=rate_hz, peak_sensitivity=peak_sensitivity
    )


def plain_filter(report: LoopReport) -> dict[str, Any]:
    """The filter for the loop as run.json contains it."""
    return filter_of(report).plain()
