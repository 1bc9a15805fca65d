"""Playback: a design is played on a controller, watched and recorded."""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from enum import Enum, auto
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, ConfigError, LivebodeError, MeasurementError, nearest_name, writing
from livebode.dataclass import dataclass
from livebode.sources.live import LiveBlock, Player
from livebode_design.design import Design

REST_S = 0.25
"""Recorded and watched before anything is played."""
ZERO_S = 0.05
"""The excitation has ended when it was zero for so long."""
LATE_S = 2.0
_LOOK_S = 0.05
_STEADY_SHARE = 0.9
TOLERANCE = 0.01
"""Largest difference from the design, as a share of its peak: rounding and the text of a controller are less."""
Say = Callable[[str], None]


class StopRequest:
    """Requests to end a measurement, as from a signal handler: the first ramps down, the second does without."""

    def __init__(self) -> None:
        self.count = 0

    def ask(self) -> None:
        """Request the end."""
        self.count += 1


@dataclass(frozen=True)
class PlaybackResult:
    """What was recorded.

    Attributes
    ----------
    samples, lost
        Number of samples, and of those that the source lost.
    steady
        First sample of the steady part, and the sample after it; both 0 without one.
    interrupted
        Whether the end was requested before it was complete.
    """

    samples: int
    lost: int
    steady: tuple[int, int]
    interrupted: bool


class _Phase(Enum):
    REST = auto()
    PLAYING = auto()
    ENDING = auto()


