"""Answer to a page that asks for the matrix of a run: its entries, singular values, condition, coherence."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import REASONS, RecordError
from livebode.dashboard import Answer, ShownRun, moment
from livebode.language import Message


class MatrixPage:
    """The matrix beside the plot of an entry."""

    static, script = Path(__file__).parent / "static", "matrix.js"

    def answers(self) -> Mapping[str, Answer]:
        """The matrix."""
        return {"matrix": matrix_answer}


def matrix_answer(run: ShownRun, asked: Mapping[str, str]) -> dict[str, Any]:
    """The newest matrix of the run that the axis is an entry of, or the one nearest to a time, as plain data.

    What is not known is None. `reach` is the 95 % bound over |G|; `reasons` has for each input the number of lines at
    which its column is invalid, by reason.
    """
    group, units = run.group, run.units
    if group is None:
        raise RecordError("no-matrix", "this run has one response and no matrix", Message("reload the page"))
    matrix = group.at(run.past.directory, run.past.readable, moment(asked))[-1:]
    value = matrix.value[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        level, reach = 20 * np.log10(np.abs(value)), matrix.bound()[0] / np.abs(value)
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
