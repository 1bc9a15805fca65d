"""Tiers of the lake: what is older than it is retained is deleted, the means of it remain, and it is read once."""

from __future__ import annotations

from pathlib import Path

from bench.fleet_sink import BEGIN_S, messages, tracked
from livebode_plant.fleet.fleet_settings import SinkSection
from livebode_plant.fleet.sink_tables import SinkTables
from livebode_plant.lake import Lake

SECONDS = 150.0


def test_responses_are_deleted_after_their_time_and_their_means_remain(tmp_path: Path) -> None:
    everything = list(messages(tracked(), 2, SECONDS))
    settings = SinkSection(lake=str(tmp_path), full_rate_days=10_000.0, minute_days=10_000.0)
    tables = SinkTables(settings)
    assert tables.resume(BEGIN_S) == 1
    for first in range(0, len(everything), 25):
        tables.process(everything[first : first + 25])
        tables.commit()
    lake = Lake(str(tmp_path))
    assert lake.read("fleet_responses", ["run"]).num_rows == 2 * 2 * SECONDS
    # The first minute is 40 s long; a message at its end was logged before it. The last one has not ended.
    means, fitted = lake.read("fleet_responses_minute"), lake.read("fleet_parameters_minute")
    assert sorted(means["responses"].to_pylist()) == [84, 84, 120, 120]
    assert sorted(fitted["fits"].to_pylist()) == [84] * 4 + [120] * 4
    files = len(list((tmp_path / "tables" / "fleet_responses").glob("*.parquet")))
    older = SinkTables(settings.model_copy(update={"full_rate_days": 7.0}))
    assert older.resume(BEGIN_S) == 1  # the hour is open
    older.process(everything)
    older.commit()
    assert lake.read("fleet_responses").num_rows == lake.read("fleet_parameters").num_rows == 0
    again = lake.read("fleet_responses_minute")  # in another order, since the files of the day were joined
    assert sorted(map(str, again.to_pylist())) == sorted(map(str, means.to_pylist()))
    assert lake.read("fleet_runs").num_rows == 2
    assert len(list((tmp_path / "tables" / "fleet_responses").glob("*.parquet"))) >= files  # for readers
