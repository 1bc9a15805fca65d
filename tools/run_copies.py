"""Copies of one recorded run as if the machine had been measured again: another day, other values, another baseline."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import Event
from livebode.records import RUN, read_summary
from livebode.records.segments.json_lines import to_line
from livebode.records.segments.manifest import NAME as MANIFEST
from livebode.records.summary_file import COPY, to_document
from livebode.tables import ParquetFile, ParquetWriter, Table
from tools.parquet_parts import manifest_of


def copy_run(
    run: Path,
    to: Path,
    *,
    begun: float | None = None,
    factors: Mapping[str, float] | None = None,
    alarm: str = "",
    changes: Mapping[str, Any] | None = None,
) -> Path:
    """Write a copy of the run of a recording; tables that do not change are the same files.

    Parameters
    ----------
    run, to
        The run, and the directory to create.
    begun
        Seconds since 1970 at second 0 of the run; None: it has no clock.
    factors
        Of fitted quantities, by name.
    alarm
        Message of an alarm at the end of the run; empty: no alarm.
    changes
        Further keys of run.json.
    """
    to.mkdir(parents=True)
    os.link(run / "responses.parquet", to / "responses.parquet")
    summary, _ = read_summary(run)
    if factors:
        _scaled(run / "parameters.parquet", to / "parameters.parquet", factors)
    else:
        os.link(run / "parameters.parquet", to / "parameters.parquet")
    (to / MANIFEST).write_bytes(listed := manifest_of(to))
    if begun is not None:
        summary["clock"] = [[0.0, begun]]
    events = []
    if alarm:
        events.append(asdict(Event("change", 1000, 1.0, alarm)))
    lines = b"".join(map(to_line, events))
    (to / "events.jsonl").write_bytes(lines)
    summary["size_bytes"] = {"events.jsonl": len(lines), MANIFEST: len(listed)}
    for name in (RUN, COPY):
        (to / name).write_bytes(to_document(summary | dict(changes or {})))
    return to


def _scaled(file: Path, to: Path, factors: Mapping[str, float]) -> None:
    table = ParquetFile(file.read_bytes()).table()
    factor = np.ones(len(table))
    for one, by in factors.items():
        factor[table.text("name").where(one)] = by
    columns = {name: table[name] * factor for name in ("value", "sigma")}
    scaled = tuple(columns.get(field.name, column) for field, column in zip(table.schema, table.columns))
    with to.open("wb") as out:
        writer = ParquetWriter(out, table.schema)
        writer.write(Table(table.schema, scaled))
        writer.close()
