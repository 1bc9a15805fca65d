"""OutputOnly: the modes of a machine over time as tracks, from its outputs alone, without input and responses."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from livebode.configuration import Axis
from livebode.core import Block, Channel, Event, Parameters, SignalError, Stateful
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.records import PARAMETERS
from livebode.runtime import Document, Estimate, FitResults, Outcome, versions
from livebode_modes.mode_tracker import ModeTracker, WindowModes
from livebode_modes.output_only_settings import OutputOnlySettings
from livebode_modes.stabilisation import Mode
from livebode_modes.tone_windows import ToneWindows, tone_event

Kind = Literal["mode", "harmonic"]

CONFIRMED = 5
"""Windows in which a track must be found before it is published."""
OK = "ok"
NOT_FOUND, HARMONIC = "not found", "harmonic"
_NEAR = 0.02  # of the frequency, from window to window
_SIGMAS = 3.0
_GAP_FACTOR_MAX = 3  # a mode that was missed may have moved further
_MAC_MIN = 0.6  # of the shapes of one mode in two windows
_NAMES: dict[Kind, tuple[str, ...]] = {"mode": ("frequency", "damping", "share"), "harmonic": ("frequency", "share")}
_UNITS = {"frequency": "Hz", "damping": "", "share": ""}


def mac(shape: NDArray[np.complex128], other: NDArray[np.complex128]) -> float:
    """Modal assurance criterion of two mode shapes: 1 if they are proportional (Allemang 2003).

    >>> round(mac(np.array([1, 1j]), np.array([2j, -2])), 6), mac(np.array([1, 0]), np.array([0, 1]))
    (1.0, 0.0)
    """
    product = np.vdot(shape, shape).real * np.vdot(other, other).real
    return float(np.abs(np.vdot(shape, other)) ** 2 / product) if product else 0.0


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
    windows: int = 0
    harmonic: int = 0
    number: int = 0
    kind: Kind = "mode"
    waiting: list[_Row] = field(default_factory=list)

    def distance(self, mode: Mode) -> float:
        """Distance of a mode of the next window, 1 at the limit; infinite for a different shape."""
        sigma = np.sqrt(self.last.covariance[0, 0] + mode.covariance[0, 0])
        near = max(_NEAR, 2 * self.last.damping)
        reach = near * self.last.frequency_hz * min(1 + self.missed, _GAP_FACTOR_MAX)
        if mac(self.last.shape, mode.shape) < _MAC_MIN:
            return np.inf
        return float(abs(mode.frequency_hz - self.last.frequency_hz) / max(reach, _SIGMAS * sigma))

    def add(self, row: _Row) -> None:
        self.waiting.append(row)
        if row.mode is None:
            self.missed += 1
            return
        self.last, self.missed = row.mode, 0
        self.windows += 1
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

    def process(self, window: WindowModes) -> list[Parameters]:
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
            track.add(rows[taken[i]] if i in taken else _Row(window))
        for j, row in enumerate(rows):
            if j not in taken.values() and row.mode is not None:
                self._tracks.append(_Track(row.mode))
                self._tracks[-1].add(row)

    def _published(self, least: int) -> list[Parameters]:
        rows = []
        for track in sorted(self._tracks, key=lambda track: track.last.frequency_hz):
            if not track.waiting or (not track.number and track.windows < least):
                continue
            if not track.number:
                track.kind = "harmonic" if 2 * track.harmonic > track.windows else "mode"
                self._numbers[track.kind] += 1
                track.number = self._numbers[track.kind]
            rows.append(track.rows())
        return rows


def _status(row: _Row, kind: Kind) -> str:
    if row.mode is not None:
        return HARMONIC if row.harmonic and kind == "mode" else OK
    return NOT_FOUND if row.window.status == OK else row.window.status


class ModeSummaries:
    """Collects the rows of each track.

    Attributes
    ----------
    modes, harmonics
        One entry for each track: name, number of rows and of those with values, lowest and highest frequency, means of
        damping and share, and the newest values with sigma.
    """

    def __init__(self) -> None:
        self._tracks: dict[str, dict[str, Any]] = {}

    def add(self, rows: Parameters) -> None:
        """Rows of one track."""
        track = self._tracks.setdefault(rows.model, {"name": rows.model, "rows": 0, "found": 0})
        track["rows"] += len(rows)
        ok = np.flatnonzero(rows.ok)
        if not ok.size:
            return
        f, before = rows["frequency"][ok], track["found"]
        low, high = track.get("frequency_hz", (np.inf, -np.inf))
        track["frequency_hz"] = [min(low, float(f.min())), max(high, float(f.max()))]
        track.setdefault("first", _values(rows, int(ok[0])))
        track["newest"] = _values(rows, int(ok[-1]))
        track["found"] = before + ok.size
        for name in rows.names[1:]:
            mean = track.get(f"mean_{name}", 0.0)
            track[f"mean_{name}"] = (before * mean + float(rows[name][ok].sum())) / track["found"]

    @property
    def modes(self) -> list[dict[str, Any]]:
        return [track for name, track in self._tracks.items() if name.startswith("mode")]

    @property
    def harmonics(self) -> list[dict[str, Any]]:
        return [track for name, track in self._tracks.items() if name.startswith("harmonic")]

    def harmonic_events(self, sample: int, time_s: float) -> list[Event]:
        """An event for each harmonic."""
        return [
            Event(
                "harmonic",
                sample,
                time_s,
                Message(
                    "{frequency_hz:.5g} Hz has a constant amplitude and almost no damping: a harmonic, such as a "
                    "rotation or the mains, not a mode",
                    frequency_hz=track["newest"]["frequency_hz"],
                ),
                {"name": track["name"]},
            )
            for track in self.harmonics
        ]


def _values(rows: Parameters, i: int) -> dict[str, float]:
    values = {"time_s": float(rows.time_s[i])}
    for j, name in enumerate(rows.names):
        key = "frequency_hz" if name == "frequency" else name
        values[key] = float(rows.value[i, j])
        if np.isfinite(sigma := rows.sigma[i, j]):
            values[f"{key}_sigma"] = float(sigma)
    return values


_NO_MODES = Message(
    "no mode was found: no pole is repeated by models of several orders; choose a band around the expected frequency, "
    "or a longer window"
)


class OutputOnly(Estimate):
    """The modes of a recording.

    Parameters
    ----------
    axis
        Its configuration, with [output_only].
    settings
        Outputs, band and window.
    """

    tables: ClassVar = {"parameters": PARAMETERS}
    alone = True
    readiness = detection = None

    def __init__(self, axis: Axis, settings: OutputOnlySettings) -> None:
        self.axis, self.settings = axis, settings
        self._tracker, self._tracks = ModeTracker(settings), Tracks(settings.hops)
        self._tones = ToneWindows(settings.hops)
        self._summaries = ModeSummaries()
        self._windows: Counter[str] = Counter()
        self._threads = ThreadpoolController()

    @property
    def rate_hz(self) -> float:
        return self.settings.rate_hz

    @property
    def window(self) -> int:
        return self.settings.window

    @property
    def step(self) -> int:
        return self.settings.hop

    @property
    def signals(self) -> list[str]:
        return list(self.settings.outputs)

    @property
    def reference(self) -> str:
        return self.settings.outputs[0]

    @property
    def channels(self) -> list[str]:
        return list(dict.fromkeys([*self.settings.outputs, *filter(None, [self.settings.schedule])]))

    @property
    def counts(self) -> dict[str, int]:
        return self._tracker.counts

    @property
    def parts(self) -> Mapping[str, Stateful]:
        """None: a stopped run begins again."""
        return {}

    def process(self, block: Block) -> list[WindowModes]:
        with self._threads.limit(limits=1, user_api="blas"):  # small matrices: threads would wait for each other
            return self._tracker.process(block, self.run.events.append)

    def valid(self, results: list[WindowModes]) -> NDArray[np.bool_]:
        return np.array([[window.status == "ok"] for window in results], dtype=np.bool_).reshape(-1, 1)

    def documents(self, results: list[WindowModes]) -> Iterator[Document]:
        for result in results:
            yield from self._tracked(self._tones.process(result))

    def _tracked(self, windows: list[WindowModes]) -> Iterator[Document]:
        for window in windows:
            self._windows[window.status] += 1
            yield from self._rows(self._tracks.process(window))

    def _rows(self, parts: list[Parameters]) -> Iterator[Document]:
        if parts:
            yield FitResults(tuple(parts))
            for part in parts:
                self._summaries.add(part)

    def judge(self) -> Iterable[Document]:
        yield from self._tracked(self._tones.finish())
        if not self._windows:
            raise SignalError(
                "too-short",
                f"the recording has no window of {self.settings.window} samples with what the filter needs",
                "choose a shorter window, or record more",
                window=self.settings.window,
            )
        yield from self._rows(self._tracks.finish())

    def describe(self, about: Mapping[str, Any], channels: Sequence[Channel]) -> dict[str, Any]:  # noqa: ARG002
        facts = self.settings.found() | about["found"]
        return {"output_only": True} | dict(about) | {"found": facts, "versions": versions()}

    def summary(self, sample: int, time_s: float) -> tuple[dict[str, Any], list[Event]]:
        run_s, recorded_s = self.run.counts.run_s, self.counts["samples"] / self.rate_hz
        tones = self._tones.tones
        events = [*map(tone_event, tones), *self._summaries.harmonic_events(sample, time_s)]
        if not self._summaries.modes and not tones:
            events.append(Event("no-modes", sample, time_s, _NO_MODES))
        done = self.describe(self.run.about, self.run.source.channels) | {
            "counts": self.counts | {"windows": self._windows.total()},
            "windows": dict(self._windows),
            "speed": {"recorded_s": recorded_s, "run_s": run_s, "times_real_time": recorded_s / run_s},
            "modes": self._summaries.modes,
            "harmonics": self._summaries.harmonics,
            "moving_tones": tones,
        }
        return done, events

    def outcome(self, directory: Path, summary: dict[str, Any]) -> Outcome:
        return Outcome(directory, summary)
