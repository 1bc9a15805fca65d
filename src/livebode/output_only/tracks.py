"""Tracks: the modes of successive windows as curves over time, with explicit gaps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from livebode.core import Parameters
from livebode.output_only.mode_tracker import WindowModes
from livebode.output_only.stabilisation import Mode

Floats = NDArray[np.float64]
Kind = Literal["mode", "harmonic"]

CONFIRMED = 5
"""Windows in which a track must be found before it is published."""
NOT_FOUND = "not found"
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


@dataclass(eq=False)
class _Track:
    """One mode or harmonic over time, and its rows that are not published yet."""

    kind: Kind
    last: Mode
    missed: int = 0
    found: int = 0
    number: int = 0
    waiting: list[tuple[WindowModes, Mode | None]] = field(default_factory=list)

    def distance(self, mode: Mode) -> float:
        """Distance of a mode of the next window, 1 at the limit; infinite for a different shape."""
        sigma = np.sqrt(self.last.covariance[0, 0] + mode.covariance[0, 0])
        reach = _NEAR * self.last.frequency_hz * min(1 + self.missed, _GAP_FACTOR_MAX)
        if mac(self.last.shape, mode.shape) < _MAC_MIN:
            return np.inf
        return float(abs(mode.frequency_hz - self.last.frequency_hz) / max(reach, _SIGMAS * sigma))

    def take(self, window: WindowModes, mode: Mode | None) -> None:
        self.waiting.append((window, mode))
        if mode is None:
            self.missed += 1
            return
        self.last, self.missed, self.found = mode, 0, self.found + 1

    def rows(self) -> Parameters:
        """The waiting rows, which are then published."""
        waiting, self.waiting = self.waiting, []
        names, size = _NAMES[self.kind], len(waiting)
        value, covariance = np.full((size, len(names)), np.nan), np.full((size, len(names), len(names)), np.nan)
        status = []
        for i, (window, mode) in enumerate(waiting):
            status.append(_status(window, mode))
            if mode is not None:
                use = [0, 1] if self.kind == "mode" else [0]
                value[i] = [*([mode.frequency_hz, mode.damping][: len(use)]), mode.share]
                covariance[i][np.ix_(use, use)] = mode.covariance[np.ix_(use, use)]
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
            sample=np.array([window.sample for window, _ in waiting], dtype=np.int64),
            time_s=np.array([window.time_s for window, _ in waiting]),
            schedule=np.array([window.schedule for window, _ in waiting]),
        )


class Tracks:
    """Assigns the modes of each window to tracks, by frequency and mode shape.

    A track is published when it was found in five windows, and ends when it was not found for the length of a window;
    in between its rows have the status "not found" or "gaps", and no values.

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
        self._assign(window, "mode", window.modes)
        self._assign(window, "harmonic", window.harmonics)
        self._tracks = [track for track in self._tracks if track.missed <= self._hops]
        return self._published(CONFIRMED)

    def finish(self) -> list[Parameters]:
        """The rows of the tracks of a recording with few windows: those that were found in half of them."""
        return self._published(min(CONFIRMED, -(-self._windows // 2)))

    def _assign(self, window: WindowModes, kind: Kind, modes: tuple[Mode, ...]) -> None:
        tracks, free = [track for track in self._tracks if track.kind == kind], list(modes)
        pairs = [(track.distance(mode), i, j) for i, track in enumerate(tracks) for j, mode in enumerate(modes)]
        taken: dict[int, int] = {}
        for distance, i, j in sorted(pairs):
            if distance <= 1 and i not in taken and j not in taken.values():
                taken[i] = j
                free.remove(modes[j])
        for i, track in enumerate(tracks):
            track.take(window, modes[taken[i]] if i in taken else None)
        for mode in free:
            track = _Track(kind, mode)
            track.take(window, mode)
            self._tracks.append(track)

    def _published(self, least: int) -> list[Parameters]:
        found = []
        for track in sorted(self._tracks, key=lambda track: track.last.frequency_hz):
            if not track.waiting or (not track.number and track.found < least):
                continue
            if not track.number:
                self._numbers[track.kind] += 1
                track.number = self._numbers[track.kind]
            found.append(track.rows())
        return found


def _status(window: WindowModes, mode: Mode | None) -> str:
    if mode is not None:
        return "ok"
    return NOT_FOUND if window.status == "ok" else window.status
