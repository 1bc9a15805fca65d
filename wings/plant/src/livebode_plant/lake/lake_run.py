"""LakeRun: one run of a lake, with its responses as a run directory gives them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from datetime import datetime
from functools import cached_property
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from livebode.core import Lines, MatrixResponses, PlantKinds, Responses
from livebode.dataclass import dataclass
from livebode.records import entry_missing, entry_named, entry_summary, is_matrix, kinds_in, lines_in, steady
from livebode_plant.lake.data_file import Key
from livebode_plant.lake.lake import Lake
from livebode_plant.lake.wide_responses import from_wide, matrices_from_wide

_ROWS = 1 << 14


@dataclass(frozen=True)
class LakeRun:
    """A result of a lake.

    Attributes
    ----------
    lake
        Where it is.
    row
        Its row of `runs`.
    selected
        Output and input of a view of one entry of a matrix run.

    Examples
    --------
    >>> [run.responses() for run in runs_of(Lake("lake"), pc.field("machine") == "press-4")]
    []
    """

    lake: Lake
    row: Mapping[str, Any]
    selected: tuple[str, str] | None = None

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The entries of run.json in a run directory that its responses depend on.

        `configuration` without recording and machine, `found`, `left_out_samples` if there is a transient, and `matrix`
        of a matrix run. Of a view of one entry, as those of an ordinary run.
        """
        found: dict[str, Any] = json.loads(self.row["summary"])
        return found if self.selected is None else entry_summary(found, *self.selected)

    @property
    def key(self) -> Key:
        """Content and recipe."""
        return Key(self.row["content"], self.row["recipe"])

    @property
    def place(self) -> str:
        """Where its recording was, and the begin of its content's SHA-256."""
        return f"{self.row['url']}#{self.row['content'][:16]}"

    @property
    def recorded_from(self) -> datetime | None:
        """Begin of the recording, in UTC; None if it is not known."""
        found: datetime | None = self.row["recorded_from"]
        return found

    @property
    def found(self) -> dict[str, Any]:
        """Rate, window, lines, quantity and unit."""
        return dict(self.summary["found"])

    @property
    def lines(self) -> Lines:
        """Lines of the measurement."""
        return lines_in(self.summary["found"])

    @property
    def kinds(self) -> PlantKinds:
        """Kinds of the plant's output and input."""
        return kinds_in(self.summary["found"])

    @property
    def is_matrix(self) -> bool:
        """Whether it has matrices of responses; a view of one entry has none."""
        return is_matrix(self.summary)

    def matrix(self) -> MatrixResponses:
        """All matrices of a matrix run, rounded to float32 when they were stored.

        Raises
        ------
        ArchiveError, RecordError
            If the tables cannot be read, or their rows are not from this run.
        """
        responses, covariance = (self.lake.rows_of(name, self.key) for name in ("responses", "covariance"))
        return matrices_from_wide(responses, covariance, self.summary)

    def entry(self, output: str, input: str) -> LakeRun:
        """The view of one entry of a matrix run as an ordinary run; RecordError if there is no such entry."""
        return replace(self, selected=entry_named(self.place, self.summary, f"{output}/{input}"))

    def responses(self) -> Responses:
        """All responses, rounded to float32 when they were stored.

        Raises
        ------
        ArchiveError, RecordError
            If the table cannot be read, or its rows are not from this run, or it is a matrix run.
        """
        return from_wide(self._rows(), self.summary["found"])

    def _rows(self) -> pa.Table:
        if self.is_matrix:
            raise entry_missing(self.place, self.summary)
        table = self.lake.rows_of("responses", self.key)
        if self.selected is None:
            return table
        output, input = self.selected
        return table.filter((pc.field("output") == output) & (pc.field("input") == input))

    def batches(self) -> Iterator[Responses]:
        """Responses of the run in parts of bounded size."""
        table = self._rows()
        for start in range(0, table.num_rows, _ROWS):
            yield from_wide(table.slice(start, _ROWS), self.summary["found"])

    def steady_batches(self) -> Iterator[Responses]:
        """Batches of a machine that was ready, without a transient at the start."""
        return (steady(part, self.summary) for part in self.batches())


def runs_of(lake: Lake, where: pc.Expression | None = None) -> list[LakeRun]:
    """The runs that count, in the order of their dates; those without a date come last.

    Parameters
    ----------
    lake
        The lake.
    where
        Of columns of `runs`, for example ``pc.field("machine") == "press-4"``.

    Raises
    ------
    ArchiveError
        If the lake cannot be read.
    """
    rows = lake.read("runs", where=where).sort_by([("recorded_from", "ascending"), ("content", "ascending")])
    return [LakeRun(lake, row) for row in rows.to_pylist()]
