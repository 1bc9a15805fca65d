"""SpectraTracker: a drive's spectra in, frequency responses with bounds out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Flags, Floats
from livebode.core import (
    LEFT_OUT,
    NOT_WHOLE,
    SPIKE,
    Block,
    Channel,
    Emit,
    Event,
    Responses,
    SignalError,
    Spectra,
    SpectraLayout,
    Stage,
    UsageError,
    hand_over,
    ignore,
)
from livebode.estimation.implausible import PlausibleRange
from livebode.estimation.line_stage import LineStage
from livebode.estimation.ripple import HopSpeed, ripple_power
from livebode.estimation.spectra import SpectraRows, after
from livebode.estimation.stream_estimator import StreamCounters, StreamEstimator
from livebode.estimation.tracker_settings import Settings
from livebode.kernel import largest_magnitudes
from livebode.language import Message

DRIVE = {
    "not-whole": Message("a window is incomplete (marked by the drive, or its sums are not finite)"),
    "implausible": Message("a spectrum is more than 1e8 times larger than all in the period before"),
    "spike": Message("the drive marks a window with a spike"),
}


class SpectraInputStatistics(StreamCounters):
    """Counts and Events of a stream of Spectra. One Event for marked windows that overlap or follow each other."""

    _stage = Stage("spectra-counts", 1)

    def __init__(self, events: list[Event], window: int, sentences: Mapping[str, str] = DRIVE) -> None:
        super().__init__(events, sentences, -(1 << 62), also=("spectra",))
        self._window, self._sentences = window, sentences

    def count(self, block: Spectra, marked: dict[str, NDArray[np.bool_]]) -> None:
        """Count these, of each kind those that are `marked`; SignalError where they overlap the previous ones."""
        first = self._next < 0
        missing = 0 if first else block.start - self._next
        if missing < 0:
            raise SignalError(
                "repeated",
                f"spectra up to sample {self._next - 1} came twice, from sample {block.start} on",
                "let blocks follow each other: drop what repeats",
                first_sample=block.start,
                last_sample=self._next - 1,
            )
        if not first and (missing or block.gap):
            self.counts["gaps"] += 1
            self.counts["missing"] += missing
            message = Message(
                "an unknown number of spectra is missing before sample {at_sample}", at_sample=block.start
            )
            if missing:
                message = Message(
                    "spectra of {missing_samples} samples are missing before sample {at_sample}",
                    missing_samples=missing,
                    at_sample=block.start,
                )
            self._report("gap", block, block.start, message, missing_samples=missing)
        if first:
            # A stream that begins with the drive is incomplete at first, which needs no event.
            self._last["not-whole"] = int(block.sample[0]) - block.layout.hop
        self._count(block, marked["not-whole"], block.layout.hop + missing)
        self._next = block.stop
        begins: list[tuple[int, str]] = []
        for kind, those in marked.items():
            if those.any():
                sample = block.sample[those]
                apart = np.diff(sample, prepend=self._last[kind]) >= max(self._window, block.layout.hop + 1)
                begins += [(int(n), kind) for n in sample[apart]]
                self.counts[kind] += sample.size
                self._last[kind] = int(sample[-1])
        for number, kind in sorted(begins):
            self._report(kind, block, number, Message("{what}; its response is not valid", what=self._sentences[kind]))

    def continues_at(self, start: int) -> bool:
        """Whether this is the sample after the previous spectra."""
        return self._next == start

    def count_whole(self, hop: int) -> None:
        """Count a spectrum that is whole and follows the previous one, as `count` would."""
        self._next += hop
        self.counts["samples"] += min(hop, self._window)
        self.counts["spectra"] += 1

    def _count(self, block: Spectra, not_whole: NDArray[np.bool_], new: int) -> None:
        """Samples of these windows that previous ones did not contain; `new` since the previous window."""
        if self._next < 0 and not not_whole[0]:
            new = self._window
        self.counts["samples"] += min(new, self._window) + (len(block) - 1) * min(block.layout.hop, self._window)
        self.counts["spectra"] += len(block)


_NONE = np.zeros(0, dtype=np.intp)


class NewestSpectra(NamedTuple):
    """A spectrum of each of several machines with one layout, complete in itself and not marked.

    Attributes
    ----------
    sums
        As those of `Spectra`, shape (signals, machines, bins).
    values
        At the window's centres, shape (values, machines).
    start, place
        As those of `Spectra`, shape (machines,).
    channels, rate_hz
        Of all of them.
    """

    sums: NDArray[np.complex128]
    values: Floats
    start: NDArray[np.int64]
    place: NDArray[np.int64]
    channels: tuple[Channel, ...]
    rate_hz: float


class SpectraTracker(StreamEstimator[SpectraInputStatistics]):
    """Frequency responses of a machine whose drive runs the kernel and sends the spectra: a Tracker without its kernel.

    With a kernel of the same precision the Responses equal those of a Tracker from the samples. The effective time of
    a Response is its window's centre; it is (N − 1)/2 samples late. Spectra that the drive marks as not whole or with
    a spike are excluded, and so are sums that are not finite or 1e8 times larger than all in the previous period. Lost
    spectra do not invalidate later windows, because the drive continues.

    With a hop of m windows, the spectra behind `sigma`, the mean and the coherence are those m periods apart:
    `forgetting` then counts spectra, and changes of the machine within that time count as noise. Where it moves,
    take the noise from detection lines, which each spectrum contains.

    Parameters
    ----------
    settings
        As for a Tracker, with the layout's lines and hop. `differenced` may be omitted: the layout contains it.
    layout
        Signals, window and bins of the spectra.

    Raises
    ------
    LivebodeError
        If a signal, a bin or the schedule that the settings need is not sent, or they need samples.
    """

    _stage = Stage("spectra-tracker", 1)
    _sentences: Mapping[str, str] = DRIVE
    _lines: LineStage

    def __init__(self, settings: Settings, layout: SpectraLayout) -> None:
        _check(settings, layout)
        if settings.noise == "auto" and not set(settings.lines.quiet) <= set(layout.bins):
            settings = replace(settings, noise="periods")
        self.settings, self._layout = settings, layout
        names = [channel.name for channel in layout.signals]
        self._signals = [names.index(settings.channel(role) or "") for role in settings.roles]
        self._events: list[Event] = []
        self._lines = LineStage(settings, layout.bins, events=self._events)
        bins = self._lines.bins
        why = "a Hann window needs" if settings.hann else "the noise needs"
        self._columns = layout.columns([int(k) for k in bins], why)
        advanced, differenced = np.array(settings.advanced_ticks), np.array(layout.differenced)[self._signals]
        self._after = after(bins, layout.window, differenced, advanced)[:, np.newaxis]
        self._is_plain = bool(np.all(self._after == 1))
        self._chosen = np.array(self._signals, dtype=np.int64), self._columns.astype(np.int64)
        values = [channel.name for channel in layout.values]
        self._schedule = values.index(settings.schedule) if settings.schedule else None
        self._watch = SpectraInputStatistics(self._events, layout.window, self._sentences)
        self._range = PlausibleRange(len(self._signals), max(1, layout.window // layout.hop))
        self._speed = HopSpeed(settings.lines.rate_hz) if settings.ripple else None
        self._parts = {
            "lines": self._lines,
            "watch": self._watch,
            "range": self._range,
            **({"speed": self._speed} if self._speed else {}),
        }

    def found(self) -> dict[str, Any]:
        """The basis of the responses as plain data for a record."""
        layout = self._layout
        constants = {signal.name: c for signal, c in zip(layout.signals, layout.subtracted)}
        return super().found() | {"from": "spectra", "subtracted": constants}

    def process(self, block: Block, emit: Emit = ignore) -> Responses:
        """Responses of these Spectra, which follow the previous ones; `emit` receives each event in them.

        Raises
        ------
        SignalError
            If they are of another layout, are samples, or came twice.
        """
        if not isinstance(block, Spectra) or block.layout != self._layout:
            raise SignalError(
                "layout-differs",
                "these spectra do not have the layout of the tracker",
                "make another tracker",
            )
        if len(block) == 1 and (usual := self.usual(block)) is not None:
            responses, _ = self.process_each([self], usual)
            if responses is not None:
                return responses
        hop, window = self._layout.hop, self._layout.window
        sums, sample = block.sums.take(self._signals, axis=0).take(self._columns, axis=2), block.sample
        finite = np.asarray(np.isfinite(sums).all(axis=(0, 2)))
        with np.errstate(over="ignore", invalid="ignore"):  # responses from implausible numbers are excluded
            spectrum = sums if finite.all() else np.where(finite[:, np.newaxis], sums, 0.0)
            spectrum = spectrum if self._is_plain else spectrum * self._after
            size = largest_magnitudes(np.ascontiguousarray(spectrum))
        if not np.isfinite(size).all():
            size = np.nan_to_num(size)
        implausible = np.zeros(len(block), dtype=np.bool_)
        implausible[self._range.process(size)] = True
        not_whole, spike = (block.state & NOT_WHOLE != 0) | ~finite, block.state & SPIKE != 0
        left_out = block.state & LEFT_OUT != 0
        self._watch.count(block, {"not-whole": not_whole, "implausible": implausible, "spike": spike})
        whole = ~(not_whole | implausible)
        rows = SpectraRows(spectrum, sample, whole, whole & ~(spike | left_out), _NONE, _NONE, _NONE)
        place = (block.place + hop * np.arange(len(block))) % window
        time_s = block.origin_s + (sample - (window - 1) / 2) / block.rate_hz
        schedule = block[self.settings.schedule] if self.settings.schedule else np.full(len(block), np.nan)
        ripple = None
        if self._speed is not None:
            ripple = ripple_power(self.settings.ripple, self.settings.lines, self._speed.at(schedule, sample))
        centre = np.stack([time_s, schedule])
        responses = self._lines.process(rows, place, centre, block.channels, ripple=ripple)
        self._ends_with(responses)
        hand_over(self._events, emit)
        return responses

    def usual(self, block: Block) -> NewestSpectra | None:
        """The spectra of the Block as those of several machines, if `process_each` supports them one by one."""
        if not isinstance(block, Spectra) or block.layout != self._layout:
            return None
        if self.kind is None or block.gap or block.origin_s or any(block.state.tolist()):
            return None
        values = np.empty((len(self._layout.values), len(block)))
        if self._schedule is not None:
            values[self._schedule] = block[self.settings.schedule or ""]
        start, place = np.array([block.start]), np.array([block.place])
        if len(block) > 1:
            passed = self._layout.hop * np.arange(len(block))
            start, place = start + passed, (place + passed) % self._layout.window
        return NewestSpectra(block.sums, values, start, place, block.channels, block.rate_hz)

    @cached_property
    def kind(self) -> object:
        """One object for all trackers that `process_each` computes together; None for one that it does not support."""
        plain = self._lines.is_plain and self._speed is None and self._is_plain
        return _kind(self._identity) if plain else None

    @staticmethod
    def process_each(trackers: Sequence[SpectraTracker], spectra: NewestSpectra) -> tuple[Responses | None, Flags]:
        """The next response of each of several trackers of one `kind`, whose next spectra are neither lost nor marked.

        The bits of a response do not depend on the other trackers: they are those of `process`.

        Parameters
        ----------
        trackers
            Different ones.
        spectra
            A spectrum for each.

        Returns
        -------
        responses, taken
            A row for each tracker that took its spectrum, None without one, and which these are, (trackers,). The
            others, whose spectrum is not finite, implausible or not the next one, have not changed: they need
            `process`.
        """
        example = trackers[0]
        layout, window = example._layout, example._layout.window
        sample = spectra.start + (layout.hop - 1)
        centre = np.empty((2, len(trackers)))
        centre[0] = 0.0 + (sample - (window - 1) / 2) / spectra.rate_hz
        centre[1] = np.nan if example._schedule is None else spectra.values[example._schedule]
        starts = spectra.start.tolist()
        responses, taken = LineStage.process_each(
            [tracker._lines for tracker in trackers],
            [tracker._range for tracker in trackers],
            spectra.sums,
            example._chosen,
            sample,
            spectra.place,
            centre,
            np.array([tracker._watch.continues_at(start) for tracker, start in zip(trackers, starts)]),
            spectra.channels,
        )
        if responses is not None:
            for tracker, is_taken in zip(trackers, taken.tolist()):
                if is_taken:
                    tracker._watch.count_whole(layout.hop)
                    tracker._ends_with(responses)
        return responses, taken

    @cached_property
    def _identity(self) -> str:
        return f"{self.settings.identity} {self._layout}"


@lru_cache(maxsize=256)
def _kind(identity: str) -> object:  # noqa: ARG001 - the key
    return object()


def _check(settings: Settings, layout: SpectraLayout) -> None:
    """Raise LivebodeError where the spectra do not support these settings."""
    mine = settings.lines
    if (mine.window, mine.bins) != (layout.window, layout.lines) or settings.step != layout.hop:
        raise SignalError(
            "layout-differs", "lines, window or hop are not those of the spectra", "take them from the layout"
        )
    if settings.spikes:
        raise UsageError(
            "conflict",
            "spikes are found in samples, and the drive sends spectra",
            "leave them out, and let the drive mark its windows",
            argument="spikes",
        )
    if settings.dtype != "float64":
        raise UsageError(
            "conflict",
            f"dtype={settings.dtype!r} is for samples, but the drive has already computed the spectra",
            "leave it out",
            argument="dtype",
            value=settings.dtype,
        )
    _check_channels(settings, layout)


def _check_channels(settings: Settings, layout: SpectraLayout) -> None:
    signals, values = ([channel.name for channel in part] for part in (layout.signals, layout.values))
    for role in settings.roles:
        name = settings.channel(role) or ""
        if name not in signals:
            raise SignalError(
                "channel-unknown",
                f"the drive sends no spectrum of {name!r}, which the {settings.estimator} estimator needs",
                f"choose one that it sends: {', '.join(signals)}",
                channel=name,
                channels=signals,
            )
    if settings.schedule is not None and settings.schedule not in values:
        raise SignalError(
            "channel-unknown",
            f"the drive does not send the value of {settings.schedule!r} to plot over",
            f"let it send that, or leave out the schedule (values: {', '.join(values) or 'none'})",
            argument="schedule",
            channel=settings.schedule,
            channels=values,
        )
    used = {settings.channel(role) for role in settings.roles}
    theirs = {name for name, d in zip(signals, layout.differenced) if d and name in used}
    if settings.differenced and set(settings.differenced) != theirs:
        odd = sorted(set(settings.differenced) ^ theirs)[0]
        does = "differences" if odd in theirs else "does not difference"
        raise SignalError(
            "layout-differs",
            f"the drive {does} {odd!r}, which cannot be changed in spectra",
            "name it in differenced as the drive does it, or leave differenced out",
            argument="differenced",
            channel=odd,
        )
