"""Compare the rate at which samples arrive with the stated one, for senders without a clock."""

from __future__ import annotations

from collections import deque

from livebode.language import Message
from livebode.sources.live import SourceEvents

BLOCK_S = 2.0
BLOCKS = 6
TOLERANCE = 0.02
"""Arrivals jitter: of each 2 s only the least delay counts, and ten seconds apart 2 % are 0.2 s."""


class ArrivalRate:
    """Reports `wrong-rate` if samples arrive at another rate than the stated one for ten seconds.

    A sender that is too slow for its rate, or whose line is too slow, sends samples that are numbered without a gap,
    at other times than their numbers say.
    """

    def __init__(self, source_events: SourceEvents, rate_hz: float) -> None:
        self._events, self._rate_hz = source_events, rate_hz
        self._wrong = False
        self.restart()

    def restart(self) -> None:
        """Begin again: the sender restarted."""
        self._blocks: deque[tuple[float, float]] = deque(maxlen=BLOCKS)
        self._begin_s: float | None = None
        self._newest = -1
        self._least: tuple[float, float] = (0.0, 0.0)

    def add(self, number: int, time_s: float) -> None:
        """Sample `number` arrived at `time_s`."""
        if number < self._newest:
            self.restart()
        self._newest = number
        delay_s = time_s - number / self._rate_hz
        if self._begin_s is None:
            self._begin_s, self._least = time_s, (time_s, delay_s)
        elif time_s - self._begin_s >= BLOCK_S:
            self._blocks.append(self._least)
            self._begin_s, self._least = time_s, (time_s, delay_s)
            self._judge()
        elif delay_s < self._least[1]:
            self._least = time_s, delay_s

    def _judge(self) -> None:
        if len(self._blocks) < BLOCKS:
            return
        (first_s, before_s), (last_s, after_s) = self._blocks[0], self._blocks[-1]
        drift = (after_s - before_s) / (last_s - first_s)
        wrong = abs(drift) > TOLERANCE
        if wrong and not self._wrong:
            # A drift of 1 is a sender whose numbers stand.
            measured_hz = self._rate_hz * (1 - drift)
            self._events.report(
                "wrong-rate",
                Message(
                    "samples arrive at {measured_hz:.4g} Hz, not {rate_hz:.6g} Hz; every frequency is wrong by the "
                    "same factor; correct the rate, or let the sender send less in each sample",
                    measured_hz=measured_hz,
                    rate_hz=self._rate_hz,
                ),
            )
        self._wrong = wrong
