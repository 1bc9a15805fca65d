"""Ctrl-C and SIGTERM end a command in order, also in a process that ignored Ctrl-C; a second one ends it at once."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

from livebode.core import ENDING, calls_at_end


@pytest.fixture
def ignoring() -> Iterator[None]:
    """As a shell starts a process in the background."""
    before = {number: signal.signal(number, signal.SIG_IGN) for number in ENDING}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("ignoring")
@pytest.mark.parametrize("number", ENDING)
def test_the_first_signal_ends_in_order_and_the_second_does_what_it_did_before(number: signal.Signals) -> None:
    signal.signal(number, signal.default_int_handler)
    ended: list[int] = []
    with calls_at_end(lambda: ended.append(1)):
        signal.raise_signal(number)
        assert ended == [1]
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
    assert ended == [1]


@pytest.mark.usefixtures("ignoring")
def test_what_handled_the_signals_before_handles_them_afterwards() -> None:
    ended: list[int] = []
    with calls_at_end(lambda: ended.append(1)):
        signal.raise_signal(signal.SIGINT)
    assert ended == [1]
    assert [signal.getsignal(number) for number in ENDING] == [signal.SIG_IGN] * 2
