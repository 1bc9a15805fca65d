"""Signals: the answer to a request for raw signals of an axis, live or from its record."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np

from livebode.core import Block, Lines
from livebode.dashboard.board import Board
from livebode.dashboard.queries import SignalsRequest
from livebode.dashboard.signal_answer import Picture, answer, why_not
from livebode.dashboard.signal_tap import SignalTap, span_samples
from livebode.dashboard.state import State
from livebode.records import RunRecord, channels_of
from livebode.tables import Table


def recorded_answer(directory: Path, entry: str | None, at_s: float, picture: Picture) -> bytes:
    """The answer with the recorded samples around a time, which is in the middle of them."""
    run = RunRecord.open(directory, entry=entry)
    block = recorded_block(run, at_s)
    if block is not None:
        return answer(block, run.lines, picture)
    return why_not("unrecorded" if next(run.tables("samples"), None) is None else "outside")


def recorded_block(run: RunRecord, at_s: float) -> Block | None:
    """The recorded samples around a time, NaN where samples are missing; None if there are none."""
    lines = run.lines
    half_s = span_samples(lines.rate_hz, lines.window, 1) / lines.rate_hz / 2
    tables = []
    for table in run.tables("samples", span_s=(at_s - half_s, at_s + half_s)):
        time_s = table["time_s"]
        within = np.flatnonzero((time_s >= at_s - half_s) & (time_s < at_s + half_s))
        if within.size:
            tables.append(table.slice(int(within[0]), int(within[-1]) + 1 - int(within[0])))
    if not tables:
        return None
    table = Table.join(tables)
    sample, time_s, *values = (table[name] for name in table.column_names)
    start = int(sample[0])
    channels = channels_of(table.schema)
    data = np.full((len(channels), int(sample[-1]) + 1 - start), np.nan)
    data[:, sample - start] = values
    return Block(data, channels, lines.rate_hz, start, float(time_s[0]) - start / lines.rate_hz)


async def signals(board: Board, state: State, asked: SignalsRequest) -> bytes:
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
