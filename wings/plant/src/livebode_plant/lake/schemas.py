"""The tables of a lake: their columns, and by which two rows of one are the same.

A result of an archive belongs to a recording; one of a fleet to an axis, and to a run of it in a log. `logged` is when
the log of the fleet received the samples that completed the result, `day` its date in UTC, by which a table is divided.
Lists have the item name of Delta, "element".
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Final

import pyarrow as pa

from livebode.core import LEVELS
from livebode.dataclass import dataclass
from livebode.records import PARAMETER_SCHEMA
from livebode_plant.lake.wide_responses import covariance_schema, entry_schema, wide_schema

TIME: Final = pa.timestamp("us", tz="UTC")
MACHINE: Final = [(level, pa.string()) for level in LEVELS]


def list_of(kind: pa.DataType) -> pa.DataType:
    """A list of any length."""
    return pa.list_(pa.field("element", kind))


def _in_delta(schema: pa.Schema) -> list[tuple[str, pa.DataType]]:
    """Columns with the types of Delta, whose lists have any length."""
    return [
        (field.name, list_of(field.type.value_type) if pa.types.is_fixed_size_list(field.type) else field.type)
        for field in schema
    ]


_KEY: Final = [("content", pa.string()), ("recipe", pa.string())]
"""Key of a result of an archive: SHA-256 of the bytes of the recording, and id of the settings."""
_RUN: Final = [("day", pa.date32()), *MACHINE, ("log", pa.string()), ("run", pa.int64()), ("recipe", pa.string())]
"""Key of a result of a fleet: an axis, and a run of it in a log."""
_WIDE: Final = _in_delta(wide_schema(1))
_FITTED: Final = [(field.name, field.type) for field in pa.schema(PARAMETER_SCHEMA)]
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


@dataclass(frozen=True)
class LakeTable:
    """Columns of a table, and those by which two rows are the same; none if each result has a file of its own.

    The rows of one that is divided by `days` come from a stream, and its commits contain the position there. What is in
    an `advisory` one can be found again, so that its damage stops nobody.
    """

    columns: Iterable[tuple[str, pa.DataType]]
    key: tuple[str, ...] = ()
    days: bool = False
    advisory: bool = False

    @cached_property
    def schema(self) -> pa.Schema:
        """The columns as a schema of Arrow."""
        return pa.schema(list(self.columns))

    @property
    def partitions(self) -> list[str] | None:
        """Columns by whose values its files are divided."""
        return ["day"] if self.days else None


_RESPONSE_MEANS: Final = (
    *_RUN,
    ("logged_from", TIME),
    ("responses", pa.int64()),
    *(field for field in _WIDE if not field[0].startswith("weight")),
)
"""One row for each run and period: the mean of its responses."""
_PARAMETER_MEANS: Final = (*_RUN, ("logged_from", TIME), *_ESTIMATE, ("fits", pa.int64()))
"""One row for each run, period and quantity, as in `quantities`."""

TABLES: Final[Mapping[str, LakeTable]] = {
    # One row for each result, which is written last: a result without it does not count.
    "runs": LakeTable(
        (
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
        ),
        ("content", "recipe"),
    ),
    # One row for each place where a content was found; the version of a file changes with its content.
    "files": LakeTable(
        (
            ("url", pa.string()),
            ("size_bytes", pa.int64()),
            ("version", pa.string()),
            ("content", pa.string()),
            *MACHINE,
        ),
        ("url", "version"),
        advisory=True,
    ),
    # One row for each run and quantity: what a trend reads. The covariates are means over the run.
    "quantities": LakeTable(
        (
            *_KEY,
            *MACHINE,
            ("recorded_from", TIME),
            *_ESTIMATE,
            ("time_s", pa.float64()),
            ("fits", pa.int64()),
            ("covariates", pa.map_(pa.string(), pa.float64())),
        ),
        ("content", "recipe"),
    ),
    # One row for each response, in wide form; the lists have a value for each of the run's frequencies_hz. Of a matrix
    # of responses one row for each entry; output, input, condition and reason are null in all other rows.
    "responses": LakeTable((*_KEY, *_in_delta(entry_schema(1)))),
    # Columns of covariance.parquet of a matrix run, in wide form.
    "covariance": LakeTable((*_KEY, *_in_delta(covariance_schema(1)))),
    # Columns of parameters.parquet of a run.
    "parameters": LakeTable((*_KEY, *_FITTED)),
    # Columns of events.jsonl of a run; the details are JSON.
    "events": LakeTable((*_KEY, *_EVENT)),
    # One row for each recording that cannot be tracked and each version of livebode that tried.
    "quarantine": LakeTable(
        (*_KEY, ("url", pa.string()), *MACHINE, *((name, pa.string()) for name in ("code", "sentence", "livebode"))),
        ("content", "recipe", "livebode"),
    ),
    # One row for each file of samples around an alarm, with its path in the lake, and the sender's numbers; a row
    # without a file where the log had no samples any more, or a file of an earlier alarm has them.
    "fleet_samples": LakeTable(
        (
            *MACHINE,
            ("log", pa.string()),
            ("kind", pa.string()),
            ("logged", TIME),
            ("file", pa.string()),
            ("epoch", pa.string()),
            *((name, pa.int64()) for name in ("first_sample", "samples", "missing")),
        ),
        ("log", *LEVELS, "kind", "logged"),
        advisory=True,
    ),
    # One row for each run of an axis, whose lists of responses have a value for each of frequencies_hz.
    "fleet_runs": LakeTable(
        (*_RUN, ("logged", TIME), *_GRID, *((name, list_of(pa.int64())) for name in ("bins", "quiet_bins"))), days=True
    ),
    # One row for each response, in wide form; its number counts from the beginning of the run.
    "fleet_responses": LakeTable((*_RUN, ("number", pa.int64()), ("logged", TIME), *_WIDE), days=True),
    # One row for each parameter of a fitted response, which has this number.
    "fleet_parameters": LakeTable((*_RUN, ("number", pa.int64()), ("logged", TIME), *_FITTED), days=True),
    # One row for each event of an axis; one of the log itself has no axis. The details are JSON.
    "fleet_events": LakeTable((*_RUN, ("logged", TIME), *_EVENT), days=True),
    "fleet_responses_minute": LakeTable(_RESPONSE_MEANS, days=True),
    "fleet_parameters_minute": LakeTable(_PARAMETER_MEANS, days=True),
    "fleet_responses_hour": LakeTable(_RESPONSE_MEANS, days=True),
    "fleet_parameters_hour": LakeTable(_PARAMETER_MEANS, days=True),
}
