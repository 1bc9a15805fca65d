"""A model fitted to every response of a run, and the margins with each fit."""

from __future__ import annotations

from typing import Any

import numpy as np

from livebode.analysis import OpenLoop, against_lines, loop_report, margins, plain_fit, proposed_filter
from livebode.configuration import FitSection, chosen_model, fitter_of, unknown_gain
from livebode.core import Event, Loop, Parameters, PlantKinds, Responses, Stage, decode, encode, moment
from livebode.fitting import Fit, Fitter, best_of, fit_of

_STAGE = Stage("fits", 1)
_NUMBERS = ("value", "covariance", "epsilon", "chi2", "dof", "sample", "time_s", "schedule")
_REMEMBERED = 256  # ε of the newest fits, for their median
_UNUSUAL = 3.0
_EPSILON_MIN = 0.003  # of |G|: an ε that no fit is rejected for


class Fits:
    """The fits of one run, and the margins of a known loop with them.

    The model is that of the configuration; where it is "auto", the kinds of the plant determine it.
    """

    def __init__(self, section: FitSection, loop: Loop | None = None, kinds: PlantKinds | None = None) -> None:
        self.section, self.loop, self._kinds = section, loop, kinds or PlantKinds()
        self._fitter: Fitter | None = None
        self._counts: dict[str, int] = {}
        self._newest: Parameters | None = None
        self._newest_response: Responses | None = None
        self._epsilons: list[float] = []
        self._open_loop: OpenLoop | None = None

    @classmethod
    def of(cls, section: FitSection, loop: Loop, kinds: PlantKinds) -> Fits:
        """From a configuration; with margins if its loop describes the feedback. ConfigError as in `chosen_model`."""
        chosen_model(section, kinds)
        return cls(section, loop if loop.feedback else None, kinds)

    def process(self, responses: Responses) -> tuple[tuple[Parameters, ...], list[Event]]:
        """Parameters of a batch: its fits, the quantities derived from them, the margins; and events."""
        events: list[Event] = []
        found = self.fitter(responses.unit).process(responses, events.append)
        self.take(found, responses)
        return (found, *self.around(found, responses)), events

    def take(self, found: Parameters, responses: Responses) -> None:
        """Count the fits of these responses, and remember the newest."""
        for word in found.status.tolist():
            self._counts[word] = self._counts.get(word, 0) + 1
        good = np.flatnonzero(found.ok)
        if good.size:
            epsilon = found.epsilon[good]
            self._epsilons = [*self._epsilons, *epsilon.tolist()][-_REMEMBERED:]
            usual = good[epsilon <= max(_UNUSUAL * np.median(self._epsilons), _EPSILON_MIN)]
            if usual.size or self._newest is None:
                at = (usual if usual.size else good)[-1:]
                self._newest, self._newest_response = found[at], responses[at]

    def around(self, found: Parameters, responses: Responses) -> tuple[Parameters, ...]:
        """Quantities derived from the fits of these responses, and the margins."""
        fitter = self.fitter(responses.unit)
        margins = () if self.loop is None else self._margins(found, responses, fitter, self.loop)
        return fitter.derived(found), *margins

    def _margins(self, fits: Parameters, responses: Responses, fitter: Fitter, loop: Loop) -> tuple[Parameters, ...]:
        """Rows for parameters.parquet: each margin at each fit that the lines of its response do not contradict."""
        grid = fitter.grid
        around = self._open_loop
        if around is None or around.plant is not fitter.model:
            around = self._open_loop = OpenLoop(fitter.model, loop, grid.rate_hz, grid.hold)
        band_hz = float(grid.frequency_hz[0]), float(grid.frequency_hz[-1])
        return against_lines(margins(fits, around, band_hz), responses, loop).parameters()

    def snapshot(self) -> bytes:
        """State that the next fit depends on, as bytes; see `restore`."""
        if self._fitter is None:
            return encode(_STAGE, {"unit": None})
        own = {"unit": self._unit, "counts": self._counts, "epsilons": self._epsilons, "fitter": self._fitter}
        if self._newest is None:
            return encode(_STAGE, own | {"status": None})
        numbers = {name: getattr(self._newest, name) for name in _NUMBERS}
        return encode(_STAGE, own | {"status": self._newest.status.tolist()} | numbers)

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot; StateError, and nothing has changed, if that cannot be restored."""
        state = decode(_STAGE, snapshot)
        if state["unit"] is None:
            self._fitter = self._newest = self._newest_response = None
            self._counts, self._epsilons = {}, []
            return
        fitter = fitter_of(self.section, self._kinds)
        fitter.restore(state["fitter"])
        newest = None
        if state["status"] is not None:
            rows = {name: state[name] for name in _NUMBERS} | {"status": np.array(state["status"])}
            newest = Parameters(fitter.model.name, fitter.names, fitter.model.units, **rows)
        self._fitter, self._unit, self._newest, self._newest_response = fitter, state["unit"], newest, None
        self._counts, self._epsilons = state["counts"], state["epsilons"]

    def fitter(self, unit: str) -> Fitter:
        """The fitter of the run, whose responses have this unit."""
        if self._fitter is None:
            self._unit, self._fitter = unit, fitter_of(self.section, self._kinds)
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

    def entries(self, newest: Fit | None, responses: Responses) -> dict[str, Any]:
        """Entries of run.json: results of the fits, and the margins of a known loop with the newest one."""
        found = {"fit": self.summary(newest)}
        if newest is not None and self.loop is not None:
            words = f"newest fit, at {moment(newest.parameters.time_s[0], 2)}"
            report = loop_report(newest, words, responses, self.loop)
            found["loop"] = report.plain(proposed_filter(report))
        return found

    def summary(self, newest: Fit | None) -> dict[str, Any]:
        """For run.json: the model, the number of fits of each status, and the newest valid fit."""
        return {
            "model": self._fitter.model.name if self._fitter else None,
            "unknown_gain": unknown_gain(self.section, self._kinds),
            "statuses": self._counts,
            "newest": None if newest is None else plain_fit(newest),
        }
