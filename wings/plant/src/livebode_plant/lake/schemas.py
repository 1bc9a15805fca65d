"""The columns of the tables of a lake.

A result of an archive belongs to a recording; one of a fleet to an axis, and to a run of it in a log. `logged` is when
the log of the fleet received the samples that completed the result, `day` its date in UTC, by which a table is divided.
Lists have the item name of Delta, "element".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import pyarrow as pa

from livebode.core import LEVELS
from livebode.records import PARAMETER_SCHEMA
from livebode_plant.lake.wide_matrices import covariance_schema, entry_schema
from livebode_plant.lake.wide_responses import wide_schema

TIME: Final = pa.timestamp("us", tz="UTC")
MACHINE: Final = [(level, pa.string()) for level in LEVELS]


def list_of(kind: pa.DataType) -> pa.DataType:
    """A list of any length."""
    return pa.list_(pa.field("element", kind))


def in_delta(kind: pa.DataType) -> pa.DataType:
    """The type in Delta, whose lists have any length."""
    return list_of(kind.value_type) if pa.types.is_fixed_size_list(kind) else kind


_KEY: Final = [("content", pa.string()), ("recipe", pa.string())]
"""Key of a result of an archive: SHA-256 of the bytes of the recording, and id of the settings."""
_RUN: Final = [("day", pa.date32()), *MACHINE, ("log", pa.string()), ("run", pa.int64()), ("recipe", pa.string())]
"""Key of a result of a fleet: an axis, and a run of it in a log."""
_WIDE: Final = [(field.name, in_delta(field.type)) for field in wide_schema(1)]
_WEIGHT: Final = ("weight_re", "weight_im")
_GRID: Final = (
    ("rate_hz", pa.float64()),
    ("window", pa.int64()),
    ("quantity", pa.string()),
    ("unit", pa.string()),
    ("frequencies_hz", list_of(pa.float64())),
)
_EVENT: Final = (
    ("kind", pa.string()),
    ("sample", pa.int64()),
    ("time_s", pa.float64()),
    ("message", pa.string()),
    ("details", pa.string()),
)
_ESTIMATE: Final = (
    ("model", pa.string()),
    ("name", pa.string()),
    ("unit", pa.string()),
    ("value", pa.float64()),
    ("bound_95", pa.float64()),
    ("low", pa.float64()),
    ("high", pa.float64()),
)

RUNS = pa.schema(
    [
        *_KEY,
        *MACHINE,
        ("url", pa.string()),
        ("recorded_from", TIME),
        ("recorded_to", TIME),
        ("clock", pa.string()),
        ("duration_s", pa.float64()),
        *_GRID,
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
        *_ESTIMATE,
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
"""Columns of covariance.parquet of a matrix run, in wide form."""

PARAMETERS = pa.schema([*_KEY, *((field.name, field.type) for field in pa.schema(PARAMETER_SCHEMA))])
"""Columns of parameters.parquet of a run."""

EVENTS = pa.schema([*_KEY, *_EVENT])
"""Columns of events.jsonl of a run; the details are JSON."""

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

FLEET_RUNS = pa.schema(
    [*_RUN, ("logged", TIME), *_GRID, *((name, list_of(pa.int64())) for name in ("bins", "quiet_bins"))]
)
"""One row for each run of an axis, whose lists of responses have a value for each of frequencies_hz."""

FLEET_RESPONSES = pa.schema([*_RUN, ("number", pa.int64()), ("logged", TIME), *_WIDE])
"""One row for each response, in wide form; its number counts from the beginning of the run."""

FLEET_PARAMETERS = pa.schema([*_RUN, ("number", pa.int64()), ("logged", TIME), *pa.schema(PARAMETER_SCHEMA)])
"""One row for each parameter of a fitted response, which has this number."""

FLEET_EVENTS = pa.schema([*_RUN, ("logged", TIME), *_EVENT])
"""One row for each event of an axis; one of the log itself has no axis. The details are JSON."""

RESPONSE_MEANS = pa.schema(
    [*_RUN, ("logged_from", TIME), ("responses", pa.int64()), *(one for one in _WIDE if one[0] not in _WEIGHT)]
)
"""One row for each run and period: the mean of its responses."""

PARAMETER_MEANS = pa.schema([*_RUN, ("logged_from", TIME), *_ESTIMATE, ("fits", pa.int64())])
"""One row for each run, period and quantity, as in `quantities`."""

FLEET_SAMPLES = pa.schema(
    [
        *MACHINE,
        ("log", pa.string()),
        ("kind", pa.string()),
        ("logged", TIME),
        ("file", pa.string()),
        ("epoch", pa.string()),
        ("first_sample", pa.int64()),
        ("samples", pa.int64()),
        ("missing", pa.int64()),
    ]
)
"""One row for each file of samples around an alarm, with its path in the lake, and the sender's numbers; a row without
a file where the log had no samples any more, or a file of an earlier alarm has them."""


@dataclass(frozen=True)
class LakeTable:
    """The columns of a table, and those by which two rows are the same; none if each result has a file of its own.

    The rows of one that is divided by `days` come from a stream, and its commits contain the position there. What is in
    an `advisory` one can be found again, so that its damage stops nobody.
    """

    schema: pa.Schema
    key: tuple[str, ...] = ()
    days: bool = False
    advisory: bool = False

    @property
    def partitions(self) -> list[str] | None:
        """Columns by whose values its files are divided."""
        return ["day"] if self.days else None


FLEET_SCHEMAS: Mapping[str, pa.Schema] = {
    "fleet_runs": FLEET_RUNS,
    "fleet_responses": FLEET_RESPONSES,
    "fleet_parameters": FLEET_PARAMETERS,
    "fleet_events": FLEET_EVENTS,
    "fleet_responses_minute": RESPONSE_MEANS,
    "fleet_parameters_minute": PARAMETER_MEANS,
    "fleet_responses_hour": RESPONSE_MEANS,
    "fleet_parameters_hour": PARAMETER_MEANS,
}

TABLES: Mapping[str, LakeTable] = {
    "runs": LakeTable(RUNS, ("content", "recipe")),
    "files": LakeTable(FILES, ("url", "version"), advisory=True),
    "quantities": LakeTable(QUANTITIES, ("content", "recipe")),
    "responses": LakeTable(RESPONSES),
    "covariance": LakeTable(COVARIANCE),
    "parameters": LakeTable(PARAMETERS),
    "events": LakeTable(EVENTS),
    "quarantine": LakeTable(QUARANTINE, ("content", "recipe", "livebode")),
    "fleet_samples": LakeTable(FLEET_SAMPLES, ("log", *LEVELS, "kind", "logged"), advisory=True),
    **{name: LakeTable(schema, days=True) for name, schema in FLEET_SCHEMAS.items()},
}
