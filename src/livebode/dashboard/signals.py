"""Signals: the answer to a request for raw signals of an axis, live or from its record."""

from __future__ import annotations

import asyncio

from livebode.core import Lines
from livebode.dashboard.board import Board
from livebode.dashboard.queries import SignalsAsked
from livebode.dashboard.recorded_signals import recorded_answer
from livebode.dashboard.signal_answer import Picture, answer, why_not
from livebode.dashboard.signal_tap import SignalTap
from livebode.dashboard.state import State


async def signals(board: Board, state: State, asked: SignalsAsked) -> bytes:
    """The signals of an axis whose run has begun.

    A request for the newest signals of a live run makes its tap retain samples from now on.
    """
    assert state.directory is not None
    assert state.quantities is not None
    if state.live and asked.at_s is None:
        assert state.hub is not None
        tap = state.hub.signals
        tap.watch()
        # Not in the thread that reads records: a long read would stop the picture of every page.
        return await asyncio.to_thread(_newest, tap, state.quantities.lines, asked.picture)
    if not state.readable:
        return why_not("unrecorded")
    at_s = state.last_s if asked.at_s is None else asked.at_s
    return await board.elsewhere(recorded_answer, state.directory, state.entry, at_s, asked.picture)


def _newest(tap: SignalTap, lines: Lines, picture: Picture) -> bytes:
    block = tap.newest()
    if block is None:
        return why_not("spectra" if tap.spectra else "collecting")
    return answer(block, lines, picture)
