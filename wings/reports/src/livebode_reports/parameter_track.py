"""The fitted parameters over a run, read in parts and thinned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import OK
from livebode.dataclass import dataclass
from livebode.fitting import NO_RESPONSE
from livebode.language import listed, number, worded
from livebode.records import RunRecord

_COLUMNS = ("sample", "time_s", "model", "name", "value", "sigma", "unit", "status")


@dataclass(frozen=True)
class Newest:
    """The newest value of a quantity, with its effective time."""

    value: float
    sigma: float
    unit: str
    time_s: float
    status: str


@dataclass(eq=False)
class Track:
    """Parameters and derived quantities of one model over time, or the margins of the loop.

    Attributes
    ----------
    time_s
        Effective times of the retained rows, (rows,).
    values, sigmas
        By name, (rows,) each; NaN if there is no value.
    newest
        By name, from all rows.
    statuses
        Number of rows with each status, from all rows of the first quantity.
    """

    time_s: Floats
    values: dict[str, Floats] = field(default_factory=dict)
    sigmas: dict[str, Floats] = field(default_factory=dict)
    newest: dict[str, Newest] = field(default_factory=dict)
    statuses: dict[str, int] = field(default_factory=dict)
    model: str = ""


def tracks(run: RunRecord, kept: NDArray[np.int64], time_s: Floats) -> dict[str, Track]:
    """Tracks by model, at the responses whose newest samples are `kept`; empty if nothing was fitted."""
    by_model: dict[str, Track] = {}
    for table in run.tables("parameters"):
        columns = {name: table.values(name) for name in _COLUMNS}
        for model in dict.fromkeys(columns["model"]):
            track = by_model.setdefault(model, Track(time_s, model=model))
            here = columns["model"] == model
            for name in dict.fromkeys(columns["name"][here]):
                rows = here & (columns["name"] == name)
                _add(track, name, {key: column[rows] for key, column in columns.items()}, kept)
    return by_model


def _add(track: Track, name: str, rows: dict[str, NDArray[np.generic]], kept: NDArray[np.int64]) -> None:
    if name not in track.values:
        track.values[name], track.sigmas[name] = (np.full(len(kept), np.nan) for _ in range(2))
    if name == next(iter(track.values)):
        for word, count in zip(*np.unique(rows["status"].astype(str), return_counts=True)):
            track.statuses[str(word)] = track.statuses.get(str(word), 0) + int(count)
    there = np.isin(rows["sample"], kept)
    places = np.searchsorted(kept, rows["sample"][there])
    track.values[name][places], track.sigmas[name][places] = rows["value"][there], rows["sigma"][there]
    known = np.flatnonzero(np.isfinite(rows["value"].astype(np.float64)))
    if known.size:
        i = int(known[-1])
        track.newest[name] = Newest(
            float(rows["value"][i]),
            float(rows["sigma"][i]),
            str(rows["unit"][i]),
            float(rows["time_s"][i]),
            str(rows["status"][i]),
        )


def fitted(track: Track) -> int:
    """Number of fits: not of the responses that have too few valid lines for one, as after a start or a gap."""
    return sum(count for word, count in track.statuses.items() if word != NO_RESPONSE)


def failed(track: Track) -> dict[str, int]:
    """Numbers of rejected fits by status."""
    return {word: count for word, count in track.statuses.items() if word not in (OK, NO_RESPONSE)}


def reasons(failed: Mapping[str, int]) -> str:
    """Numbers of rejected fits with their reasons, as a list."""
    return listed(f"{number(count, ',')} {worded(word)}" for word, count in failed.items())
