"""Terminal output of a session: a live table, or plain lines if the output is not a terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from typing import Any

from rich.console import Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from livebode.cli.failures import failure_of
from livebode.cli.notices import NoticePrinter
from livebode.cli.terminal import console
from livebode.core import Event, LivebodeError
from livebode.runtime import AxisThread, Session, StoppedError, Subscriber

_COLUMNS = ("axis", "state", "rate", "samples", "responses", "lost", "latency", "behind", "last event")
_LOOKS_A_REDRAW = 5


class AxesTerminal:
    """Shows state and events of the axes of a session on standard error; with `quiet` only events and failures."""

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet
        self._console = console(stderr=True)
        self._live = Live(console=self._console, auto_refresh=False, transient=True)
        self._shown: dict[AxisThread, str] = {}
        self._looks = 0

    def print_event(self, name: str, event: Event) -> None:
        """Print an event of an axis."""
        self._print(f"livebode: {name}: {event.message}" if name else f"livebode: {event.message}")

    def subscriber(self, name: str) -> Subscriber:
        """Prints the events of an axis that a person must act on."""
        return NoticePrinter(
            lambda message: self._print(f"livebode: {name}: {message}" if name else f"livebode: {message}")
        )

    def run(self, session: Session) -> None:
        """Run the session and show its state."""
        table = self._console.is_terminal and not self._quiet
        if table:
            self._live.start()
        try:
            session.run(lambda: self._look(session, table))
            self._look(session, False)
        finally:
            self._live.stop()

    def leave(self, number: int, left: Mapping[str, Event]) -> None:
        """End the process immediately: recorded data are safe, and nothing else is waited for."""
        for name, event in left.items():
            self.print_event(name, event)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(128 + number)

    def _look(self, session: Session, table: bool) -> None:
        several = "" not in session.threads
        for thread in session.all:
            state = thread.status.state
            if state == self._shown.get(thread):
                continue
            self._shown[thread] = state
            if state == "refused" and several and not thread.ended_early:
                self._print(f"livebode: {thread.name}: {cause_of(thread.error)}")
            elif several and not self._quiet and not table:
                self._print(f"livebode: {thread.name}: {state}{_at(thread)}")
        self._looks += 1
        if table and self._looks % _LOOKS_A_REDRAW == 0:
            self._live.update(table_of(session.all, self._console.width), refresh=True)

    def _print(self, line: str) -> None:
        self._console.print(line, markup=False, soft_wrap=True)


def table_of(threads: list[AxisThread], width: int) -> Group:
    """One line for each axis; below them the events that are too long for it, in whole words.

    Parameters
    ----------
    threads
        The axes.
    width
        Columns of the terminal.
    """
    table = Table(box=None, pad_edge=False)
    for column in _COLUMNS:
        table.add_column(column, justify="right" if column in _COLUMNS[2:8] else "left", no_wrap=True)
    rows = {thread: _row(thread) for thread in threads}
    columns = [max(map(len, column)) for column in zip(_COLUMNS, *rows.values())]
    events = {thread: "" if thread.status.event is None else thread.status.event.message for thread in threads}
    room = max(width - sum(columns) - len(columns), len(_COLUMNS[-1]))  # a space between two columns
    below = {thread for thread, event in events.items() if len(event) > room}
    for thread, row in rows.items():
        table.add_row(*map(Text, row), Text("see below" if thread in below else events[thread]))
    # In a narrow terminal everything else may be shortened.
    table.columns[0].min_width = columns[0]
    lines = (Text(f"{rows[thread][0]}: {events[thread]}") for thread in threads if thread in below)
    return Group(table, *lines)


def cause_of(error: Exception | None) -> str:
    """The message of an error, or the traceback of an internal error."""
    if isinstance(error, (LivebodeError, StoppedError)) or error is None:
        return str(error)
    return failure_of(error).text


def _row(thread: AxisThread) -> tuple[str, ...]:
    status = thread.status
    health = status.health
    return (
        thread.name or "axis",
        status.state,
        "" if status.rate_hz is None else f"{status.rate_hz:g} Hz",
        str(status.samples),
        str(status.responses),
        "" if health is None else str(health.lost),
        "" if status.latency_s is None else f"{1e3 * status.latency_s:.1f} ms",
        "" if health is None else f"{health.waiting_s:.1f} s",
    )


def _at(thread: AxisThread) -> str:
    status = thread.status
    return f" in {status.directory}" if status.state == "tracking" else ""


def plain(session: Session) -> dict[str, Any]:
    """The summary of each axis, or its error."""
    return {thread.name: _plain(thread) for thread in session.all}


def _plain(thread: AxisThread) -> dict[str, Any]:
    if thread.outcome is None:
        return {"error": _error(thread.error)}
    return {"directory": str(thread.outcome.directory)} | thread.outcome.summary


def _error(error: Exception | None) -> dict[str, Any]:
    if isinstance(error, StoppedError) or error is None:
        return {"code": "stopped", "place": "", "message": str(error or "stopped"), "remedy": "", "facts": {}}
    return failure_of(error).error
