"""Unwritten: what a run published since its last commit, as it is; the record's thread converts it to rows."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from livebode.core import Block, Event, Parameters
from livebode.dataclass import dataclass
from livebode.records import ColumnTable, Store, as_rows, result_rows


@dataclass(frozen=True)
class Unwritten:
    """Blocks, results and events since the last commit, each in its order."""

    blocks: list[Block] = field(default_factory=list)
    results: list[Any] = field(default_factory=list)
    parameters: list[Parameters] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)

    def write(self, store: Store, samples: ColumnTable | None) -> None:
        """Write them with the next commit of the store; `samples` is the table of the blocks."""
        if self.blocks and samples is not None:
            store.write("samples", as_rows(self.blocks, samples))
        joined = [type(self.results[0]).join(self.results)] if self.results else []
        for results in (*joined, *self.parameters):
            for table, rows in result_rows(results).items():
                store.write(table, rows)
        for event in self.events:
            store.write_event(event)
