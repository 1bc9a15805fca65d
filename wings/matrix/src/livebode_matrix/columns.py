"""MatrixColumns: where the columns of the matrices of a run are valid, and why not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from livebode.core import REASONS, MatrixResponses, Stage, StatefulBase


class MatrixColumns(StatefulBase):
    """Counts of each column over a run.

    Parameters
    ----------
    inputs
        Names of the inputs.
    lines
        Number of lines.
    """

    _stage = Stage("matrix-columns", 1)
    _STATE = ("_counts", "_newest", "_condition")

    def __init__(self, inputs: Sequence[str], lines: int) -> None:
        self._inputs = tuple(inputs)
        self._counts = np.zeros((len(inputs), len(REASONS)), dtype=np.int64)
        self._newest = np.zeros((len(inputs), lines), dtype=np.int64)
        self._condition = np.full(lines, np.nan)

    @property
    def _identity(self) -> str:
        return repr((self._inputs, len(self._condition)))

    @property
    def valid(self) -> int:
        """Number of valid values: columns at lines of responses."""
        return int(self._counts[:, 0].sum())

    def take(self, responses: MatrixResponses) -> None:
        """Count the columns of these responses."""
        if not len(responses):
            return
        for number in range(len(REASONS)):
            self._counts[:, number] += np.count_nonzero(responses.reason == number, axis=(0, 1))
        self._newest = responses.reason[-1].T.astype(np.int64)
        self._condition = responses.condition[-1].copy()

    def summary(self, frequency_hz: np.ndarray) -> dict[str, Any]:
        """Entries of run.json: counts of each column, and the newest invalid lines and worst condition.

        Parameters
        ----------
        frequency_hz
            Of the lines.
        """
        columns = []
        for name, counts, newest in zip(self._inputs, self._counts, self._newest):
            reasons = {REASONS[i]: int(counts[i]) for i in range(1, len(REASONS)) if counts[i]}
            at = {REASONS[i]: frequency_hz[newest == i].tolist() for i in range(1, len(REASONS))}
            now = {reason: lines for reason, lines in at.items() if lines}
            columns.append({"input": name, "valid": int(counts[0]), "reasons": reasons, "newest_invalid_hz": now})
        found: dict[str, Any] = {"columns": columns}
        finite = np.flatnonzero(np.isfinite(self._condition))
        if finite.size:
            worst = finite[np.argmax(self._condition[finite])]
            found["condition"] = {
                "worst": float(self._condition[worst]),
                "frequency_hz": float(frequency_hz[worst]),
            }
        return found
