"""A model fitted to a finished run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from livebode.analysis._averaged import RunMean, averaged
from livebode.configuration import FitSection, chosen_model, fit_settings
from livebode.core import read_unit, split_plant_unit
from livebode.fitting import Chain, Fit, TwoMassGain, fit
from livebode.language import Message
from livebode.records import RunRecord
from livebode.sources import negated

MISFIT_MAX = 0.3  # of |G|: the model error from which a finished run's fit is refused


def fit_run(directory: Path, section: FitSection, entry: str | None = None) -> tuple[Fit, str]:
    """A model fitted to a finished run or to an entry of a matrix run, and a description of what it was fitted to.

    For a run that averages, the newest valid response; else the mean of all. If the run has no units, and its
    configuration does not specify whether the output is a velocity or a position, the one with the smaller misfit is
    used. A fit whose model error is 30 % of |G| or more is refused.
    """
    return fit_averaged(averaged(RunRecord.open(directory, entry=entry)), section)


def fit_averaged(of: RunMean, section: FitSection) -> tuple[Fit, str]:
    """Model fitted to the average of a run, and its sentence."""
    words = of.words
    if not of.response.unit:
        words = Message("{mean}; the run has no units: N m, and rad/s or rad are assumed", mean=words)
    return _best(of, section), words


def better_output(of: RunMean, section: FitSection) -> str:
    """Whether the output is a velocity or a position, by the smaller misfit."""
    return _taken(_better(of, section))


def _better(of: RunMean, section: FitSection) -> Fit:
    sections = [section]
    if section.output == "auto" and of.kinds.output is None:
        sections = [section.model_copy(update={"output": output}) for output in ("velocity", "position")]
    fits = [fit(of.response, chosen_model(candidate, of.kinds), **fit_settings(candidate)) for candidate in sections]
    return min(fits, key=lambda candidate: candidate.epsilon if candidate.status == "ok" else np.inf)


def _best(of: RunMean, section: FitSection) -> Fit:
    """The fit; the one with the smaller misfit, where the quantity of the output is not known."""
    best = _better(of, section)
    if best.status != "ok" or best.epsilon < MISFIT_MAX:
        return best
    taken = _taken(best)
    return best.refused(
        f"as a {taken} the output differs from the {best.model.name} model by {100 * best.epsilon:.0f} % of |G| (limit "
        f"{100 * MISFIT_MAX:.0f} %), so its parameters have no meaning: set fit.output, or fit another model"
    )


def _taken(fitted: Fit) -> str:
    """Quantity for which the output was taken."""
    assert isinstance(fitted.asked, Chain | TwoMassGain)  # `chosen_model` gives no other
    return fitted.asked.output


def fit_remarks(of: RunMean, section: FitSection, fitted: Fit, output: str, *, live: bool = False) -> list[str]:
    """Which quantity the output was taken for and why; and if the fit fails, whether the output is inverted.

    `output` is the name of its channel, and `live` whether the run is on a live source, which computes no channels.
    """
    unit = split_plant_unit(of.response.unit)[0]
    if section.output != "auto":
        taken: str = section.output
        why = "as fit.output specifies"
    elif of.kinds.output is not None:
        taken = "velocity" if of.kinds.output == "velocity" else "position"
        why = f"by its unit {unit}" if read_unit(unit).kind == of.kinds.output else "as source.kinds declares"
    else:
        taken = _taken(fitted)
        why = "because neither a unit nor a kind is known"
        why = f"which has the smaller misfit, {why}" if fitted.status == "ok" else why
    remarks = [f"the output {output!r} is fitted as a {taken}, {why}"]
    if fitted.status != "ok":
        turned = replace(of, response=replace(of.response, value=-of.response.value))
        other = fit_averaged(turned, section)[0]
        if other.status == "ok":
            remedy = f"run the recording again with the output {negated(output)!r}"
            remarks.append(
                f"the model fits with the other sign (model error {100 * other.epsilon:.2g} %): output or input is "
                f"inverted; {'change the sign in the drive' if live else remedy}"
            )
        else:
            remarks.append("for a machine that is not such a drive, fit its modes: --model modal, or --model rational")
    return remarks


def plain_fit(fitted: Fit) -> dict[str, Any]:
    """One fit as plain data."""
    quantities: dict[str, dict[str, Any]] = {
        name: {"value": value, "bound_95": bound, "unit": unit} for name, value, bound, unit in fitted.rows()
    }
    for name, quantity in quantities.items():
        if (limit := fitted.at_most(name)) is not None:
            quantity["at_most"] = limit
        if quantity["bound_95"] == 0:
            quantity["fixed"] = True
    return {
        "model": fitted.asked.name if fitted.asked is not None else fitted.model.name,
        "status": fitted.status,
        "message": fitted.sentence,
        "taken": list(fitted.taken),
        "complete": fitted.complete,
        "about_bounds": fitted.about_bounds,
        "time_s": float(fitted.parameters.time_s[0]),
        "schedule": float(fitted.parameters.schedule[0]),
        "band_hz": list(fitted.band_hz),
        "lines": fitted.lines,
        "epsilon": fitted.epsilon,
        "reduced_chi2": fitted.chi2,
        "held": fitted.held,
        "quantities": quantities,
    }
