"""MatrixGroup: the entries of a matrix run, each of which is an axis of the page, and its matrices."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import MatrixResponses, ServerError
from livebode.records import RunRecord

Newest = Callable[[], MatrixResponses | None]

_NEAR_S = 60.0


@dataclass
class MatrixGroup:
    """Which axis of the page has which entry.

    Parameters
    ----------
    name
        Of the run.
    outputs, inputs
        Names of the signals.
    first_axis
        Axis of the entry of the first output and the first input; the others follow output by output.
    newest
        The newest matrix of a live run in this process.
    """

    name: str
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    first_axis: int
    newest: Newest = field(default=lambda: None)

    @property
    def entries(self) -> list[tuple[str, str]]:
        """Output and input of each axis, in order."""
        return [(output, input) for output in self.outputs for input in self.inputs]

    def axis(self, output: str, input: str) -> int:
        """The axis of an entry."""
        return self.first_axis + self.outputs.index(output) * len(self.inputs) + self.inputs.index(input)

    def plain(self) -> dict[str, Any]:
        """For the page."""
        return {"name": self.name, "outputs": self.outputs, "inputs": self.inputs, "first_axis": self.first_axis}

    def at(self, directory: Path, readable: bool, time_s: float | None) -> MatrixResponses:
        """The newest matrix that has a valid column, or the one nearest to a time; one row.

        Raises
        ------
        ServerError
            If there is none yet.
        """
        newest = self.newest()
        if time_s is None and newest is not None:
            return newest
        found = _of_record(RunRecord.open(directory, matrix=True), time_s) if readable else None
        if found is None:
            raise ServerError("not-begun", "no matrix has a valid column yet", "wait for all experiments")
        return found


def _of_record(run: RunRecord, time_s: float | None) -> MatrixResponses | None:
    """The one in the segments near that time, else in the whole run."""
    if segments := [one for one in run.segments if one.table == "responses"]:
        near_s = (segments[-1].first_s, inf) if time_s is None else (time_s - _NEAR_S, time_s + _NEAR_S)
        found = _best(run.matrix_batches(span_s=near_s), time_s)
        if found is not None and (time_s is None or abs(found.time_s[0] - time_s) <= _NEAR_S):
            return found
    return _best(run.matrix_batches(), time_s)


def _best(parts: Iterable[MatrixResponses], time_s: float | None) -> MatrixResponses | None:
    found = None
    for part in parts:
        found = _better(found, part, time_s)
    return found


def _better(found: MatrixResponses | None, part: MatrixResponses, time_s: float | None) -> MatrixResponses | None:
    use = np.flatnonzero(part.valid.any(axis=(1, 2)))
    if not use.size:
        return found
    if time_s is None:
        return part[use[-1:]]
    at = use[np.argmin(np.abs(part.time_s[use] - time_s))]
    if found is not None and abs(found.time_s[0] - time_s) <= abs(part.time_s[at] - time_s):
        return found
    return part[at : at + 1]
