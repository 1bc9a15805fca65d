"""ModeCurve: one mode or harmonic over time for pictures, read in parts and thinned."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.records import RunRecord


@dataclass(frozen=True, eq=False)
class ModeCurve:
    """Frequency and damping of a mode over time; NaN where it was not found.

    Attributes
    ----------
    name
        Such as "mode 1" or "harmonic 1".
    time_s, frequency_hz, frequency_sigma, damping, damping_sigma
        (rows,) each; the damping of a harmonic is NaN.
    """

    name: str
    time_s: Floats
    frequency_hz: Floats
    frequency_sigma: Floats
    damping: Floats
    damping_sigma: Floats

    @property
    def harmonic(self) -> bool:
        return self.name.startswith("harmonic")

    @property
    def found(self) -> int:
        """Number of rows with values."""
        return int(np.count_nonzero(np.isfinite(self.frequency_hz)))


ROWS_MAX = 2000
"""Most rows of a curve."""


def mode_curves(run: RunRecord, rows_max: int = ROWS_MAX) -> list[ModeCurve]:
    """The curves of an output-only run, in the order in which they were found.

    Every n-th window is read, so that no curve has more than `rows_max` rows.
    """
    windows, hop = sum(run.summary["windows"].values()), run.found["hop"]
    every = max(1, -(-windows // rows_max))
    parts: dict[str, dict[str, list[NDArray[Any]]]] = {}
    for table in run.tables("parameters"):
        columns = {name: table.values(name) for name in _COLUMNS}
        used = columns["sample"] // hop % every == 0
        for model in dict.fromkeys(columns["model"]):
            of_model = parts.setdefault(model, {})
            for name in ("frequency", "damping"):
                rows = used & (columns["model"] == model) & (columns["name"] == name)
                for column in ("time_s", "value", "sigma"):
                    of_model.setdefault(f"{name} {column}", []).append(columns[column][rows])
    return [
        _curve(model, {key: np.concatenate(part) for key, part in columns_of_mode.items()})
        for model, columns_of_mode in parts.items()
    ]


_COLUMNS = ("sample", "time_s", "model", "name", "value", "sigma")


def _curve(model: str, columns: dict[str, Floats]) -> ModeCurve:
    time_s = columns["frequency time_s"]
    none = np.full(len(time_s), np.nan)
    damping, sigma = columns["damping value"], columns["damping sigma"]
    return ModeCurve(
        model,
        time_s,
        columns["frequency value"],
        columns["frequency sigma"],
        damping if damping.size else none,
        sigma if sigma.size else none,
    )
