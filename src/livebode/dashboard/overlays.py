"""Overlays of the measured curve: the fitted model and the healthy machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.arrays import Floats
from livebode.configuration import FitSection, chosen_model, recorded_configuration
from livebode.core import Lines, LivebodeError, Quantity, Responses
from livebode.dashboard.quantities import Quantities
from livebode.estimates import MATRIX, rule
from livebode.fitting import EvaluationGrid, PhysicalModel
from livebode.language import Message

if TYPE_CHECKING:
    from livebode.monitoring import ScheduleTable

_GRID_POINTS = 240


def grid_hz(lines: Lines) -> Floats:
    """The frequencies at which a model is drawn: the lines and points between them."""
    f = lines.frequency_hz
    return np.asarray(np.union1d(np.geomspace(f[0], f[-1], _GRID_POINTS), f))


class FittedCurve:
    """The fitted model of a run as a curve, from its published parameters."""

    def __init__(self, quantities: Quantities, section: FitSection) -> None:
        self._quantities = quantities
        self.model: PhysicalModel = chosen_model(section, quantities.kinds)
        self._grid = EvaluationGrid(grid_hz(quantities.lines), quantities.lines.rate_hz, section.hold)

    @classmethod
    def of(cls, summary: Mapping[str, Any], quantities: Quantities) -> FittedCurve | None:
        """Build it from the configuration; None without [fit], or if no plant is available."""
        words = recorded_configuration(dict(summary)).get("fit")
        if words is None or quantities.own != "plant":
            return None
        return cls(quantities, FitSection.model_validate(words))

    def curve(self, values: Floats, quantity: Quantity) -> Any:
        """Values on the grid, for these parameters of the model."""
        plant = self.model.at(values, self._grid)
        if quantity == "plant":
            return plant
        return self._quantities.converted(plant, quantity, self._feedback)[0]

    @cached_property
    def _feedback(self) -> Any:
        assert self._quantities.loop is not None
        return self._quantities.loop.feedback_at(self._grid.frequency_hz)


class Healthy:
    """The baseline of a run, at the current position of the machine."""

    def __init__(self, table: ScheduleTable) -> None:
        self._table = table

    @classmethod
    def of(cls, path: Path, summary: Mapping[str, Any]) -> Healthy | None:
        """Read the baseline of the run, in the version that it was compared with; None if it has no lines.

        LivebodeError if the file cannot be read.
        """
        from livebode.monitoring import Baseline, file_of  # with the simulation

        file = file_of(path, (summary.get("monitoring") or {}).get("baseline_id"))
        tables = [table for table in Baseline.load(file).tables if table.what == "lines"]
        return cls(tables[0]) if tables else None

    def response(self, beside: Responses, before: float) -> Responses | None:
        """The response of the healthy machine, with sigma, at the position of the response `beside` (one row).

        `before` is the previous value of the schedule, which gives the direction. None if nothing was learned there.
        """
        t = self._table
        place = 0.0 if t.step == 0 else (float(beside.schedule[0]) - t.low) / t.step
        if not 0 <= place < len(t.count):  # nor NaN
            return None
        bin = int(place)
        way = _way(float(beside.schedule[0]) - before, t.still)
        known = np.where(np.isfinite(t.mean[bin]).all(axis=1), t.count[bin], 0)
        if not known.any():
            return None
        way = way if known[way] else int(np.argmax(known))
        mean = t.mean[bin, way]
        sigma = np.abs(mean) * np.sqrt(np.einsum("lii->l", t.covariance[bin, way]))
        return replace(
            beside,
            value=mean[np.newaxis],
            sigma=sigma[np.newaxis],
            dof=np.array([float(known[way])]),
            coherence=np.full((1, len(mean)), np.nan),
            valid=np.ones((1, len(mean)), dtype=bool),
        )


class HealthyEntry:
    """The baseline of one entry of a matrix run: the mean of that entry, the same at all positions."""

    def __init__(self, mean: Responses) -> None:
        self._mean = mean

    @classmethod
    def of(cls, path: Path, output: str, input: str) -> HealthyEntry:
        """Read the run that is the baseline; LivebodeError if it cannot be read."""
        return cls(rule(MATRIX, "baseline").load(path).mean.entry(output, input))

    def response(self, beside: Responses, before: float) -> Responses | None:  # noqa: ARG002 - as of `Healthy`
        """The response of the healthy machine, with sigma, at the lines of the response `beside` (one row)."""
        mean = self._mean
        parts = {name: getattr(mean, name) for name in ("value", "sigma", "dof", "coherence", "valid")}
        return replace(beside, **parts)


def _healthy_of(summary: Mapping[str, Any]) -> Healthy | HealthyEntry | None:
    """The baseline of the run; None if there is none."""
    words = recorded_configuration(dict(summary))
    path = words.get("monitoring", {}).get("baseline")
    if path is None:
        return None
    if "entry" in summary:
        return HealthyEntry.of(Path(path), words["signals"]["output"], words["signals"]["input"])
    return Healthy.of(Path(path), summary)


def _way(step: float, still: float) -> int:
    from livebode.monitoring import BACK, FORTH, STILL

    return FORTH if step > still else BACK if step < -still else STILL


def overlays_of(
    summary: Mapping[str, Any], quantities: Quantities
) -> tuple[FittedCurve | None, Healthy | HealthyEntry | None, str]:
    """Both overlays, and the reasons why a requested one is missing."""
    remarks = list[Message]()
    fitted: FittedCurve | None = None
    healthy: Healthy | HealthyEntry | None = None
    try:
        fitted = FittedCurve.of(summary, quantities)
    except ValueError as error:
        remarks.append(Message("the fitted model cannot be drawn: {why}", why=error))
    try:
        healthy = _healthy_of(summary)
    except LivebodeError as error:
        remarks.append(Message("the baseline cannot be drawn: {why}", why=error))
    return fitted, healthy, Message("{remarks}", remarks=remarks) if remarks else ""
