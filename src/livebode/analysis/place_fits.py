"""The mean responses of a run at places of its schedule, and its model fitted to each of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from livebode.analysis._averaged import averaged
from livebode.analysis.fits import MISFIT_MAX, better_output
from livebode.analysis.poles import fit_poles
from livebode.configuration import FitSection, fitter_of, recorded_configuration
from livebode.core import Parameters, Responses, TuneError, UsageError
from livebode.export import LpvModel
from livebode.fitting import PhysicalModel, mean_response
from livebode.records import RunRecord

_PLACES = 12


def by_place(responses: Responses) -> Responses:
    """The mean response at each of twelve places of the schedule; one row without a schedule."""
    use = np.flatnonzero(responses.valid.all(axis=1) & np.isfinite(responses.schedule))
    if not use.size:
        return mean_response(responses)
    schedule = responses.schedule[use]
    edges = np.linspace(schedule.min(), schedule.max(), _PLACES + 1)
    place = np.clip(np.searchsorted(edges, schedule, side="right") - 1, 0, _PLACES - 1)
    groups = [use[place == i] for i in range(_PLACES)]
    return Responses.join([mean_response(responses[group]) for group in groups if group.size])


def fits_by_place(directory: Path, model: str | None = None) -> tuple[PhysicalModel, Parameters]:
    """A model, by default of the run's [fit] section, and its parameters, a row for each place; one without a schedule.

    Each place has the mean of its responses, whose bounds contain what changes within the place. Where neither unit nor
    key shows whether the output is a velocity or a position, it is what fits the average of the run better.

    Raises
    ------
    TuneError
        If no fit is valid.
    ConfigError
        If the section has no physical model.
    """
    run = RunRecord.open(directory)
    section = _section(run, model)
    if section.output == "auto" and run.kinds.output is None:
        section = section.model_copy(update={"output": better_output(averaged(run), section)})
    fitter = fitter_of(section, run.kinds)
    responses = by_place(Responses.join(list(run.steady_batches())))
    fits = fitter.process(responses)
    use = fits.ok & (fits.epsilon < MISFIT_MAX)
    if not use.any():
        why = f"it differs by {100 * fits.epsilon[0]:.0f} % of |G|" if fits.ok[0] else fits.status[0]
        raise TuneError(
            "no-mode",
            f"the {fits.model} model fits at no place: {why}",
            "choose the model 'modal', as in livebode fit",
            argument="model",
        )
    rows = fits[np.flatnonzero(use)]
    order = np.argsort(np.nan_to_num(rows.schedule), kind="stable")
    return fitter.model, rows[order]


def modes_by_place(directory: Path, model: str | None = None) -> Parameters:
    """Frequency in Hz, damping ratio and quality factor of each mode at each place, as for `fits_by_place`.

    Of the model "modal" they are those of the average of the run, as `livebode fit` gives them.
    """
    run = RunRecord.open(directory)
    section = _section(run, model)
    if section.model == "modal":
        common, _ = fit_poles([run], "modal", section)
        return common.parameters
    if section.model == "rational":
        raise UsageError(
            "not-one-of", "the model 'rational' has poles, not modes", "choose the model 'modal'", argument="model",
            value="rational",
        )  # fmt: skip
    physical, rows = fits_by_place(directory, model)
    names, units = rows.names + physical.derived_names, rows.units + physical.derived_units  # some are parameters
    return rows.derived(names, units, lambda of: np.concatenate([of, physical.derived(of)], axis=-1))


def _section(run: RunRecord, model: str | None) -> FitSection:
    own = recorded_configuration(run.summary).get("fit", {})
    return FitSection.model_validate(own | ({} if model is None else {"model": model}))


def lpv_model(directory: Path) -> LpvModel:
    """The two-mass model of a run over its schedule; errors as of `fits_by_place` and `LpvModel`."""
    model, fits = fits_by_place(directory)
    return LpvModel(
        fits,
        getattr(model, "output", "velocity"),
        getattr(model, "side", "motor"),
        getattr(model, "radius_m", None),
    )