class Playback:
    """Plays a design once, watches its limits, and records. `run` may be called once.

    Parameters
    ----------
    design
        The excitation and the recording time.
    player
        Plays it.
    excitation
        Channel of the excitation.
    ranges
        Lowest and highest permitted value of each limited channel.
    silence_s
        Time without samples after which it is ramped down, in seconds.
    say
        Called with a sentence for a person at each step.
    """

    def __init__(
        self,
        design: Design,
        player: Player,
        excitation: str,
        ranges: Mapping[str, tuple[float, float]],
        silence_s: float,
        say: Say = lambda _: None,
    ) -> None:
        self._design, self._player, self._excitation = design, player, excitation
        self._ranges, self._silence_s, self._say = ranges, silence_s, say
        self._phase, self._since_start, self._rested = _Phase.REST, 0, 0
        self._first: int | None = None
        self._rested_only = False
        self._played: list[NDArray[np.float64]] = []
        self._reason: LivebodeError | None = None
        self._interrupted = False
        self._asked_s = 0.0
        self._zeros = 0
        self._started_s, self._unit = 0.0, 1.0

    def run(self, path: Path, request: StopRequest) -> PlaybackResult:
        """Record to `path`, a new CSV file; returns when the excitation has ended.

        Raises
        ------
        MeasurementError
            If it was ended by a limit, silence or the controller, or if the machine played something else. What was
            recorded remains.
        SourceError
            If no samples arrive; nothing is played then.
        """
        with self._player.source.open() as source, LogTable(path) as table:
            watch = LimitWatch(self._ranges, [channel.name for channel in source.channels])
            self._unit = {channel.name: channel.factor for channel in source.channels}.get(self._excitation, 1.0)
            try:
                self._loop(watch, table, request)
            finally:
                self._player.close()
            lost = source.health.lost
        return self._result(lost)

    def _loop(self, watch: LimitWatch, table: LogTable, request: StopRequest) -> None:
        heard = time.monotonic()
        for block in self._player.source.stream(wait_s=_LOOK_S):
            if block is not None and len(block):
                heard = time.monotonic()
                self._record(block, watch, table)
            elif time.monotonic() - heard > self._silence_s:
                self._end(_silent(time.monotonic() - heard))
            if request.count and self._phase is not _Phase.ENDING:
                self._interrupted = True
                self._end(None)
                self._say(f"stopping: the excitation is zero in {self._player.stop_s:.3g} s")
            if request.count > 1:
                self._player.off()
            if self._advanced():
                return
        self._end(_silent(time.monotonic() - heard))

    def _record(self, block: LiveBlock, watch: LimitWatch, table: LogTable) -> None:
        table.append(block)
        self._played.append(block[self._excitation])
        zero = block[self._excitation] == 0.0
        self._zeros = self._zeros + zero.size if zero.all() else int(np.argmin(zero[::-1]))
        if self._phase is _Phase.REST:
            self._rested += len(block)
        elif self._first is None and not zero.all():
            self._first = block.start + int(np.argmin(zero))
        if self._first is not None:
            self._since_start = block.start + len(block) - self._first
        if (violation := watch.check(block)) is not None:
            self._end(violation)

    def _end(self, reason: LivebodeError | None) -> None:
        """Ramp down, once; the first reason counts."""
        if self._phase is _Phase.ENDING:
            return
        if self._phase is _Phase.PLAYING:
            self._player.ramp_down()
            self._zeros = 0
        else:
            self._rested_only = True
        self._phase, self._asked_s, self._reason = _Phase.ENDING, time.monotonic(), reason
        if reason is not None:
            self._say(f"ramping down: {reason}")

    def _advanced(self) -> bool:
        """Take the next step where it is due; whether the measurement has ended."""
        lines = self._design.waveform.lines
        if self._phase is _Phase.REST and self._rested >= REST_S * lines.rate_hz:
            self._say(f"ramping up over {self._design.ramp_s:.3g} s, then playing {self._design.recording_s:.4g} s")
            self._phase, self._started_s = _Phase.PLAYING, time.monotonic()
            waveform = self._design.waveform  # in N m; the controller takes the unit of its channel
            self._player.start(replace(waveform, samples=waveform.samples / self._unit))
        elif self._phase is _Phase.PLAYING:
            self._player.keep(self._since_start)
            if self._first is None and time.monotonic() - self._started_s > self._player.stop_s + LATE_S:
                self._end(self._differs(0.0))
            elif self._since_start >= self.playing_s * lines.rate_hz:
                self._end(None)
                self._say("complete; ramping down")
        elif self._phase is _Phase.ENDING:
            self._player.keep(self._since_start)
            if self._rested_only:
                return True
            ending_s = time.monotonic() - self._asked_s
            # An excitation that was not seen yet may still come, from what was sent ahead.
            came = self._first is not None or ending_s > self._player.stop_s
            if came and self._zeros >= ZERO_S * lines.rate_hz:
                return True
            if ending_s > self._player.stop_s + LATE_S:
                self._fail_to_end()
                return True
        return False

    @property
    def playing_s(self) -> float:
        """From the start to the ramp down: the ramp up, the recording, and a period for what begins between them."""
        lines = self._design.waveform.lines
        return self._design.ramp_s + self._design.recording_s + 2 * lines.window / lines.rate_hz

    def _fail_to_end(self) -> None:
        if self._reason is None or self._reason.code != "measurement.silent":
            self._reason = MeasurementError(
                "not-ended",
                f"{self._excitation!r} is not zero {self._player.stop_s + LATE_S:.3g} s after its end was requested",
                "switch the drive off",
                channel=self._excitation,
            )

    def _result(self, lost: int) -> PlaybackResult:
        if self._reason is not None:
            raise self._reason
        played = np.concatenate(self._played) if self._played else np.zeros(0)
        design = self._design
        first, last = steady_part(played, design.waveform.samples)
        rate_hz = design.waveform.lines.rate_hz
        if not self._interrupted and last - first < _STEADY_SHARE * design.recording_s * rate_hz:
            raise self._differs((last - first) / rate_hz)
        return PlaybackResult(played.size, lost, (first, last), self._interrupted)

    def _differs(self, steady_s: float) -> MeasurementError:
        return MeasurementError(
            "played-differs",
            f"the recorded excitation repeats the design for {steady_s:.4g} s without a break, "
            f"not for {self._design.recording_s:.4g} s",
            "check that nothing else drives the signal, and that the computer was not overloaded",
            channel=self._excitation,
            steady_s=steady_s,
        )


