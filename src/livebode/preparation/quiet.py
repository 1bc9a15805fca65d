"""Mains hum in a recording without excitation, or in a pause of the excitation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from livebode.core import Block, Lines, SignalError
from livebode.dataclass import dataclass
from livebode.estimation import (
    SECONDS_MIN,
    Hum,
    Settings,
    SilenceSearch,
    SilentStretch,
    disturbed_lines,
    find_hum,
    may_disturb,
)
from livebode.preparation.plan import beginnings
from livebode.sources import Log

_SAMPLES_MAX = 1 << 22  # that are searched


@dataclass(frozen=True, eq=False)
class Quiet:
    """The longest stretch without excitation, and the hum in it.

    Attributes
    ----------
    lines
        Lines to be measured later.
    first, samples
        First sample and length of the stretch.
    found
        Tones, and the lines that each disturbs.
    units
        Units of the signals.
    constant
        Whether the excitation never changes in the searched samples.
    """

    lines: Lines
    first: int
    samples: int
    found: list[tuple[Hum, list[float]]]
    units: dict[str, str]
    constant: bool

    def plain(self) -> dict[str, Any]:
        """As plain data, for JSON."""
        tones = [
            {"frequency_hz": hum.frequency_hz, "amplitude": dict(hum.amplitude), "disturbed_lines_hz": disturbed}
            for hum, disturbed in self.found
        ]
        return {"first": self.first, "samples": self.samples, "units": self.units, "hum": tones}


def look_for_hum(log: Log, signals: Sequence[str], excitation: str | None, lines: Lines) -> Quiet:
    """Hum in the longest stretch in which the excitation does not change; without excitation, in the whole recording.

    A tone disturbs a line if their distance is less than half a bin of its window; a design excludes such lines.

    Raises
    ------
    SignalError
        If that stretch is shorter than two seconds.
    """
    names = list(dict.fromkeys([*signals, *([excitation] if excitation else [])]))
    rows = dict(zip(names, beginnings(log, names, _SAMPLES_MAX)))
    silent = np.all([np.isfinite(x) for x in rows.values()], axis=0)
    constant = True
    if excitation:
        w = rows[excitation]
        constant = np.unique(w[np.isfinite(w)]).size < 2
        silent[1:] &= (w[1:] == w[:-1]) & np.isfinite(w[1:])
    first, stop = _longest(silent)
    if excitation and stop - first < SECONDS_MIN * lines.rate_hz:
        raise SignalError(
            "pause-too-short",
            f"{excitation!r} pauses for {(stop - first) / lines.rate_hz:.3g} s at most, but the search for hum needs "
            f"{SECONDS_MIN:g} s or more without excitation",
            "record such a pause, or omit the lines",
            channel=excitation,
            pause_s=float((stop - first) / lines.rate_hz),
            limit_s=float(SECONDS_MIN),
        )
    found = find_hum({name: rows[name][first:stop] for name in dict.fromkeys(signals)}, lines.rate_hz)
    near = [lines.frequency_hz[disturbed].tolist() for disturbed in disturbed_lines(found, lines)]
    known = {channel.name: channel.unit for channel in log.channels}
    units = {name: known.get(name, "") for name in signals}
    return Quiet(lines, log.first + first, stop - first, list(zip(found, near)), units, constant)


class SilencesOfRecording:
    """The stretches of a recording in which the excitation does not change for two seconds or more, with their tones.

    None where no tone of the mains can disturb a line.

    Parameters
    ----------
    settings
        Lines and signals.
    first
        Number of the recording's first sample.
    """

    def __init__(self, settings: Settings, first: int) -> None:
        self._excitation = settings.excitation or settings.channel(settings.method.reference) or ""
        self._signals = list(dict.fromkeys(name for role in settings.roles if (name := settings.channel(role))))
        self._search = SilenceSearch(len(self._signals), settings.lines.rate_hz, (_SAMPLES_MAX,))
        self._found, self._stop = list[SilentStretch](), first
        self.channels = list(dict.fromkeys([*self._signals, self._excitation])) if may_disturb(settings.lines) else []

    def process(self, block: Block) -> None:
        """Search the next samples of `channels`."""
        if not self.channels:
            return
        if block.gap or block.start != self._stop:
            self._found += self._search.interrupt()
        signals = block.rows(self._signals)
        self._found += self._search.process(signals, block[self._excitation], block.start, np.zeros(0, dtype=np.intp))
        self._stop = block.stop

    def finish(self) -> list[SilentStretch]:
        """The stretches, at the end of the recording."""
        return self._found + list(self._search.interrupt())


def _longest(flags: np.ndarray) -> tuple[int, int]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    if not edges.size:
        return 0, 0
    first, stop = edges[::2], edges[1::2]
    at = int(np.argmax(stop - first))
    return int(first[at]), int(stop[at])
