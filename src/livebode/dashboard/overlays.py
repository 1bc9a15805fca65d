"""What is drawn over the measured curve: the fitted model and the healthy machine."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from livebode.dashboard.quantities import Quantities
from livebode.dashboard.trends import Trends
from livebode.fitting import Grid, PhysicalModel
from livebode.nouns import InputError, Lines, Quantity, Responses
from livebode.session.axis import FitSection
from livebode.session.fits import chosen_model
from livebode.session.said import said

if TYPE_CHECKING:
    from livebode.monitoring import Table

Floats = NDArray[np.float64]
_GRID_POINTS = 240


def grid_hz(lines: Lines) -> Floats:
    """The lines and points between them, where a model is drawn."""
    f = lines.frequency_hz
    return np.asarray(np.union1d(np.geomspace(f[0], f[-1], _GRID_POINTS), f))


class Fitted:
    """The fitted model of a run as a curve, from the parameters that it published."""

    def __init__(self, quantities: Quantities, section: FitSection) -> None:
        self._quantities = quantities
        self.model: PhysicalModel = chosen_model(section, quantities.unit)
        self._grid = Grid(grid_hz(quantities.lines), quantities.lines.rate_hz, section.hold)

    @classmethod
    def of(cls, summary: Mapping[str, Any], quantities: Quantities) -> Fitted | None:
        """As the configuration asks for it; None where it does not, or for what is no plant."""
        words = said(dict(summary)).get("fit")
        if words is None or quantities.own != "plant":
            return None
        return cls(quantities, FitSection.model_validate(words))

    def curve(self, trends: Trends, quantity: Quantity, time_s: float | None) -> tuple[float, Any] | None:
        """Time and values on the grid of the newest fit that holds, or of the one nearest to a moment."""
        found = [trends.by_name.get((self.model.name, name)) for name in self.model.names]
        rows = [trend.rows() for trend in found if trend is not None and trend.newest is not None]
        if len(rows) < len(found) or any(len(r) != len(rows[0]) for r in rows):
            return None
        values = np.stack([r.value for r in rows], axis=1)
        good = np.flatnonzero(np.isfinite(values).all(axis=1))
        if not good.size:
            return None
        at = good[-1] if time_s is None else good[np.argmin(np.abs(rows[0].time_s[good] - time_s))]
        plant = self.model.at(values[at], self._grid)
        if quantity == "plant":
            return float(rows[0].time_s[at]), plant
        assert self._quantities.loop is not None
        feedback = self._quantities.loop.feedback_at(self._grid.frequency_hz)
        return float(rows[0].time_s[at]), self._quantities.converted(plant, quantity, feedback)[0]


class Healthy:
    """The baseline that a run is held against, where the machine now is."""

    def __init__(self, table: Table) -> None:
        self._table = table

    @classmethod
    def of(cls, summary: Mapping[str, Any]) -> Healthy | None:
        """As the configuration names it; None where it names none. InputError where the file cannot be read."""
        path = said(dict(summary)).get("monitoring", {}).get("baseline")
        if path is None:
            return None
        from livebode.monitoring import Baseline  # with the simulation

        tables = [table for table in Baseline.load(Path(path)).tables if table.what == "lines"]
        return cls(tables[0]) if tables else None

    def response(self, beside: Responses, before: float) -> Responses | None:
        """What the healthy machine shows where `beside` (one row) was measured, as a response with sigma.

        `before` is the schedule a moment earlier, which tells the way that the machine goes. None where nothing was
        learned there.
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
        only = np.ones((1, len(mean)), dtype=bool)
        return Responses(
            lines=beside.lines,
            value=mean[np.newaxis],
            sigma=sigma[np.newaxis],
            dof=np.array([float(known[way])]),
            coherence=np.full((1, len(mean)), np.nan),
            valid=only,
            first=beside.first,
            sample=beside.sample,
            time_s=beside.time_s,
            schedule=beside.schedule,
            quantity=beside.quantity,
            unit=beside.unit,
        )


def _way(step: float, still: float) -> int:
    from livebode.monitoring.table import BACK, FORTH, STILL

    return FORTH if step > still else BACK if step < -still else STILL


def overlays_of(summary: Mapping[str, Any], quantities: Quantities) -> tuple[Fitted | None, Healthy | None, str]:
    """Both, and why one of them is missing that was asked for."""
    remarks = []
    fitted: Fitted | None = None
    healthy: Healthy | None = None
    try:
        fitted = Fitted.of(summary, quantities)
    except (InputError, ValueError) as error:
        remarks.append(f"the fitted model cannot be drawn: {error}")
    try:
        healthy = Healthy.of(summary)
    except InputError as error:
        remarks.append(f"the baseline cannot be drawn: {error}")
    return fitted, healthy, "; ".join(remarks)
