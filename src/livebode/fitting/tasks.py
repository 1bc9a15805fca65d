"""Fits of several axes in one computation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from livebode.arrays import Floats
from livebode.core import Responses
from livebode.fitting.problem import MeasuredRows, Problem
from livebode.fitting.rows import FittedRows, fit_rows


class FitTask(NamedTuple):
    """Rows that share a start and an ε: the Responses, the problem, the lines in use with the degrees of freedom of
    their sigmas, the values from which each row starts, and its ε. None: a scan, and an ε of its own."""

    responses: Responses
    problem: Problem
    measured: MeasuredRows
    noise_dof: Floats
    start: Floats | None
    epsilon: Floats | None

    def fitted(self) -> FittedRows:
        """The rows fitted by themselves."""
        return fit_rows(self.problem, self.measured, self.noise_dof, self.start, self.epsilon)

    @property
    def kind(self) -> tuple[object, ...]:
        """Equal for tasks that one computation can fit."""
        return *self.problem.identity, self.start is None, self.epsilon is None


def fitted_together(tasks: Sequence[FitTask]) -> list[FittedRows]:
    """The rows of each task; in NumPy, tasks of one kind are one computation."""
    kinds: dict[tuple[object, ...], list[int]] = {}
    rows: dict[int, FittedRows] = {}
    for i, task in enumerate(tasks):
        if task.problem.native is not None:  # to join the arrays would cost more than it saves
            rows[i] = task.fitted()
        else:
            kinds.setdefault(task.kind, []).append(i)
    for members in kinds.values():
        rows.update(zip(members, _fitted_alike([tasks[i] for i in members])))
    return [rows[i] for i in range(len(tasks))]


def _fitted_alike(tasks: Sequence[FitTask]) -> list[FittedRows]:
    first = tasks[0]
    if len(tasks) == 1:
        return [first.fitted()]
    start, epsilon = _joined([task.start for task in tasks]), _joined([task.epsilon for task in tasks])
    noise_dof = np.concatenate([task.noise_dof for task in tasks])
    every = fit_rows(first.problem, MeasuredRows.join([task.measured for task in tasks]), noise_dof, start, epsilon)
    ends = np.cumsum([len(task.noise_dof) for task in tasks])[:-1]
    return [FittedRows(*parts) for parts in zip(*(np.split(column, ends) for column in every))]


def _joined(parts: Sequence[Floats | None]) -> Floats | None:
    """The rows of all; tasks of one kind have them all, or none has."""
    there = [part for part in parts if part is not None]
    return np.concatenate(there) if there else None
