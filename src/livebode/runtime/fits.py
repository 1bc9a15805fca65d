"""A model fitted to every response of a run, and the margins with each fit."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from livebode.analysis.fits import plain_fit
from livebode.configuration.axis import FitSection
from livebode.configuration.fit_settings import fitter_of
from livebode.core import Event, Loop, Parameters, Responses
from livebode.fitting import Fit, Fitter, best_of, fit_of
from livebode.margins import OpenLoop, against_lines, margins

_ROWS = ("value", "covariance", "status", "epsilon", "chi2", "dof", "sample", "time_s", "schedule")
_REMEMBERED = 256  # ε of the newest fits, for their median
_UNUSUAL = 3.0
_EPSILON_MIN = 0.003  # of |G|: an ε that no fit is rejected for


class Fits:
    """The fits of one run, and the margins of a known loop with them.

    The model is chosen at the first responses: from the configuration, else from their unit.
    """

    def __init__(self, section: FitSection, loop: Loop | None = None) -> None:
        self.section, self.loop = section, loop
        self._fitter: Fitter | None = None
        self._counts: dict[str, int] = {}
        self._newest: Parameters | None = None
        self._newest_response: Responses | None = None
        self._epsilons: list[float] = []

    @classmethod
    def of(cls, section: FitSection | None, loop: Loop) -> Fits | None:
        """From a configuration; with margins if its loop describes the feedback."""
        return None if section is None else cls(section, loop if loop.feedback else None)

    def process(self, responses: Responses) -> tuple[tuple[Parameters, ...], list[Event]]:
        """Parameters of a batch: its fits, the quantities derived from them, the margins; and events."""
        fitter = self._fitter or self._begin(responses.unit)
        events: list[Event] = []
        found = fitter.process(responses, events.append)
        around = () if self.loop is None else _margins(found, responses, fitter, self.loop)
        for word, count in zip(*np.unique(found.status, return_counts=True)):
            self._counts[str(word)] = self._counts.get(str(word), 0) + int(count)
        good = np.flatnonzero(found.ok)
        if good.size:
            epsilon = found.epsilon[good]
            self._epsilons = [*self._epsilons, *epsilon.tolist()][-_REMEMBERED:]
            usual = good[epsilon <= max(_UNUSUAL * np.median(self._epsilons), _EPSILON_MIN)]
            if usual.size or self._newest is None:
                at = (usual if usual.size else good)[-1:]
                self._newest, self._newest_response = found[at], responses[at]
        return (found, fitter.derived(found), *around), events

    def snapshot(self) -> bytes:
        """State that the next fit depends on, as bytes; see `restore`."""
        if self._fitter is None:
            return b""
        newest = None if self._newest is None else {name: getattr(self._newest, name).tolist() for name in _ROWS}
        state = {"unit": self._unit, "counts": self._counts, "newest": newest, "epsilons": self._epsilons}
        return json.dumps(state).encode() + b"\n" + self._fitter.snapshot()

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot."""
        if not snapshot:
            return
        head, _, own = snapshot.partition(b"\n")
        state = json.loads(head)
        fitter = self._begin(state["unit"])
        fitter.restore(own)
        self._counts, self._epsilons = state["counts"], state["epsilons"]
        if state["newest"] is not None:
            rows = {name: np.array(values) for name, values in state["newest"].items()}
            self._newest = Parameters(fitter.model.name, fitter.names, fitter.model.units, **rows)

    def _begin(self, unit: str) -> Fitter:
        self._unit = unit
        self._fitter = fitter_of(self.section, unit)
        return self._fitter

    def newest(self) -> Fit | None:
        """The newest fit that is valid, and whose ε is at most three times the usual one.

        Competing models are fitted only for this one, not for each response of a run.
        """
        if self._fitter is None or self._newest is None:
            return None
        if self._newest_response is None:
            return fit_of(self._fitter, self._newest)
        return best_of(self._fitter, self._newest, self._newest_response)

    def summary(self, newest: Fit | None) -> dict[str, Any]:
        """For run.json: the model, the number of fits of each status, and the newest valid fit."""
        return {
            "model": self._fitter.model.name if self._fitter else None,
            "statuses": self._counts,
            "newest": None if newest is None else plain_fit(newest),
        }


def _margins(fits: Parameters, responses: Responses, fitter: Fitter, loop: Loop) -> tuple[Parameters, ...]:
    """Rows for parameters.parquet: each margin at each fit that the lines of its response do not contradict."""
    grid = fitter.grid
    band_hz = float(grid.frequency_hz[0]), float(grid.frequency_hz[-1])
    found = margins(fits, OpenLoop(fitter.model, loop, grid.rate_hz, grid.hold), band_hz)
    return against_lines(found, responses, loop).parameters()