def _silent(seconds: float) -> MeasurementError:
    return MeasurementError(
        "silent",
        f"no samples arrived for {seconds:.2g} s while the excitation was played; it was ramped down",
        "check the controller",
        silent_s=seconds,
    )


class LimitWatch:
    """Finds the first sample beyond a limit.

    Parameters
    ----------
    ranges
        Lowest and highest permitted value of each limited channel.
    channels
        Names of the channels that are received.

    Raises
    ------
    ConfigError
        If there is no such channel.
    """

    def __init__(self, ranges: Mapping[str, tuple[float, float]], channels: Sequence[str]) -> None:
        for name in ranges:
            if name not in channels:
                raise ConfigError(
                    "key-unknown",
                    f"measure.limits.{name}: there is no channel {name!r}",
                    nearest_name(name, list(channels)),
                    key=f"measure.limits.{name}",
                )
        self._ranges = dict(ranges)

    def check(self, block: Block) -> MeasurementError | None:
        """The first violation in a Block; a value that is not finite is one."""
        first: tuple[int, str] | None = None
        for name, (low, high) in self._ranges.items():
            with np.errstate(invalid="ignore"):
                beyond = ~((block[name] >= low) & (block[name] <= high))
            if beyond.any() and (first is None or int(beyond.argmax()) < first[0]):
                first = int(beyond.argmax()), name
        if first is None:
            return None
        index, name = first
        value, (low, high) = float(block[name][index]), self._ranges[name]
        unit = next(channel.unit for channel in block.channels if channel.name == name)
        return MeasurementError(
            "limit-exceeded",
            f"{name} = {value:.6g} {unit} at {(block.start + index) / block.rate_hz:.4f} s is outside of its limits "
            f"{low:g} … {high:g} {unit}",
            "reduce the amplitude, or correct measure.limits",
            channel=name,
            value=value,
            low=low,
            high=high,
            sample=block.start + index,
        )


class LogTable:
    """Appends Blocks to a new CSV file with a time column.

    Raises
    ------
    OutputError
        If the disk reports an error.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with writing(path):
            self._file = path.open("x", encoding="utf-8")
        self._empty = True

    def append(self, block: Block) -> None:
        """Write the samples of a Block."""
        text = io.StringIO()
        if self._empty:
            units = [f"{c.name} [{c.unit}]" if c.unit else c.name for c in block.channels]
            text.write(",".join(["t [s]", *units]) + "\n")
            self._empty = False
        time_s = np.arange(block.start, block.start + len(block)) / block.rate_hz
        np.savetxt(text, np.vstack([time_s, block.data]).T, fmt="%.12g", delimiter=",")
        with writing(self._path):
            self._file.write(text.getvalue())
            self._file.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


def steady_part(played: NDArray[np.float64], period: NDArray[np.float64]) -> tuple[int, int]:
    """First sample of the longest span in which `played` repeats `period`, and the sample after it.

    Parameters
    ----------
    played
        The recorded excitation, shape (samples,), at least three periods.
    period
        One period of the design.

    Returns
    -------
    Both are 0 where the excitation was never played.

    Examples
    --------
    >>> period = np.array([1.0, -1.0, 0.5, -0.5])
    >>> steady_part(np.concatenate([[0.0, 0.1], np.tile(np.roll(period, 1), 5), [0.0]]), period)
    (2, 22)
    """
    window, count = period.size, played.size // period.size
    if count < 1:
        return 0, 0
    # The period in the middle is the one that is least likely to be in a ramp.
    middle = played[count // 2 * window :][:window]
    if middle.size < window:
        middle = played[:window]
    matched = np.fft.irfft(np.fft.rfft(middle) * np.conj(np.fft.rfft(period)), window)
    expected = np.roll(period, int(np.argmax(matched)))[np.arange(played.size) % window]
    same = np.abs(played - expected) <= TOLERANCE * np.max(np.abs(period))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]])))
    spans = edges.reshape(-1, 2)
    if not len(spans):
        return 0, 0
    first, last = spans[np.argmax(spans[:, 1] - spans[:, 0])]
    return int(first), int(last)
