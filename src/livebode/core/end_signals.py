"""Signals that end a command in order: Ctrl-C, and SIGTERM of service managers and containers."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import FrameType

Handler = Callable[[int, FrameType | None], None]
ENDING = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def handled(handlers: Mapping[signal.Signals, Handler]) -> Iterator[Callable[[], None]]:
    """Within the block these handle the signals, also one that was ignored; main thread only.

    The value of the block restores what handled them before, as its end does.
    """
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    try:
        yield restore
    finally:
        restore()


@contextmanager
def calls_at_end(end: Callable[[], object]) -> Iterator[None]:
    """Within the block the first Ctrl-C or SIGTERM calls `end`; the second does what it did before the block."""

    def first(_number: int, _frame: FrameType | None) -> None:
        restore()
        end()

    with handled(dict.fromkeys(ENDING, first)) as restore:
        yield
