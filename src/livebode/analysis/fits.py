"""Fits of finished runs: of the mean, at places of the schedule, and of common poles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from livebode.analysis._averaged import RunMean, averaged
from livebode.configuration import (
    FitSection,
    chosen_model,
    fit_settings,
    fitter_of,
    recorded_configuration,
    unknown_gain,
)
from livebode.core import Parameters, Responses, TuneError, UsageError, read_unit
from livebode.export import LpvModel
from livebode.fitting import (
    Chain,
    CommonPoles,
    Fit,
    Kind,
    PhysicalModel,
    TwoMassGain,
    fit,
    fit_common_poles,
    mean_response,
)
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
    if not of.response.unit and section.model not in ("auto", "two-mass-gain"):
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
        f"{100 * MISFIT_MAX:.0f} %), so its parameters have no meaning"
    )


def _taken(fitted: Fit) -> str:
    """Quantity for which the output was taken."""
    assert isinstance(fitted.asked, Chain | TwoMassGain)  # `chosen_model` gives no other
    return fitted.asked.output


def fit_remarks(of: RunMean, section: FitSection, fitted: Fit, output: str, *, live: bool = False) -> list[str]:
    """Which quantity the output was taken for and why; and if the fit fails, whether the output is inverted.

    `output` is the name of its channel, and `live` whether the run is on a live source, which computes no channels.
    """
    unit = of.kinds.output_unit
    if section.output != "auto":
        taken: str = section.output
        why = "as fit.output specifies"
    elif of.kinds.output is not None:
        taken = "velocity" if of.kinds.output == "velocity" else "position"
        by_unit = read_unit(unit).kind == of.kinds.output
        why = f"by its unit {unit}" if by_unit else "by its name or as source.kinds declares"
    else:
        taken = _taken(fitted)
        why = "because neither a unit nor a kind is known"
        why = f"which has the smaller misfit, {why}" if fitted.status == "ok" else why
    remarks = [f"the output {output!r} is fitted as a {taken}, {why}"]
    if reason := unknown_gain(section, of.kinds):
        remarks.append(reason)
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
            remarks.append(
                "set fit.output, fit another model, or for a machine that is not such a drive, fit its modes: --model "
                "modal, or --model rational"
            )
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


_SHARED = {"log": "source", "input": "signals", "excitation": "signals"}


def fit_poles(
    runs: Sequence[RunRecord], model: Kind, section: FitSection, order: int | None = None
) -> tuple[CommonPoles, list[str]]:
    """Poles common to the outputs of these runs, and remarks.

    Raises
    ------
    UsageError, GridError, FitError
        As `fit_common_poles`; or if two runs are of the same output, or of different inputs.
    """
    configurations = [recorded_configuration(run.summary) for run in runs]
    names = [str(of.get("signals", {}).get("output", run.path.name)) for of, run in zip(configurations, runs)]
    if len(set(names)) < len(names):
        raise UsageError(
            "conflict",
            f"the runs have the outputs {', '.join(map(repr, names))}: one occurs more than once",
            "give one run for each output",
            argument="RUN",
            outputs=names,
        )
    differing = [
        key for key, table in _SHARED.items() if len({str(of.get(table, {}).get(key)) for of in configurations}) > 1
    ]
    if "input" in differing or "excitation" in differing:
        raise UsageError(
            "conflict",
            f"the runs differ in signals.{next(key for key in differing if key != 'log')}, but common poles are "
            "fitted to several outputs of one input",
            "give runs of one input",
            argument="RUN",
        )
    averages = [averaged(run) for run in runs]
    band = None if section.band_hz is None else (section.band_hz[0], section.band_hz[1])
    poles = fit_common_poles(
        [of.response for of in averages], model, outputs=names, order=order, band_hz=band, hold=section.hold
    )
    remarks = [f"fitted to {averages[0].words}"]
    if "log" in differing:
        remarks.append("the runs are of different recordings: the machine is taken as the same in all of them")
    if len(runs) > 1:
        remarks.append("the noise of the outputs is taken as independent; noise that they share makes ± too small")
    return poles, remarks


def plain_poles(poles: CommonPoles, remarks: list[str]) -> dict[str, Any]:
    """For JSON."""
    structure = None if poles.best is None else poles.best.structure
    return {
        "model": poles.model,
        "status": poles.status,
        "message": poles.sentence,
        "outputs": list(poles.outputs),
        "order": poles.order,
        "orders_tried": [{"order": order, "bic": cost} for order, cost in poles.tried],
        "integrators": 0 if structure is None else structure.integrators,
        "direct_terms": 0 if structure is None else structure.direct,
        "complete": poles.complete,
        "about_bounds": poles.about_bounds,
        "band_hz": [float(poles.grid.frequency_hz[0]), float(poles.grid.frequency_hz[-1])],
        "lines": int(poles.grid.frequency_hz.size),
        "epsilon": dict(zip(poles.outputs, poles.epsilon.tolist())),
        "reduced_chi2": dict(zip(poles.outputs, poles.chi2.tolist())),
        "correlation_of_neighbours": dict(zip(poles.outputs, poles.correlation.tolist())),
        "quantities": {n: {"value": v, "bound_95": b, "unit": u} for n, v, b, u in poles.rows()},
        "remarks": remarks,
    }


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
