"""Means of a stream of results: those of `mean_response`, each once, wherever a sink was killed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import pyarrow as pa
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode import example_responses
from livebode.core import Responses
from livebode.fitting import mean_response
from livebode.records import response_table
from livebode_plant.fleet.sink_rows import RunKey, RunPart, SinkRows
from livebode_plant.fleet.sink_tables import ClosedPeriods, MeanTier
from livebode_plant.lake.wide_responses import from_wide, to_wide

EVERY_S, PERIOD_S = 14.0, 60
KEYS = RunKey("ulm._.press.x", 1, "r"), RunKey("ulm._.press.y", 2, "r")
MESSAGES = 24


@cache
def stored() -> tuple[Responses, dict[str, Any]]:
    """Responses as they are stored, rounded to float32, and their grid."""
    lines = (responses := example_responses()).lines
    grid: dict[str, Any] = {"bins": lines.bins, "quiet_bins": lines.quiet, "window": lines.window}
    grid |= {"rate_hz": lines.rate_hz, "quantity": responses.quantity, "unit": responses.unit}
    return from_wide(to_wide(responses), grid), grid


def message(number: int, lags_s: tuple[float, ...] = (0.3, 0.8)) -> SinkRows:
    """A message with two responses and fits of each axis, which the log received so long before it."""
    responses, grid = stored()
    stored_s = 1.7e9 + EVERY_S * number
    own = responses[2 * number % 38 :][:2]
    fits = {
        "sample": own.sample, "time_s": own.time_s, "schedule": own.schedule, "model": ["m"] * 2, "name": ["k"] * 2,
        "value": [float(number), np.nan], "sigma": [0.1, np.nan], "unit": ["N/m"] * 2, "status": ["ok", "weak"],
        "epsilon": [0.0, 0.0],
    }  # fmt: skip
    fitted = pa.table(fits, schema=pa.schema(response_table.PARAMETER_SCHEMA))
    logged = [np.full(2, round(1e6 * (stored_s - lag)), np.int64) for lag in lags_s]
    return SinkRows(
        number,
        stored_s,
        {},
        [RunPart(key, to_wide(own), at) for key, at in zip(KEYS, logged)],
        [RunPart(key, fitted, at) for key, at in zip(KEYS, logged)],
        {(key.axis, key.run): grid for key in KEYS},
    )


def means(messages: Sequence[SinkRows], kills: Sequence[int] = ()) -> list[ClosedPeriods]:
    """What a sink commits that is killed after these messages, and reads again from where its lake says."""
    found: list[ClosedPeriods] = []
    at, kills = 0, sorted(kills)
    while True:
        tier = MeanTier("minute", PERIOD_S, found[-1].through if found else 0)
        first = found[-1].first if found else messages[0].number
        stop = next((kill for kill in kills if kill > at), len(messages))
        taken = (tier.process(one, "log") for one in messages[first - messages[0].number : stop])
        found += [closed for closed in taken if closed is not None]
        if stop == len(messages):
            return found
        at = stop


@settings(max_examples=4, deadline=None)
@given(st.lists(st.integers(1, MESSAGES - 1), max_size=6), st.sampled_from([0.1, 4.0, 9.0, 100.0]))
def test_means_are_the_same_wherever_a_sink_was_killed(kills: list[int], lag_s: float) -> None:
    messages = [message(number, (0.3, lag_s)) for number in range(1, MESSAGES + 1)]
    for name in ("fleet_responses_minute", "fleet_parameters_minute"):
        once, again = (pa.concat_tables(one.tables[name] for one in means(messages, at)) for at in ((), kills))
        assert again.equals(once, check_metadata=False) or _text(again) == _text(once)
    counts = once["fits"].to_pylist()
    assert sum(counts) <= 2 * MESSAGES


def _text(table: pa.Table) -> str:
    """NaN equals NaN here."""
    return str(table.to_pylist())


def test_the_mean_of_a_minute_is_that_of_its_responses() -> None:
    messages = [message(number) for number in range(1, MESSAGES + 1)]
    _, grid = stored()
    (closed,) = [one for one in means(messages) if one.through == 1.7e9 // PERIOD_S + 2]
    begin_us = closed.through * PERIOD_S * 10**6
    table = closed.tables["fleet_responses_minute"]
    assert table["axis"].to_pylist() == ["x", "y"]
    for row, key in enumerate(KEYS):
        parts = [
            from_wide(part.rows, grid)
            for one in messages
            for part in one.responses
            if part.key == key and begin_us <= part.logged_us[0] < begin_us + PERIOD_S * 10**6
        ]
        expected = mean_response(Responses.join(parts))
        assert table["responses"][row].as_py() == sum(map(len, parts))
        for name in ("re", "im", "sigma"):
            values = {"re": expected.value.real, "im": expected.value.imag, "sigma": expected.sigma}[name][0]
            np.testing.assert_array_equal(np.float32(values), np.float32(table[name][row].as_py()))
        assert table["dof"][row].as_py() == np.float32(expected.dof[0])
    fitted = closed.tables["fleet_parameters_minute"].to_pylist()
    assert {(one["model"], one["name"], one["unit"]) for one in fitted} == {("m", "k", "N/m")}
    assert all(one["fits"] == table["responses"][0].as_py() // 2 for one in fitted)
    assert np.allclose([one["bound_95"] for one in fitted], 0.196, atol=1e-4)


def test_a_minute_without_a_valid_response_is_a_row_without_values() -> None:
    messages = [message(number) for number in range(1, 12)]
    none = pa.array([[False] * len(stored()[0].lines)] * 2)
    for one in messages:
        for i, (key, rows, at) in enumerate(one.responses):
            column = none.cast(rows.schema.field("valid").type)
            rows = rows.set_column(rows.schema.get_field_index("valid"), "valid", column)
            one.responses[i] = RunPart(key, rows, at)  # type: ignore[index]
    table = means(messages)[-1].tables["fleet_responses_minute"]
    assert table.num_rows == 2
    assert not any(map(any, table["valid"].to_pylist()))
    assert np.isnan(table["re"].to_pylist()).all()
