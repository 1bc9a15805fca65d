"""Tracks: the modes of successive windows as curves over time, with explicit gaps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from livebode.core import Parameters
from livebode_modes.mode_tracker import WindowModes
from livebode_modes.stabilisation import Mode

Kind = Literal["mode", "harmonic"]

CONFIRMED = 5
"""Windows in which a track must be found before it is published."""
OK = "ok"
NOT_FOUND, HARMONIC = "not found", "harmonic"
_NEAR = 0.02  # of the frequency, from window to window
_SIGMAS = 3.0
_GAP_FACTOR_MAX = 3
_MAC_MIN = 0.6
_NAMES: dict[Kind, tuple[str, ...]] = {"mode": ("frequency", "damping", "share"), "harmonic": ("frequency", "share")}
_UNITS = {"frequency": "Hz", "damping": "", "share": ""}


def mac(one: NDArray[np.complex128], other: NDArray[np.complex128]) -> float:
    """Modal assurance criterion of two mode shapes: 1 if they are proportional (Allemang 2003).

    >>> round(mac(np.array([1, 1j]), np.array([2j, -2])), 6), mac(np.array([1, 0]), np.array([0, 1]))
    (1.0, 0.0)
    """
    product = np.vdot(one, one).real * np.vdot(other, other).real
    return float(np.abs(np.vdot(one, other)) ** 2 / product) if product else 0.0


@dataclass(frozen=True, eq=False)
class _Row:
    window: WindowModes
    mode: Mode | None = None
    harmonic: bool = False


@dataclass(eq=False)
class _Track:
    """One mode or harmonic over time, and its rows that are not published yet."""

    last: Mode
    missed: int = 0
    found: int = 0
    harmonic: int = 0
    number: int = 0
    kind: Kind = "mode"
    waiting: list[_Row] = field(default_factory=list)

    def distance(self, mode: Mode) -> float:
        """Distance of a mode of the next window, 1 at the limit; infinite for a different shape."""
        sigma = np.sqrt(self.last.covariance[0, 0] + mode.covariance[0, 0])
        reach = _NEAR * self.last.frequency_hz * min(1 + self.missed, _GAP_FACTOR_MAX)
        if mac(self.last.shape, mode.shape) < _MAC_MIN:
            return np.inf
        return float(abs(mode.frequency_hz - self.last.frequency_hz) / max(reach, _SIGMAS * sigma))

    def take(self, row: _Row) -> None:
        self.waiting.append(row)
        if row.mode is None:
            self.missed += 1
            return
        self.last, self.missed = row.mode, 0
        self.found += 1
        self.harmonic += row.harmonic

    def rows(self) -> Parameters:
        """The waiting rows, which are then published."""
        waiting, self.waiting = self.waiting, []
        names, size = _NAMES[self.kind], len(waiting)
        value, covariance = np.full((size, len(names)), np.nan), np.full((size, len(names), len(names)), np.nan)
        status = [_status(row, self.kind) for row in waiting]
        bounded = names[:-1]  # no bound is computed for the share
        for i, row in enumerate(waiting):
            if row.mode is not None and status[i] == OK:
                value[i] = [*(row.mode.frequency_hz, row.mode.damping)[: len(bounded)], row.mode.share]
                covariance[i, : len(bounded), : len(bounded)] = row.mode.covariance[: len(bounded), : len(bounded)]
        column = np.full(size, np.nan)
        return Parameters(
            model=f"{self.kind} {self.number}",
            names=names,
            units=tuple(_UNITS[name] for name in names),
            value=value,
            covariance=covariance,
            status=np.array(status),
            epsilon=column,
            chi2=column,
            dof=column,
            sample=np.array([row.window.sample for row in waiting], dtype=np.int64),
            time_s=np.array([row.window.time_s for row in waiting]),
            schedule=np.array([row.window.schedule for row in waiting]),
        )


class Tracks:
    """Assigns the modes of each window to tracks, by frequency and mode shape.

    A track is published when it was found in five windows; whether it is a mode or a harmonic is then what most of them
    show. It ends when it was not found for the length of a window; in between its rows have the status "not found" or
    "gaps", and no values. A row of a mode in which its amplitude was constant has the status "harmonic".

    Parameters
    ----------
    hops
        Hops in a window.
    """

    def __init__(self, hops: int) -> None:
        self._hops, self._windows = hops, 0
        self._tracks: list[_Track] = []
        self._numbers: dict[Kind, int] = {"mode": 0, "harmonic": 0}

    def take(self, window: WindowModes) -> list[Parameters]:
        """The rows to publish after a window, a Parameters for each track."""
        self._windows += 1
        self._assign(window)
        self._tracks = [track for track in self._tracks if track.missed <= self._hops]
        return self._published(CONFIRMED)

    def finish(self) -> list[Parameters]:
        """The rows of the tracks of a recording with few windows: those that were found in half of them."""
        return self._published(min(CONFIRMED, -(-self._windows // 2)))

    def _assign(self, window: WindowModes) -> None:
        rows = [_Row(window, mode) for mode in window.modes]
        rows += [_Row(window, mode, harmonic=True) for mode in window.harmonics]
        pairs = [
            (track.distance(row.mode), i, j)
            for i, track in enumerate(self._tracks)
            for j, row in enumerate(rows)
            if row.mode is not None
        ]
        taken: dict[int, int] = {}
        for distance, i, j in sorted(pairs):
            if distance <= 1 and i not in taken and j not in taken.values():
                taken[i] = j
        for i, track in enumerate(self._tracks):
            track.take(rows[taken[i]] if i in taken else _Row(window))
        for j, row in enumerate(rows):
            if j not in taken.values() and row.mode is not None:
                self._tracks.append(_Track(row.mode))
                self._tracks[-1].take(row)

    def _published(self, least: int) -> list[Parameters]:
        found = []
        for track in sorted(self._tracks, key=lambda track: track.last.frequency_hz):
            if not track.waiting or (not track.number and track.found < least):
                continue
            if not track.number:
                track.kind = "harmonic" if 2 * track.harmonic > track.found else "mode"
                self._numbers[track.kind] += 1
                track.number = self._numbers[track.kind]
            found.append(track.rows())
        return found


def _status(row: _Row, kind: Kind) -> str:
    if row.mode is not None:
        return HARMONIC if row.harmonic and kind == "mode" else OK
    return NOT_FOUND if row.window.status == OK else row.window.status
