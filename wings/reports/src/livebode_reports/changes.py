"""Parameters and margins of two runs, with the changes and their bounds."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, isfinite

import numpy as np

from livebode.analysis import Margins, against_lines, fit_averaged, margins_of
from livebode.configuration import FitSection, LoopSection, recorded_configuration
from livebode.core import INTERVAL_FACTOR, LivebodeError, normal_quantile
from livebode.dataclass import dataclass
from livebode.fitting import Fit
from livebode.language import Message
from livebode_reports.difference import ALPHA, RunDifferences


@dataclass(frozen=True)
class QuantityChange:
    """A number before and after, each with its 95 % bound.

    Attributes
    ----------
    bound
        Of the change; covers all changes of the table together with 95 % (Bonferroni). The model error is the same in
        both runs but counts in both bounds, so this bound is conservative.
    seen
        The smallest change that this comparison detects with a probability of 95 %.
    """

    name: str
    unit: str
    before: tuple[float, float]
    after: tuple[float, float]
    bound: float
    seen: float

    @property
    def amount(self) -> float:
        """After minus before."""
        return self.after[0] - self.before[0]

    @property
    def significant(self) -> bool:
        """Whether the bound excludes zero."""
        return abs(self.amount) > self.bound


@dataclass(frozen=True)
class Changes:
    """Changes of parameters and margins; empty with a reason if there are none."""

    parameters: tuple[QuantityChange, ...]
    parameter_words: str
    margins: tuple[QuantityChange, ...]
    margin_words: str


def changes(of: RunDifferences) -> Changes:
    """Fit the same model to the compared response of each run, and compute the margins of the described loops.

    The model is that of the [fit] of a run; without one it follows from what the channels measure.
    """
    own = [recorded_configuration(run.summary) for run in of.runs]
    section: dict[str, object] = next((s["fit"] for s in own if "fit" in s), {})
    model = FitSection.model_validate(section)
    try:
        fits = [
            fit_averaged(replace(average, response=response, words="the compared response"), model)[0]
            for average, response in zip(of.averages, (of.overall.before, of.overall.after))
        ]
    except LivebodeError as error:
        return Changes((), Message("No parameters: {why}.", why=error), (), Message("No margins: they need a fit."))
    for run, fit in zip(of.runs, fits):
        if fit.status != "ok":
            words = Message("No parameters: the fit to {run} was rejected: {why}.", run=run.path.name, why=fit.sentence)
            return Changes((), words, (), Message("No margins: they need a fit."))
    # A quality factor is the damping ratio again.
    rows = [
        {name: (value, bound, unit) for name, value, bound, unit in fit.rows() if not name.endswith("_q")}
        for fit in fits
    ]
    quantities = _table(rows)
    words = Message(
        "The {model} model, fitted to the compared responses at {lines} lines.",
        model=fits[0].model.name,
        lines=fits[0].lines,
    )
    loops = [LoopSection.model_validate(s.get("loop", {})) for s in own]
    try:
        read = [_margins(fit, loop) for fit, loop in zip(fits, loops)]
    except LivebodeError as error:
        return Changes(quantities, words, (), Message("No margins: {why}.", why=error))
    known = [m for m in read if m is not None and m.ok[0]]
    if len(known) < len(read):
        return Changes(
            quantities,
            words,
            (),
            Message("No margins: they need a described loop in both runs that is stable with the fitted model."),
        )
    return Changes(quantities, words, _table([_rows(m) for m in known]), "")


def _margins(fit: Fit, loop: LoopSection) -> Margins | None:
    built = loop.build(fit.rate_hz)
    if built.feedback is None:
        return None
    result = margins_of(fit, built)
    return result if fit.measured is None else against_lines(result, fit.measured, built)


def _rows(fitted: Margins) -> dict[str, tuple[float, float, str]]:
    bound = fitted.bound()[0]
    values = zip(fitted.names, fitted.value[0], bound, fitted.units)
    return {name.replace("_", " "): (float(v), float(b), unit) for name, v, b, unit in values if isfinite(v)}


def _table(rows: list[dict[str, tuple[float, float, str]]]) -> tuple[QuantityChange, ...]:
    before, after = rows
    names = [name for name in before if name in after]
    usual = INTERVAL_FACTOR
    wider = normal_quantile(1 - ALPHA / (2 * max(len(names), 1))) / usual
    surer = wider + normal_quantile(0.95) / usual
    return tuple(
        QuantityChange(
            name,
            before[name][2],
            before[name][:2],
            after[name][:2],
            wider * hypot(before[name][1], after[name][1]),
            surer * hypot(before[name][1], after[name][1]),
        )
        for name in names
    )


_STIFFNESS = ("N/m", "N m/rad")
_POLES = ("resonance", "antiresonance")


def by_importance(table: tuple[QuantityChange, ...]) -> tuple[QuantityChange, ...]:
    """Stiffnesses, the other parameters, and what follows from them: resonances, then dampings; those changed first."""

    def rank(change: QuantityChange) -> tuple[bool, int]:
        derived = change.name.startswith(_POLES) or change.name == "inertia_ratio"
        rank = 0 if change.unit in _STIFFNESS else 1 if not derived else 2 if change.unit == "Hz" else 3
        return not change.significant, rank

    return tuple(sorted(table, key=rank))


def percent(change: QuantityChange, amount: float) -> float:
    """An amount in percent of the value before; NaN if that is zero."""
    return 100 * amount / abs(change.before[0]) if change.before[0] else float(np.nan)
