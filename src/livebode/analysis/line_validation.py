"""A run's fitted models judged at the lines of another run."""

from __future__ import annotations

from pathlib import Path
from typing import cast

from livebode.analysis._averaged import averaged
from livebode.analysis.fits import fit_averaged
from livebode.analysis.poles import fit_poles
from livebode.configuration import FitSection
from livebode.core import FitError, GridError
from livebode.fitting import POLE_MODELS, CommonPoles, Fit, Kind
from livebode.language import Message
from livebode.records import RunRecord
from livebode.validation import LineValidation, fitted_model, validate_at_lines


def validate_run_at_lines(
    directory: Path,
    other: Path,
    sections: list[tuple[FitSection, str]],
    drifting: dict[str, str],
    entry: str | None = None,
) -> tuple[list[LineValidation], list[str]]:
    """One verdict for the model of each section with the reason for judging it at lines, and remarks.

    Of matrix runs, those of one `entry` are compared. A section without a reason is judged if its model is in
    `drifting`, models by name with their reasons.

    Raises
    ------
    GridError
        If the runs have different quantities or units.
    FitError
        If no model could be fitted.
    SignalError
        If the other run has no usable lines.
    """
    runs = [RunRecord.open(path, entry=entry) for path in (directory, other)]
    for what in ("quantity", "unit"):
        one, two = (run.found.get(what, "") for run in runs)
        if one != two:
            raise GridError(
                "not-alike",
                f"{directory.name!r} has the {what} {one!r} and {other.name!r} {two!r}",
                "validate on a run of the same input and output",
                what=what,
                values=[one, two],
            )
    average, response = averaged(runs[0]), averaged(runs[1]).response
    fits: list[tuple[Fit | CommonPoles, str]] = []
    for section, reason in sections:
        if section.model in POLE_MODELS:
            fits.append((fit_poles(runs[:1], cast(Kind, section.model), section)[0], reason))
        else:
            fits.append((fit_averaged(average, section)[0], reason))
    with_reasons = [(fit, reason or drifting.get(_name(fit), "")) for fit, reason in fits if fit.status == "ok"]
    judged = [validate_at_lines(fitted_model(fit), response, reason=why) for fit, why in with_reasons if why]
    refused: list[str] = [
        Message("{model} was not fitted: {why}", model=_name(fit), why=fit.sentence)
        for fit, _ in fits
        if fit.status != "ok"
    ]
    if not judged:
        raise FitError("not-fitted", "; ".join(refused), "fit another model", models=[_name(fit) for fit, _ in fits])
    return judged, refused


def _name(fit: Fit | CommonPoles) -> str:
    return fit.model if isinstance(fit, CommonPoles) else fit.model.name
