"""Matrix runs on the page: their entries, each of which is an axis, live or recorded, and their matrices."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import field, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from livebode.analysis import LIVE_VALUES_MAX, Overview
from livebode.core import MatrixResponses, ServerError
from livebode.dashboard.hub import Hub
from livebode.dataclass import dataclass
from livebode.records import RunRecord, entry_summary
from livebode.runtime import Document, RunEnded, RunStarted

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

    def entry(self, axis: int) -> tuple[str, str]:
        """Output and input of an axis."""
        return self.entries[axis - self.first_axis]

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
        matrix = _of_record(RunRecord.open(directory, matrix=True), time_s) if readable else None
        if matrix is None:
            raise ServerError("not-begun", "no matrix has a valid column yet", "wait for all experiments")
        return matrix


def _of_record(run: RunRecord, time_s: float | None) -> MatrixResponses | None:
    """The one in the segments near that time, else in the whole run."""
    if segments := [segment for segment in run.segments if segment.table == "responses"]:
        near_s = (segments[-1].first_s, inf) if time_s is None else (time_s - _NEAR_S, time_s + _NEAR_S)
        matrix = _best(run.matrix_batches(span_s=near_s), time_s)
        if matrix is not None and (time_s is None or abs(matrix.time_s[0] - time_s) <= _NEAR_S):
            return matrix
    return _best(run.matrix_batches(), time_s)


def _best(parts: Iterable[MatrixResponses], time_s: float | None) -> MatrixResponses | None:
    best = None
    for part in parts:
        best = _better(best, part, time_s)
    return best


def _better(best: MatrixResponses | None, part: MatrixResponses, time_s: float | None) -> MatrixResponses | None:
    use = np.flatnonzero(part.valid.any(axis=(1, 2)))
    if not use.size:
        return best
    if time_s is None:
        return part[use[-1:]]
    nearest = use[np.argmin(np.abs(part.time_s[use] - time_s))]
    if best is not None and abs(best.time_s[0] - time_s) <= abs(part.time_s[nearest] - time_s):
        return best
    return part[nearest : nearest + 1]


class MatrixHub:
    """A subscriber that gives each entry to a hub of its own, and retains the newest matrix.

    Parameters
    ----------
    name
        Of the axis.
    entries
        Output and input of each entry.
    """

    def __init__(self, name: str, entries: list[tuple[str, str]]) -> None:
        self.name = name
        self.hubs = {entry: Hub(f"{name} {entry[0]}/{entry[1]}") for entry in entries}
        self._newest: MatrixResponses | None = None

    def newest(self) -> MatrixResponses | None:
        """The newest matrix that has a valid column, one row; None before the first."""
        return self._newest

    def __call__(self, document: Document) -> None:
        if isinstance(document, MatrixResponses):
            self._add(document)
            return
        if isinstance(document, RunStarted):
            self._newest = None
        for entry, hub in self.hubs.items():
            hub(_of_entry(document, entry))

    def _add(self, matrices: MatrixResponses) -> None:
        use = np.flatnonzero(matrices.valid.any(axis=(1, 2)))
        if use.size:
            self._newest = MatrixResponses.join([matrices[use[-1:]]])  # a view would keep all rows in memory
        for entry, hub in self.hubs.items():
            entry_responses = matrices.entry(*entry)
            if hub.overview is not None:
                hub.overview.add(entry_responses)
            hub(entry_responses)


def _of_entry(document: Document, entry: tuple[str, str]) -> Document:
    """The document as that of a run with this entry only."""
    if isinstance(document, RunStarted):
        summary = entry_summary(document.summary, *entry)
        return replace(document, summary=summary, overview=Overview(LIVE_VALUES_MAX))
    if isinstance(document, RunEnded):
        return replace(document, summary=entry_summary(document.summary, *entry))
    return document
