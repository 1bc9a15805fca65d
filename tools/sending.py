"""A sender in a thread of its own, at a steady rate."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def sending(send: Callable[[int], object], period_s: float) -> Iterator[None]:
    """Call `send` with 0, 1, … in another thread, once in each period of real time."""
    ended = threading.Event()

    def work() -> None:
        begun, number = time.monotonic(), 0
        while not ended.wait(max(0.0, begun + number * period_s - time.monotonic())):
            send(number)
            number += 1

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
