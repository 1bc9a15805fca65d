"""Answer to a page that asks for the matrix of a run: its entries, singular values, condition, coherence."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import REASONS, MatrixResponses
from livebode.dashboard.matrix_group import MatrixGroup

_SIGMAS = 3.0  # of the bounds, as of all curves of the page


def matrix_answer(group: MatrixGroup, found: MatrixResponses, units: list[list[str]]) -> dict[str, Any]:
    """Plain data of one matrix; what is not known is None.

    `reach` is 3σ/|G|; `reasons` has for each input the number of lines at which its column is invalid, by reason.
    """
    one = found[-1:]
    value, sigma = one.value[0], one.sigma[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        level, reach = 20 * np.log10(np.abs(value)), _SIGMAS * sigma / np.abs(value)
        singular = 20 * np.log10(one.singular_values[0])

    def entry(o: int, i: int) -> dict[str, Any]:
        return {"db": _plain(level[:, o, i]), "reach": _plain(reach[:, o, i]), "unit": units[o][i]}

    entries = [[entry(o, i) for i in range(len(one.inputs))] for o in range(len(one.outputs))]
    return group.plain() | {
        "frequency_hz": one.frequency_hz.tolist(),
        "time_s": float(one.time_s[0]),
        "dof": _number(one.dof[0]),
        "entries": entries,
        "reasons": [_counts(one.reason[0, :, i]) for i in range(len(one.inputs))],
        "singular_db": [_plain(singular[:, k]) for k in range(singular.shape[1])],
        "condition": _plain(one.condition[0]),
        "coherence": [_plain(one.coherence[0, :, o]) for o in range(len(one.outputs))],
    }


def _counts(reason: NDArray[np.int8]) -> dict[str, int]:
    return {word: n for k, word in enumerate(REASONS) if k and (n := int(np.count_nonzero(reason == k)))}


def _plain(values: NDArray[np.float64]) -> list[float | None]:
    return [_number(v) for v in values]


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
