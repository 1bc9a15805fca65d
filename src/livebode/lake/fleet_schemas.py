"""The columns of the tables that `livebode fleet sink` writes: results of a fleet, and their means.

A result belongs to an axis and to a run of it in a log. `logged` is when the log of the fleet received the samples that
completed the result, `day` its date in UTC, by which a table is divided.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import pyarrow as pa

from livebode.lake.columns import MACHINE, TIME, in_delta, list_of
from livebode.records import parameter_table
from livebode.records.wide_responses import wide_schema

_RUN: Final = [("day", pa.date32()), *MACHINE, ("log", pa.string()), ("run", pa.int64()), ("recipe", pa.string())]
_WIDE: Final = [(field.name, in_delta(field.type)) for field in wide_schema(1)]
_WEIGHT: Final = ("weight_re", "weight_im")

FLEET_RUNS = pa.schema(
    [
        *_RUN,
        ("logged", TIME),
        ("rate_hz", pa.float64()),
        ("window", pa.int64()),
        ("quantity", pa.string()),
        ("unit", pa.string()),
        ("frequencies_hz", list_of(pa.float64())),
        ("bins", list_of(pa.int64())),
        ("quiet_bins", list_of(pa.int64())),
    ]
)
"""One row for each run of an axis, whose lists of responses have a value for each of frequencies_hz."""

FLEET_RESPONSES = pa.schema([*_RUN, ("number", pa.int64()), ("logged", TIME), *_WIDE])
"""One row for each response, in wide form; its number counts from the beginning of the run."""

FLEET_PARAMETERS = pa.schema([*_RUN, ("number", pa.int64()), ("logged", TIME), *pa.schema(parameter_table.SCHEMA)])
"""One row for each parameter of a fitted response, which has this number."""

FLEET_EVENTS = pa.schema(
    [
        *_RUN,
        ("logged", TIME),
        ("kind", pa.string()),
        ("sample", pa.int64()),
        ("time_s", pa.float64()),
        ("message", pa.string()),
        ("details", pa.string()),
    ]
)
"""One row for each event of an axis; one of the log itself has no axis. The details are JSON."""

RESPONSE_MEANS = pa.schema(
    [
        *_RUN,
        ("logged_from", TIME),
        ("responses", pa.int64()),
        *(one for one in _WIDE if one[0] not in _WEIGHT),
    ]
)
"""One row for each run and period: the mean of its responses."""

PARAMETER_MEANS = pa.schema(
    [
        *_RUN,
        ("logged_from", TIME),
        ("model", pa.string()),
        ("name", pa.string()),
        ("unit", pa.string()),
        ("value", pa.float64()),
        ("bound_95", pa.float64()),
        ("low", pa.float64()),
        ("high", pa.float64()),
        ("fits", pa.int64()),
    ]
)
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
