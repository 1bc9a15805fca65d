"""Unwritten: what a run published since its last commit, as it is; the record's thread converts it to rows."""

from __future__ import annotations

from dataclasses import dataclass, field

from livebode.core import Block, Event, MatrixResponses, Parameters, Responses
from livebode.records import as_batch, covariance_rows, matrix_rows, parameter_rows
from livebode.records.sample_table import as_rows
from livebode.records.segments.store import Store
from livebode.records.table_file import ColumnTable


@dataclass(frozen=True)
class Unwritten:
    """Blocks, results and events since the last commit, each in its order."""

    blocks: list[Block] = field(default_factory=list)
    responses: list[Responses] = field(default_factory=list)
    matrices: list[MatrixResponses] = field(default_factory=list)
    parameters: list[Parameters] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)

    def write(self, store: Store, samples: ColumnTable | None) -> None:
        """Write them with the next commit of the store; `samples` is the table of the blocks."""
        if self.blocks and samples is not None:
            store.write("samples", as_rows(self.blocks, samples))
        if self.responses:
            store.write("responses", as_batch(Responses.join(self.responses)))
        if self.matrices:
            matrices = MatrixResponses.join(self.matrices)
            store.write("responses", matrix_rows(matrices))
            store.write("covariance", covariance_rows(matrices))
        for parameters in self.parameters:
            store.write("parameters", parameter_rows(parameters))
        for event in self.events:
            store.write_event(event)
