"""The model of a run fitted at each place of its schedule."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from livebode.analysis.places import by_place
from livebode.configuration.fit_section import FitSection
from livebode.configuration.fit_settings import fitter_of
from livebode.configuration.recorded import recorded_configuration
from livebode.core import Parameters, Responses, TuneError
from livebode.export import LpvModel
from livebode.fitting import PhysicalModel
from livebode.records import RunRecord


def fits_by_place(directory: Path) -> tuple[PhysicalModel, Parameters]:
    """The model of the run's [fit] section, and its parameters, a row for each place; one row without a schedule.

    Each place has the mean of its responses, whose bounds contain what changes within the place.

    Raises
    ------
    TuneError
        If no fit is valid.
    ConfigError
        If the section has no physical model.
    """
    run = RunRecord.open(directory)
    section = FitSection.model_validate(recorded_configuration(run.summary).get("fit", {}))
    fitter = fitter_of(section, run.kinds)
    responses = by_place(Responses.join(list(run.steady_batches())))
    found = fitter.process(responses)
    if not found.ok.any():
        raise TuneError(
            "no-mode",
            f"the {found.model} model fits at no place: {found.status[0]}",
            "choose another model in [fit], or measure longer",
        )
    rows = found[np.flatnonzero(found.ok)]
    order = np.argsort(np.nan_to_num(rows.schedule), kind="stable")
    return fitter.model, rows[order]


def modes_by_place(directory: Path) -> Parameters:
    """Frequency in Hz, damping ratio and quality factor of each mode at each place, as for `fits_by_place`."""
    model, found = fits_by_place(directory)
    return found.derived(model.derived_names, model.derived_units, model.derived)


def lpv_model(directory: Path) -> LpvModel:
    """The two-mass model of a run over its schedule; errors as of `fits_by_place` and `LpvModel`."""
    model, found = fits_by_place(directory)
    return LpvModel(
        found,
        getattr(model, "output", "velocity"),
        getattr(model, "side", "motor"),
        getattr(model, "radius_m", None),
    )
