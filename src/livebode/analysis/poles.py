"""Modes or poles fitted to finished runs: the outputs of one input, each in its run directory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from livebode.analysis._averaged import averaged
from livebode.configuration import FitSection, recorded_configuration
from livebode.core import UsageError
from livebode.fitting import CommonPoles, Kind, fit_common_poles
from livebode.records import RunRecord

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
