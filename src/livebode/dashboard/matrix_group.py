"""Matrix runs on the page: their entries, each of which is an axis, live or recorded, and the answer with a matrix."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.analysis import LIVE_VALUES_MAX, Overview
from livebode.core import REASONS, MatrixResponses, ServerError
from livebode.dashboard.hub import Hub
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


_SIGMAS = 3.0  # of the bounds, as of all curves of the page


def matrix_answer(group: MatrixGroup, matrices: MatrixResponses, units: list[list[str]]) -> dict[str, Any]:
    """Plain data of one matrix; what is not known is None.

    `reach` is 3σ/|G|; `reasons` has for each input the number of lines at which its column is invalid, by reason.
    """
    matrix = matrices[-1:]
    value, sigma = matrix.value[0], matrix.sigma[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        level, reach = 20 * np.log10(np.abs(value)), _SIGMAS * sigma / np.abs(value)
        singular = 20 * np.log10(matrix.singular_values[0])

    def entry(o: int, i: int) -> dict[str, Any]:
        return {"db": _plain(level[:, o, i]), "reach": _plain(reach[:, o, i]), "unit": units[o][i]}

    entries = [[entry(o, i) for i in range(len(matrix.inputs))] for o in range(len(matrix.outputs))]
    return group.plain() | {
        "frequency_hz": matrix.frequency_hz.tolist(),
        "time_s": float(matrix.time_s[0]),
        "dof": _number(matrix.dof[0]),
        "entries": entries,
        "reasons": [_counts(matrix.reason[0, :, i]) for i in range(len(matrix.inputs))],
        "singular_db": [_plain(singular[:, k]) for k in range(singular.shape[1])],
        "condition": _plain(matrix.condition[0]),
        "coherence": [_plain(matrix.coherence[0, :, o]) for o in range(len(matrix.outputs))],
    }


def _counts(reason: NDArray[np.int8]) -> dict[str, int]:
    return {word: n for k, word in enumerate(REASONS) if k and (n := int(np.count_nonzero(reason == k)))}


def _plain(values: NDArray[np.float64]) -> list[float | None]:
    return [_number(v) for v in values]


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


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
