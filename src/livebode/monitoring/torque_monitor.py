"""Samples in, Events out: compares friction and orders of an axis with those of a LearnedTorque."""

from __future__ import annotations

from typing import Any

from livebode.core import Block, Event, Stage, StatefulBase
from livebode.monitoring.learned_torque import LearnedTorque
from livebode.monitoring.stretches import SECTION_S, Sections
from livebode.monitoring.table_monitor import TableMonitor


class TorqueMonitor(StatefulBase):
    """Judges every section of 10 s with strokes.

    Delay: an Event is given with the second section after the one in which a sum reaches the threshold. The Events do
    not depend on how the samples are cut into Blocks.

    Parameters
    ----------
    learned
        Of the healthy axis.
    names
        Channels of input and output.
    rate_hz
        Of the samples.
    mean_s
        Mean time between false alarms of each of its tables, s.
    """

    _stage = Stage("torque-monitor", 1)

    def __init__(self, learned: LearnedTorque, names: tuple[str, str], rate_hz: float, mean_s: float) -> None:
        self._learned, self._names, self._rate_hz, self._mean_s = learned, names, rate_hz, mean_s
        self._sections = Sections(names, rate_hz)
        self.tables = {table.what: TableMonitor(table, mean_s, SECTION_S) for table in learned.tables}

    def process(self, block: Block) -> list[Event]:
        """Events of the sections that this Block completes; LivebodeError where a channel is missing."""
        events: list[Event] = []
        for section in self._sections.process(block):
            for rows, table in zip(self._learned.rows(section, self._rate_hz), self.tables.values()):
                events += table.process(rows)
        return events

    def finish(self) -> list[Event]:
        """A change that was found but not reported yet."""
        return [event for table in self.tables.values() for event in table.finish()]

    def summary(self) -> dict[str, Any]:
        """Entries of run.json by table: judged time, and the changes that would be found."""
        return {name: table.time.summary(SECTION_S) for name, table in self.tables.items()}

    @property
    def _identity(self) -> str:
        names = [name for table in self._learned.tables for name in table.names]
        return f"{self._names!r} {self._rate_hz!r} {self._mean_s!r} {names!r}"

    def _state(self) -> dict[str, Any]:
        return {"sections": self._sections} | self.tables

    def _load(self, state: dict[str, Any]) -> None:
        self._sections.restore(state["sections"])
        for name, table in self.tables.items():
            table.restore(state[name])
