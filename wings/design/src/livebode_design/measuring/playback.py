"""Playback: a design is played on a controller, watched and recorded."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from livebode.core import LivebodeError, MeasurementError
from livebode.sources.live import LiveBlock, Player
from livebode_design.design import Design
from livebode_design.measuring.limit_watch import LimitWatch
from livebode_design.measuring.log_table import LogTable
from livebode_design.measuring.steady_part import steady_part

REST_S = 0.25
"""Recorded and watched before anything is played."""
ZERO_S = 0.05
"""The excitation has ended when it was zero for so long."""
LATE_S = 2.0
_LOOK_S = 0.05
_STEADY_SHARE = 0.9
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
        self._started_s = 0.0

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
                self._take(block, watch, table)
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

    def _take(self, block: LiveBlock, watch: LimitWatch, table: LogTable) -> None:
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
            self._player.start(self._design.waveform)
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
