"""A model fitted to a finished run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from livebode.analysis.averaged import Averaged, averaged
from livebode.configuration.axis import FitSection
from livebode.configuration.fit_settings import chosen_model, fit_settings
from livebode.fitting import Fit, fit
from livebode.records import RunRecord


def fit_run(directory: Path, section: FitSection) -> tuple[Fit, str]:
    """A model fitted to a finished run, and a description of what it was fitted to.

    For a run that averages, the newest valid response; else the mean of all. If the run has no units, and its
    configuration does not specify whether the output is a velocity or a position, the one with the smaller misfit is
    used.
    """
    return fit_averaged(averaged(RunRecord.open(directory)), section)


def fit_averaged(of: Averaged, section: FitSection) -> tuple[Fit, str]:
    """The same for the average of a run."""
    one, words = of.response, of.words
    if not one.unit:
        words += "; the run has no units: N m, and rad/s or rad are assumed"
    sections = [section]
    if section.output == "auto" and of.kinds.output is None:
        sections = [section.model_copy(update={"output": output}) for output in ("velocity", "position")]
    found = [fit(one, chosen_model(s, of.kinds), **fit_settings(s)) for s in sections]
    return min(found, key=lambda f: f.epsilon if f.status == "ok" else np.inf), words


def plain_fit(found: Fit) -> dict[str, Any]:
    """One fit as plain data."""
    quantities: dict[str, dict[str, Any]] = {
        name: {"value": value, "bound_95": bound, "unit": unit} for name, value, bound, unit in found.rows()
    }
    for name, quantity in quantities.items():
        if (limit := found.at_most(name)) is not None:
            quantity["at_most"] = limit
    return {
        "model": found.asked.name if found.asked is not None else found.model.name,
        "status": found.status,
        "message": found.sentence,
        "taken": list(found.taken),
        "complete": found.complete,
        "about_bounds": found.about_bounds,
        "time_s": float(found.parameters.time_s[0]),
        "schedule": float(found.parameters.schedule[0]),
        "band_hz": list(found.band_hz),
        "lines": found.lines,
        "epsilon": found.epsilon,
        "reduced_chi2": found.chi2,
        "held": found.held,
        "quantities": quantities,
    }
