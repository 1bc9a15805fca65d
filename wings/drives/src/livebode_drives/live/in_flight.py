"""InFlight: messages of a broker that are not acknowledged yet, and when to record at once so that it sends more."""

from __future__ import annotations

from collections import deque
from math import inf

RECEIVE_MAX = 4096
"""Messages that a broker may send without an acknowledgement: several times those of the interval of commits."""
ANSWER_S = 0.02
"""A broker that waited for acknowledgements sends the next message within this time after them."""
OVERDUE_S = 0.01
"""A message may be later by this than twice the time of its samples, before the broker seems to wait."""
PATIENCE_S_MAX = 0.5


class InFlight:
    """Messages of one connection in their order, each with the delivery that settles it.

    Many brokers send 10 to 32 messages, whatever a client asks for, and then wait for acknowledgements. That shows as
    a next message that is overdue, and comes as soon as others are acknowledged: their number is remembered.
    """

    def __init__(self) -> None:
        self._messages: deque[tuple[int, int]] = deque()
        self._arrived_s = self._patience_s = 0.0
        self._usual_s = 0.0
        self._most: float = inf  # that the broker sends
        self._asked: tuple[int, float] | None = None  # how many there were, and when the first was acknowledged

    def __len__(self) -> int:
        return len(self._messages)

    def add(self, number: int, delivery: int, now_s: float, seconds: float) -> None:
        """A message arrived, with samples of so many seconds."""
        if self._asked is not None:
            count, acknowledged_s = self._asked
            if 0 <= now_s - acknowledged_s <= ANSWER_S:
                self._most, self._patience_s, self._asked = count, 0.0, None
            else:
                self._did_not_wait()
        self._messages.append((number, delivery))
        self._arrived_s, self._usual_s = now_s, seconds

    def silent_s(self, now_s: float) -> float:
        """Seconds since the newest message."""
        return now_s - self._arrived_s

    def settled(self, delivery: int, now_s: float) -> list[int]:
        """Messages to acknowledge, since the deliveries up to this one are settled."""
        found = []
        while self._messages and self._messages[0][1] <= delivery:
            found.append(self._messages.popleft()[0])
        if found and self._asked is not None and self._asked[1] == inf:
            self._asked = self._asked[0], now_s
        return found

    def waits(self, now_s: float) -> bool:
        """Whether the broker seems to wait for acknowledgements."""
        if self._asked is not None:
            if now_s - self._asked[1] <= ANSWER_S:
                return False
            self._did_not_wait()
        overdue_s = self._arrived_s + 2 * self._usual_s + OVERDUE_S + self._patience_s
        if self._messages and (len(self._messages) >= self._most or now_s > overdue_s):
            self._asked = len(self._messages), inf
            return True
        return False

    def _did_not_wait(self) -> None:
        """The sender is silent, or sends many at once."""
        self._most, self._asked = inf, None
        self._patience_s = min(PATIENCE_S_MAX, 2 * self._patience_s + OVERDUE_S)
