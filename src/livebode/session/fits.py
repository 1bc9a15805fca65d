"""A model fitted to every response of a run, or to a finished run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np

from livebode.core import Event, Loop, Parameters, Responses
from livebode.fitting import Fit, Fitter, PhysicalModel, best_of, fit, fit_of, model_named
from livebode.records import Run
from livebode.session.averaged import Averaged, averaged
from livebode.session.axis import FitSection
from livebode.session.live_margins import live_margins

_ROWS = ("value", "covariance", "status", "epsilon", "chi2", "dof", "sample", "time_s", "schedule")
_REMEMBERED = 256  # ε of the newest fits, for their median
_UNUSUAL = 3.0
_EPSILON_MIN = 0.003  # of |G|: an ε that no fit is rejected for
_POSITIONS = ("rad", "m", "deg", "mm")


class Out(Protocol):
    """Where parameters and events go: a RunDirectory, or a SegmentedRun."""

    def write_parameters(self, *parts: Parameters) -> None: ...

    def write_event(self, event: Event) -> None: ...


class Fits:
    """The fits of one run, and the margins of a known loop with them: written to its directory and summarized.

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

    def take(self, responses: Responses, out: Out) -> Parameters:
        """Fit a batch, and write its parameters and events."""
        fitter = self._fitter or self._begin(responses.unit)
        found = fitter.process(responses)
        around = () if self.loop is None else live_margins(found, responses, fitter, self.loop)
        out.write_parameters(found, fitter.derived(found), *around)
        for event in fitter.drain_events():
            out.write_event(event)
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
        return found

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


def fitter_of(section: FitSection, unit: str) -> Fitter:
    """The section's Fitter for responses of this unit."""
    return Fitter(chosen_model(section, unit), **_settings(section))


def check_fit(section: FitSection) -> None:
    """LivebodeError if this model can never be fitted; with "auto" the unit determines the model later."""
    if section.model != "auto":
        fitter_of(section, "")


def chosen_model(section: FitSection, unit: str) -> PhysicalModel:
    """The section's model; "auto" is two masses if the input is a torque, else two masses with an unknown gain."""
    name = section.model
    if name == "auto":
        name = "two-mass" if unit.endswith("/(N m)") or section.radius_m else "two-mass-gain"
    output = section.output
    if output == "auto":
        output = output_of(unit) or "velocity"
    options = {"side": section.side, "radius_m": section.radius_m, "inertia_ratio": section.inertia_ratio}
    return model_named(name, output=output, **options)


def output_of(unit: str) -> Literal["velocity", "position"] | None:
    """Whether a response of this unit leads to a position or a velocity; None where it has no unit.

    >>> output_of("rad/(N m)"), output_of("rad/s/(N m)"), output_of("")
    ('position', 'velocity', None)
    """
    if not unit:
        return None
    return "position" if unit.split("/(")[0] in _POSITIONS else "velocity"


def fit_run(directory: Path, section: FitSection) -> tuple[Fit, str]:
    """A model fitted to a finished run, and a description of what it was fitted to.

    For a run that averages, the newest valid response; else the mean of all. If neither configuration nor unit
    determine whether the output is a velocity or a position, the one with the smaller misfit is used.
    """
    return fit_averaged(averaged(Run.open(directory)), section)


def fit_averaged(of: Averaged, section: FitSection) -> tuple[Fit, str]:
    """The same for the average of a run."""
    one, words = of.response, of.words
    if not one.unit:
        words += "; the run has no units: N m, and rad/s or rad are assumed"
    sections = [section]
    if section.output == "auto" and not one.unit:
        sections = [section.model_copy(update={"output": output}) for output in ("velocity", "position")]
    found = [fit(one, chosen_model(s, one.unit), **_settings(s)) for s in sections]
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


def _settings(section: FitSection) -> dict[str, Any]:
    band = None if section.band_hz is None else (section.band_hz[0], section.band_hz[1])
    return {"fixed": section.fixed, "free": section.free, "band_hz": band, "hold": section.hold}
