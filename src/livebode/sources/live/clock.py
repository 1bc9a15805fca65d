"""Compare the sender's clock with its sample numbers: detect a clock that was set, and a wrong rate."""

from __future__ import annotations

from collections import deque
from statistics import median
from typing import Any

from livebode.core import Stage, StatefulBase
from livebode.language import Message
from livebode.sources.live.source_events import SourceEvents

JUMP_S = 0.1
"""A clock that is off by this much for one interval between batches, and right in the next, was set."""
RATE_TOLERANCE = 0.02
"""Stamps jitter from batch to batch, so the median of the ratio must be off by this much."""
DRIFT_TOLERANCE = 1e-3
DRIFT_S_MIN = 10.0
_INTERVALS = 15
_INTERVALS_MIN = 4


class ClockMonitor(StatefulBase):
    """Compares stamps with sample numbers of batches in order. Sample numbers define time; stamps only check it.

    A single step in the stamps means that the clock was set (``clock-jump``). Successive intervals that disagree with
    the rate mean a wrong rate (``wrong-rate``): from 2 % immediately, from 0.1 % after ten seconds. An interval is
    judged when the next one is known.
    """

    _stage = Stage("clock-monitor", 1)

    def __init__(self, source_events: SourceEvents, rate_hz: float) -> None:
        self._events, self._rate_hz = source_events, rate_hz
        self._wrong = False
        self.restart()

    def restart(self) -> None:
        """Begin again: the sender restarted."""
        self._last: tuple[int, float] | None = None
        self._ratios: deque[float] = deque(maxlen=_INTERVALS)
        self._odd: tuple[float, int] | None = None
        self._drift_s = self._length_s = 0.0
        self.offset_s: float | None = None
        """The sender's clock at sample 0 of its numbering, from the newest stamp."""

    def take(self, sample: int, stamp_s: float, number: int) -> None:
        """Sample `sample` of the sender, number `number` of the Blocks, was taken at `stamp_s`."""
        self.offset_s = stamp_s - sample / self._rate_hz
        last, self._last = self._last, (sample, stamp_s)
        if last is None or sample <= last[0]:
            return
        length_s = (sample - last[0]) / self._rate_hz
        error_s = stamp_s - last[1] - length_s
        usual = median(self._ratios) if len(self._ratios) >= _INTERVALS_MIN else 1.0
        odd = abs(error_s - (usual - 1) * length_s) > JUMP_S
        self._ratios.append(1 + error_s / length_s)
        if odd:
            # Two wrong intervals in a row are not a jump of the clock but a different rate.
            self._odd = (error_s, number) if self._odd is None else None
            return
        if self._odd is not None and len(self._ratios) > _INTERVALS_MIN:
            self._jumped(*self._odd)
        self._odd = None
        self._drift_s += error_s
        self._length_s += length_s
        self._judge_rate(number)

    def _jumped(self, step_s: float, number: int) -> None:
        self._events.report(
            "clock-jump",
            Message("the sender's clock was set by {step_s:+.3f} s; time continues by sample numbers", step_s=step_s),
            sample=number,
            rate_hz=self._rate_hz,
        )

    def _judge_rate(self, number: int) -> None:
        if len(self._ratios) < _INTERVALS_MIN:
            return
        ratio = median(self._ratios)
        wrong = abs(ratio - 1) > RATE_TOLERANCE
        if not wrong and self._length_s > DRIFT_S_MIN and abs(self._drift_s) > DRIFT_TOLERANCE * self._length_s:
            ratio, wrong = 1 + self._drift_s / self._length_s, True
        if wrong and not self._wrong:
            measured_hz = self._rate_hz / ratio if ratio > 0 else None
            self._events.report(
                "wrong-rate",
                Message(
                    "the sampling rate is {measured_hz:.6g} Hz by the sender's clock, not {rate_hz:.6g} Hz; every "
                    "frequency is wrong by the same factor; correct the rate",
                    measured_hz=measured_hz,
                    rate_hz=self._rate_hz,
                )
                if measured_hz
                else Message("the sender's clock does not advance or runs backwards; its rate cannot be checked"),
                sample=number,
                rate_hz=self._rate_hz,
                measured_hz=measured_hz,
            )
        self._wrong = wrong

    def _state(self) -> dict[str, Any]:
        return {
            "rate_hz": self._rate_hz,
            "wrong": self._wrong,
            "last": self._last,
            "ratios": list(self._ratios),
            "odd": self._odd,
            "drift_s": self._drift_s,
            "length_s": self._length_s,
            "offset_s": self.offset_s,
        }

    def _load(self, state: dict[str, Any]) -> None:
        self._rate_hz, self._wrong = state["rate_hz"], state["wrong"]
        last, odd = state["last"], state["odd"]
        self._last = None if last is None else (last[0], last[1])
        self._odd = None if odd is None else (odd[0], odd[1])
        self._ratios = deque(state["ratios"], maxlen=_INTERVALS)
        self._drift_s, self._length_s, self.offset_s = state["drift_s"], state["length_s"], state["offset_s"]
