"""A run read back: what its directory holds, as the nouns that were written."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from livebode.nouns import Event, InputError, Lines, Responses

_ROWS = 1 << 16  # of responses at once, times their lines: some 10 MB


@dataclass(frozen=True)
class Run:
    """The directory of a finished run.

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
        found = self.found
        return Lines(tuple(found["bins"]), found["window"], found["rate_hz"], tuple(found["quiet_bins"]))

    def responses(self) -> Responses:
        """All responses, as they were written."""
        return Responses.join(list(self.batches()))

    def batches(self) -> Iterator[Responses]:
        """All responses in order, in parts of bounded size."""
        lines, name = self.lines, self.path / "responses.parquet"
        try:
            with pq.ParquetFile(name) as file:
                rest = file.schema_arrow.empty_table()
                for batch in file.iter_batches(_ROWS):
                    table = pa.concat_tables([rest, pa.Table.from_batches([batch])])
                    whole = table.num_rows // len(lines) * len(lines)
                    rest = table.slice(whole)
                    if whole:
                        yield self._responses(table.slice(0, whole), lines)
        except (OSError, pa.ArrowException, KeyError) as error:
            raise InputError(f"{str(name)!r} cannot be read: {error}") from None
        if rest.num_rows:
            raise InputError(f"{str(name)!r} ends within a response; it is not the file that the run wrote")

    def events(self) -> list[Event]:
        """What is in events.jsonl."""
        name = self.path / "events.jsonl"
        try:
            return [Event(**json.loads(line)) for line in name.read_text("utf-8").splitlines()]
        except (OSError, ValueError, TypeError) as error:
            raise InputError(f"{str(name)!r} cannot be read: {error}") from None

    def _responses(self, table: pa.Table, lines: Lines) -> Responses:
        shape = table.num_rows // len(lines), len(lines)
        column = {name: table[name].to_numpy().reshape(shape) for name in table.column_names}
        value = np.empty(shape, dtype=np.complex128)
        value.real, value.imag = column["re"], column["im"]
        per_line = {name: column[name] for name in ("sigma", "coherence", "valid")}
        per_row = {name: column[name][:, 0] for name in ("dof", "first", "sample", "time_s", "schedule")}
        named = {"quantity": self.found["quantity"], "unit": self.found["unit"]}
        return Responses(lines=lines, value=value, **per_line, **per_row, **named)
