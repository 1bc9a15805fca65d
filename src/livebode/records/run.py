"""A run read back: what its directory holds, as the nouns that were written."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from livebode.arrow import to_numpy
from livebode.nouns import PER_LINE, PER_RESPONSE, Event, InputError, Lines, Responses
from livebode.records.response_table import ADDED, SCHEMA
from livebode.records.segments import json_lines, reading
from livebode.records.segments.manifest import Manifest, Segment

_ROWS = 1 << 16  # of responses at once, times their lines: some 10 MB


def lines_in(found: Mapping[str, Any]) -> Lines:
    """The lines that run.json names under `found`."""
    return Lines(tuple(found["bins"]), found["window"], found["rate_hz"], tuple(found["quiet_bins"]))


@dataclass(frozen=True)
class Run:
    """The directory of a run: finished, stopped, killed, or still being written.

    What is read is what was committed when it is read; a run that is being written has more a moment later.

    Attributes
    ----------
    path
        Where it stands.
    summary
        run.json as it is.
    """

    path: Path
    summary: dict[str, Any]

    @classmethod
    def open(cls, path: Path) -> Run:
        """The run in this directory.

        Raises
        ------
        InputError
            If no run left it, or run.json or the responses cannot be read.
        """
        try:
            summary = json.loads((path / "run.json").read_text("utf-8"))
        except (FileNotFoundError, NotADirectoryError):
            raise InputError(f"{str(path)!r} is not the directory of a run: it has no run.json") from None
        except (OSError, ValueError) as error:
            raise InputError(f"{str(path / 'run.json')!r} cannot be read: {error}") from None
        if not isinstance(summary, dict) or "bins" not in summary.get("found", {}):
            raise InputError(f"{str(path / 'run.json')!r} does not name its lines; run the recording again")
        return cls(path, summary)

    @property
    def found(self) -> dict[str, Any]:
        """What run.json says of rate, window, lines, quantity and unit."""
        return dict(self.summary["found"])

    @property
    def lines(self) -> Lines:
        """Where it was measured."""
        return lines_in(self.found)

    @property
    def finished(self) -> bool:
        """Whether its source came to its end and everything is written."""
        return bool(self.summary.get("record", {}).get("finished", True))

    def responses(self) -> Responses:
        """All responses, as they were written; none before the first."""
        return Responses.join(list(self.batches()) or [self._responses(SCHEMA.empty_table(), self.lines)])

    def batches(self, size_bytes_max: int | None = None) -> Iterator[Responses]:
        """All responses in order, in parts of bounded size; or the newest, from files of no more than this."""
        return self._in_parts(self.tables("responses", size_bytes_max))

    def between(self, from_s: float, to_s: float) -> Iterator[Responses]:
        """Those that speak for a span of time, ends included, in parts; segments outside of it are not read."""
        for part in self._in_parts(self.tables("responses", span_s=(from_s, to_s))):
            if len(within := part.between(from_s, to_s)):
                yield within

    def _in_parts(self, tables: Iterator[pa.Table]) -> Iterator[Responses]:
        lines = self.lines
        rest: pa.Table | None = None
        for part in tables:
            if part.schema.names not in (SCHEMA.names, [name for name in SCHEMA.names if name not in ADDED]):
                raise InputError(f"the responses in {str(self.path)!r} have other columns than a run writes")
            for start in range(0, part.num_rows, _ROWS):
                piece = part.slice(start, _ROWS)
                table = piece if rest is None else pa.concat_tables([rest, piece])
                whole = table.num_rows // len(lines) * len(lines)
                rest = table.slice(whole)
                if whole:
                    yield self._responses(table.slice(0, whole), lines)
        if rest is not None and rest.num_rows:
            raise InputError(f"the record in {str(self.path)!r} ends within a response; it is not what the run wrote")

    def tables(
        self, name: str, size_bytes_max: int | None = None, span_s: tuple[float, float] | None = None
    ) -> Iterator[pa.Table]:
        """The rows of "responses", "parameters" or "samples" in order, part by part; none where it was not recorded.

        With `span_s`, segments that lie wholly outside of that time are left out.

        Raises
        ------
        InputError
            While iterating, if a part cannot be read or is not what was written.
        """
        file = self.path / name
        try:
            if reading.in_segments(self.path):
                yield from reading.tables(self.path, name, size_bytes_max, span_s, finished=self.finished)
            elif (file := file.with_suffix(".parquet")).exists() or name == "responses":
                # Else what was read ahead of a long run stays in memory until its end.
                with pq.ParquetFile(file, pre_buffer=False) as parquet:
                    yield from (pa.Table.from_batches([batch]) for batch in parquet.iter_batches(_ROWS))
        except (OSError, pa.ArrowException, KeyError, TypeError) as error:
            raise InputError(f"{str(file)!r} cannot be read: {error}") from None

    @property
    def segments(self) -> list[Segment]:
        """The closed segments that stand, by age; none where the run is not kept in segments."""
        return Manifest.read(self.path).segments if reading.in_segments(self.path) else []

    def parts(self, name: str) -> tuple[list[Path], list[pa.Table]]:
        """The Parquet files of a table, and the rows that are in none yet."""
        try:
            if not reading.in_segments(self.path):
                file = self.path / f"{name}.parquet"
                return ([file] if file.exists() else []), []
            segments, rows = reading.parts(self.path, name, finished=self.finished)
        except (OSError, pa.ArrowException) as error:
            raise InputError(f"the {name} of {str(self.path)!r} cannot be read: {error}") from None
        return [self.path / segment.name for segment in segments], rows

    def events(self) -> list[Event]:
        """What is in events.jsonl; of a run that is not finished, up to the first line that is not whole."""
        return list(self.each_event())

    def each_event(self) -> Iterator[Event]:
        """The same one by one, however many they are."""
        name = self.path / "events.jsonl"
        try:
            with name.open("rb") as file:
                for line in file:
                    try:
                        event = json_lines.from_line(line)
                        if not line.endswith(b"\n"):
                            raise ValueError("its last line is not whole")
                    except ValueError:
                        if self.finished:
                            raise
                        return
                    yield Event(**event)
        except (OSError, ValueError, TypeError) as error:
            raise InputError(f"{str(name)!r} cannot be read: {error}") from None

    def _responses(self, table: pa.Table, lines: Lines) -> Responses:
        shape = table.num_rows // len(lines), len(lines)
        column: dict[str, Any] = {
            name: to_numpy(table[name].combine_chunks()).reshape(shape) for name in table.column_names
        }
        value = np.empty(shape, dtype=np.complex128)
        value.real, value.imag = column["re"], column["im"]
        per_line = {name: column[name] for name in PER_LINE if name in column}
        if ADDED[0] in column:
            per_line["weight"] = np.empty(shape, dtype=np.complex128)
            per_line["weight"].real, per_line["weight"].imag = column["weight_re"], column["weight_im"]
        per_row = {name: column[name][:, 0] for name in PER_RESPONSE}
        named = {"quantity": self.found["quantity"], "unit": self.found["unit"]}
        return Responses(lines=lines, value=value, **per_line, **per_row, **named)
