"""Whether the phase shows a delay that the model fixes at zero: two competing fits, decided group by group."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import OK, Stage, StatefulBase
from livebode.fitting.physical import DELAY
from livebode.fitting.problem import MeasuredRows, Problem
from livebode.fitting.rows import FRICTION, FittedRows, fit_rows
from livebode.fitting.weights import misfit

SHOWN = 10.0
"""Decrease of −2·ln(likelihood) from which a delay is fitted: 3.2 sigma of the delay, by chance once in 640 fits."""

_GONE = 4.0  # below it a delay is no longer fitted: 2 sigma
_EARLIEST_TICKS = 2.0  # an input that was logged after it acted, by no more than a tick of two channels
_EVERY = 16  # groups between two decisions
_TRIED_TICKS = (0.0, 1.0, 2.0, 4.0, 8.0)


class DelayChoice(StatefulBase):
    """A model with a fixed delay and the same with a free one, and the choice between them for the rows.

    Rows of the first group choose one by one; those of a later group use the joint result of the previous groups, and
    every sixteenth group decides again. If the user frees or fixes the delay, there is no choice.
    """

    _stage = Stage("delay-choice", 1)

    def __init__(self) -> None:
        self._freed: Problem | None = None
        self.taken: bool | None = None
        self.gains: list[float] = []

    def begin(self, problem: Problem, may_free: bool) -> None:
        """The problem as the user specified it, and whether its delay may be freed."""
        self.held = problem
        self._freed = problem.variant(free=(DELAY,)) if may_free and DELAY in problem.held else None

    @property
    def freed(self) -> Problem:
        """With a free delay, which may be the user's own."""
        return self._freed if self._freed is not None else self.held

    @property
    def problem(self) -> Problem:
        """The problem that rows are fitted with at present."""
        return self.freed if self.taken else self.held

    def weigh(self, group: int, measured: MeasuredRows, noise_dof: Floats, rows: FittedRows) -> FittedRows:
        """Compare both fits where this group (its number) decides; rows as they are fitted, `found` or with a delay."""
        if self._freed is None or not _decides(group, self.taken):
            return rows
        held, freed = rows, rows
        if self.taken:
            held = fit_rows(self.held, measured, noise_dof, self.held.with_held(rows.ended))
        else:
            freed = fitted_freely(self.held, self._freed, measured, noise_dof, rows)
        gain = gains(measured, noise_dof, held, freed)
        gain = np.where((freed.status == OK) & self._possible(freed), gain, np.where(held.status == OK, 0.0, np.nan))
        self.gains += gain[np.isfinite(gain)].tolist()
        return rows if self.taken is not None else chosen(rows, freed, gain > SHOWN)

    def decide(self) -> None:
        """At a group's end."""
        if self.gains:
            self.taken = bool(np.median(self.gains) > (_GONE if self.taken else SHOWN))
            self.gains = []

    def _state(self) -> dict[str, Any]:
        return {"taken": self.taken, "gains": self.gains}

    def _load(self, state: dict[str, Any]) -> None:
        if state["taken"] not in (None, False, True):
            raise ValueError(f"taken is {state['taken']!r}")
        self.taken, self.gains = state["taken"], [float(gain) for gain in state["gains"]]

    def _possible(self, freed: FittedRows) -> NDArray[np.bool_]:
        late_s = freed.ended[:, self.held.model.names.index(DELAY)]
        return np.asarray(late_s * self.held.grid.rate_hz >= -_EARLIEST_TICKS)


def _decides(group: int, taken: bool | None) -> bool:
    """If undecided, groups 0, 1, 2, 4 …: the cost of a model that never fits stays limited."""
    return group % _EVERY == 0 or (taken is None and group & (group - 1) == 0)


def fitted_freely(
    held: Problem, freed: Problem, measured: MeasuredRows, noise_dof: Floats, rows: FittedRows
) -> FittedRows:
    """Rows fitted with a free delay, started from the fit without; where both failed, from several delays."""
    best = fit_rows(freed, measured, noise_dof, rows.ended)
    lost = np.flatnonzero((rows.status != OK) & (rows.status != FRICTION) & (best.status != OK))
    some, dof = measured[lost], noise_dof[lost]
    for ticks in _TRIED_TICKS if lost.size else ():
        late_s = ticks / freed.grid.rate_hz
        turned = replace(some, value=some.value * np.exp(2j * np.pi * freed.grid.frequency_hz * late_s))
        start = fit_rows(held, turned, dof).ended
        start[:, freed.model.names.index(DELAY)] = late_s
        again = fit_rows(freed, some, dof, start)
        better = (again.status == OK) & ~((best.status[lost] == OK) & (best.epsilon[lost] <= again.epsilon))
        for kept, other in zip(best, again):
            kept[lost[better]] = other[better]
    return best


def gains(measured: MeasuredRows, noise_dof: Floats, less: FittedRows, more: FittedRows) -> Floats:
    """Decrease of −2·ln(likelihood) from one fit to the other, (rows,), each with the ε that it needs."""
    before, after = (misfit(measured, x.response, x.dof, noise_dof) for x in (less, more))
    return np.asarray(before - after)


def chosen(first: FittedRows, second: FittedRows, take: NDArray[np.bool_]) -> FittedRows:
    """Rows of the second where `take`, else of the first."""
    return FittedRows(*(np.where(take.reshape(-1, *[1] * (a.ndim - 1)), b, a) for a, b in zip(first, second)))
