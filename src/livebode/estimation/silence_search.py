"""Hum in stretches without excitation of two seconds or more: which lines it disturbs, and until when."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Lines, Stage, StatefulBase
from livebode.dataclass import dataclass
from livebode.estimation.hum import GONE, SECONDS_MIN, Hum, disturbed_lines, find_hum

_VALUES_MAX = 1 << 15  # of a stretch in a state: 256 kB, 16 s of two signals at 1 kHz


@dataclass(frozen=True, eq=False)
class SilentStretch:
    """Samples first … stop − 1 without excitation, the tones in them, and whether the stretch ends there."""

    first: int
    stop: int
    tones: Sequence[Hum]
    ends: bool = True

    @property
    def samples(self) -> int:
        return self.stop - self.first


class SilenceSearch(StatefulBase):
    """Cuts stretches without excitation from samples that come in any pieces, and searches each for hum.

    A state contains the samples of the stretch that has not ended, so a restored search continues it, with two limits:
    up to 32,768 values, and not the stretches after the last look in the same silence, because a machine may be silent
    for days and each commit of a record contains a state. Beyond them a restored search begins the stretch again.

    Parameters
    ----------
    signals
        Number of signals that are searched.
    rate_hz
        Samples per second.
    looks
        Lengths in samples at which a stretch is searched before it ends, ascending; after the last one another
        stretch begins.
    """

    _stage = Stage("silence-search", 1)
    _STATE = ("_stop", "_newest", "_later")

    def __init__(self, signals: int, rate_hz: float, looks: Sequence[int]) -> None:
        self._signals, self._rate_hz, self._looks = signals, rate_hz, looks
        self._shortest = int(np.ceil(SECONDS_MIN * rate_hz))
        self._parts: list[Floats] = []
        self._size = self._stop = 0
        self._newest = np.nan  # sample of the excitation; at the beginning any sample follows it
        self._later = False  # the stretch follows another one in the same silence

    def _state(self) -> dict[str, Any]:
        if not self._size or self._later or self._signals * self._size > _VALUES_MAX:
            return super()._state() | {"samples": np.zeros((self._signals, 0))}
        self._parts = [np.concatenate(self._parts, axis=1)]
        return super()._state() | {"samples": self._parts[0]}

    def _load(self, state: dict[str, Any]) -> None:
        samples = state["samples"]
        if samples.ndim != 2 or samples.shape[0] != self._signals or samples.shape[1] >= self._looks[-1]:
            raise ValueError(f"samples of shape {samples.shape}")
        super()._load(state)
        self._size = samples.shape[1]
        self._parts = [samples] if self._size else []

    def process(self, data: Floats, excitation: Floats, start: int, aside: NDArray[np.intp]) -> Iterator[SilentStretch]:
        """The stretches that are long enough in these samples, which follow the previous ones.

        Parameters
        ----------
        data
            Signals that are searched, shape (signals, samples).
        excitation
            Shape (samples,). Where it does not change, there is none.
        start
            Number of the first sample.
        aside
            Positions of the samples that belong to no stretch.
        """
        before, running = self._newest, excitation.size > 1 and excitation[-1] != excitation[-2]
        if running and not self._size and excitation.size < self._shortest:
            self._newest, self._later = float(excitation[-1]), False
            return
        before = before if np.isfinite(before) else excitation[0]
        silent = np.empty(excitation.size, dtype=np.bool_)
        silent[0] = excitation[0] == before
        np.equal(excitation[1:], excitation[:-1], out=silent[1:])
        at = np.flatnonzero(silent)
        silent[at] = np.isfinite(data[:, at]).all(axis=0) & np.isfinite(excitation[at])
        silent[aside] = False
        self._newest = float(excitation[-1])
        edges = np.flatnonzero(np.diff(np.concatenate([[False], silent, [False]]).astype(np.int8))).reshape(-1, 2)
        if not silent[0]:
            yield from self._end()
        # Others, such as the steps of a PRBS, neither continue nor are long enough.
        used = (edges[:, 0] == 0) | (edges[:, 1] == silent.size) | (edges[:, 1] - edges[:, 0] >= self._shortest)
        for first, stop in edges[used].tolist():
            yield from self._extend(data[:, first:stop], start + stop)
            if stop < silent.size:
                yield from self._end()

    def interrupt(self) -> Iterator[SilentStretch]:
        """The stretch that ends with the samples so far, because the next ones do not follow them."""
        yield from self._end()
        self._newest = np.nan

    def _extend(self, data: Floats, stop: int) -> Iterator[SilentStretch]:
        offset, samples = 0, data.shape[1]
        while offset < samples:
            until = next(look for look in self._looks if look > self._size)
            taken = min(samples - offset, until - self._size)
            self._parts.append(data[:, offset : offset + taken].copy())
            offset, self._size, self._stop = offset + taken, self._size + taken, stop - samples + offset + taken
            if self._size == self._looks[-1]:
                yield from self._end()
                self._later = True
            elif self._size == until:
                yield self._searched(ends=False)

    def _end(self) -> Iterator[SilentStretch]:
        if self._size >= self._shortest:
            yield self._searched(ends=True)
        self._parts, self._size, self._later = [], 0, False

    def _searched(self, *, ends: bool) -> SilentStretch:
        self._parts = [np.concatenate(self._parts, axis=1)]
        signals = {str(row): x for row, x in enumerate(self._parts[0])}
        return SilentStretch(self._stop - self._size, self._stop, find_hum(signals, self._rate_hz), ends)


def updated(shortest: Floats, stretch: SilentStretch, lines: Lines, *, withdraw: bool = True) -> Floats:
    """The shortest stretch in which hum was found at each line, in samples, 0 without hum, after another stretch.

    Hum is withdrawn where a stretch does not show it that is four times as long: it would show a quarter of its power.
    """
    disturbed = disturbed_lines(stretch.tones, lines).any(axis=0)
    known = np.where(shortest > 0, np.minimum(shortest, stretch.samples), stretch.samples)
    gone = withdraw & stretch.ends & (shortest <= GONE * stretch.samples)
    return np.asarray(np.where(disturbed, known, np.where(gone, 0.0, shortest)))


@dataclass(frozen=True, eq=False)
class HumSpan:
    """Samples first … stop − 1 of a recording in which a line contains hum; stop None: to the end."""

    line: int
    first: int
    stop: int | None

    def shifted(self, samples: int) -> HumSpan:
        return HumSpan(self.line, self.first + samples, None if self.stop is None else self.stop + samples)


def hum_spans(stretches: Sequence[SilentStretch], lines: Lines, *, average: bool) -> list[HumSpan]:
    """Where lines contain hum in a recording with these silences.

    From the end of the silence before the first one that shows the hum to the begin of the one that withdraws it; of
    an average over the recording everywhere.
    """
    shortest, begun, spans, before = np.zeros(len(lines)), dict[int, int](), list[HumSpan](), 0
    for stretch in stretches:
        after = updated(shortest, stretch, lines, withdraw=not average)
        for line in np.flatnonzero((after > 0) & (shortest == 0)).tolist():
            begun[line] = 0 if average else before
        for line in np.flatnonzero((after == 0) & (shortest > 0)).tolist():
            spans.append(HumSpan(line, begun.pop(line), stretch.first))
        shortest, before = after, stretch.stop
    return spans + [HumSpan(line, first, None) for line, first in begun.items()]
