"""The columns of the tables of a lake.

A result belongs to a content (SHA-256 of the recording's bytes) and a recipe (id of the settings).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import pyarrow as pa

from livebode.core.machine_levels import LEVELS
from livebode.lake.columns import MACHINE, TIME, in_delta, list_of
from livebode.lake.fleet_schemas import FLEET_SAMPLES, FLEET_SCHEMAS
from livebode.records import parameter_table
from livebode.records.wide_matrices import covariance_schema, entry_schema

_KEY = [("content", pa.string()), ("recipe", pa.string())]

RUNS = pa.schema(
    [
        *_KEY,
        *MACHINE,
        ("url", pa.string()),
        ("recorded_from", TIME),
        ("recorded_to", TIME),
        ("clock", pa.string()),
        ("duration_s", pa.float64()),
        ("rate_hz", pa.float64()),
        ("window", pa.int64()),
        ("quantity", pa.string()),
        ("unit", pa.string()),
        ("frequencies_hz", list_of(pa.float64())),
        ("quiet_bins", list_of(pa.int64())),
        ("responses", pa.int64()),
        ("parameters", pa.int64()),
        ("events", pa.int64()),
        ("livebode", pa.string()),
        ("alarms", pa.int64()),
        ("baseline", pa.string()),
        ("summary", pa.string()),
    ]
)
"""One row for each result, which is written last: a result without it does not count."""

FILES = pa.schema(
    [("url", pa.string()), ("size_bytes", pa.int64()), ("version", pa.string()), ("content", pa.string()), *MACHINE]
)
"""One row for each place where a content was found; the version of a file changes with its content."""

QUANTITIES = pa.schema(
    [
        *_KEY,
        *MACHINE,
        ("recorded_from", TIME),
        ("model", pa.string()),
        ("name", pa.string()),
        ("unit", pa.string()),
        ("value", pa.float64()),
        ("bound_95", pa.float64()),
        ("low", pa.float64()),
        ("high", pa.float64()),
        ("time_s", pa.float64()),
        ("fits", pa.int64()),
        ("covariates", pa.map_(pa.string(), pa.float64())),
    ]
)
"""One row for each run and quantity: what a trend reads. The covariates are means over the run."""

RESPONSES = pa.schema([*_KEY, *((field.name, in_delta(field.type)) for field in entry_schema(1))])
"""One row for each response, in wide form; the lists have a value for each of the run's frequencies_hz.

Of a matrix of responses one row for each entry; output, input, condition and reason are null in all other rows."""

COVARIANCE = pa.schema([*_KEY, *((field.name, in_delta(field.type)) for field in covariance_schema(1))])
"""As covariance.parquet of a matrix run, in wide form."""

PARAMETERS = pa.schema([*_KEY, *((field.name, field.type) for field in pa.schema(parameter_table.SCHEMA))])
"""As parameters.parquet of a run."""

EVENTS = pa.schema(
    [
        *_KEY,
        ("kind", pa.string()),
        ("sample", pa.int64()),
        ("time_s", pa.float64()),
        ("message", pa.string()),
        ("details", pa.string()),
    ]
)
"""As events.jsonl of a run; the details are JSON."""

QUARANTINE = pa.schema(
    [
        *_KEY,
        ("url", pa.string()),
        *MACHINE,
        ("code", pa.string()),
        ("sentence", pa.string()),
        ("livebode", pa.string()),
    ]
)
"""One row for each recording that cannot be tracked and each version of livebode that tried."""


@dataclass(frozen=True)
class LakeTable:
    """The columns of a table, and those by which two rows are the same; none if each result has a file of its own.

    The rows of one that is divided by `days` come from a stream, and its commits contain the position there.
    """

    schema: pa.Schema
    key: tuple[str, ...] = ()
    days: bool = False

    @property
    def partitions(self) -> list[str] | None:
        """Columns by whose values its files are divided."""
        return ["day"] if self.days else None


TABLES: Mapping[str, LakeTable] = {
    "runs": LakeTable(RUNS, ("content", "recipe")),
    "files": LakeTable(FILES, ("url", "version")),
    "quantities": LakeTable(QUANTITIES, ("content", "recipe")),
    "responses": LakeTable(RESPONSES),
    "covariance": LakeTable(COVARIANCE),
    "parameters": LakeTable(PARAMETERS),
    "events": LakeTable(EVENTS),
    "quarantine": LakeTable(QUARANTINE, ("content", "recipe", "livebode")),
    "fleet_samples": LakeTable(FLEET_SAMPLES, ("log", *LEVELS, "kind", "logged")),
    **{name: LakeTable(schema, days=True) for name, schema in FLEET_SCHEMAS.items()},
}
