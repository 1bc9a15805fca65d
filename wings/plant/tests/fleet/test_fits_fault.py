"""Takeovers of axes with fits, margins and monitoring on a real log: parameters and alarms are those of one owner."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from livebode.configuration import Axis
from livebode.core import FleetError
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.reader import stored_messages
from livebode_plant.fleet.replay import ReplayedAxis, replayed, write_replayed
from livebode_plant.fleet.result_message import ResultMessage
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.subjects import RESULT_STREAM, RESULTS, STATE_STREAM
from tests.support.fitted_fleet import fitted_axes, fitted_sent, healthy_baseline
from tests.support.fleet_runs import PARTITIONS, checked, log_section, owned_until_current


def test_takeovers_with_and_without_states_give_the_parameters_and_alarms_of_one_owner(tmp_path: Path) -> None:
    axes = fitted_axes(3, healthy_baseline(tmp_path))
    with LogServer(tmp_path, PARTITIONS) as server:
        settings = log_section(server.url)
        for part in (range(10), range(10, 15), range(15, 20)):
            fitted_sent(settings, axes, part)
            if part.start == 15:  # computes all fits again, and stores none of them again
                asyncio.run(_purge(settings))
            owned_until_current(settings, axes)
        result = checked(settings, axes)
        found = asyncio.run(_results(settings))
        again = {key: asyncio.run(_replayed(settings, key, axis)) for key, axis in axes.items()}
    for key, one in again.items():
        files = write_replayed(one, tmp_path / "axis.parquet")
        assert [path.name for path in files] == ["axis.parquet", "axis-parameters.parquet"]
        stored = pa.concat_tables(message.parameters for message in found).filter(pc.field("axis") == key)
        parameters = pq.read_table(tmp_path / "axis-parameters.parquet")
        assert sorted(map(repr, parameters.to_pylist())) == sorted(map(repr, stored.to_pylist()))
    total = result.total
    assert result.exact
    assert result.claims == 3 * PARTITIONS
    assert total.parameters == sum(one.parameters.num_rows for one in found) == 3 * 4 * 26
    changes = [event for one in found for event in one.events if event["kind"] == "change"]
    assert [event["axis"] for event in changes] == [next(iter(axes))]


def test_a_removed_message_of_results_is_missing_with_its_parameters_and_events(tmp_path: Path) -> None:
    axes = fitted_axes(1)
    with LogServer(tmp_path, PARTITIONS) as server:
        settings = log_section(server.url)
        for part in (range(10), range(10, 20)):
            fitted_sent(settings, axes, part)
            owned_until_current(settings, axes)
        assert checked(settings, axes).exact
        asyncio.run(_remove_first(settings))
        total = checked(settings, axes).total
    assert total.missing > 0
    assert total.parameters_missing > 0
    assert total.unexpected == total.parameters_unexpected == total.events_unexpected == 0


def test_results_of_another_version_are_refused_with_a_sentence() -> None:
    with pytest.raises(FleetError, match="version 1, and this livebode reads version 2"):
        ResultMessage.from_bytes(b"\xff\xff\xff\xff an Arrow stream")


async def _replayed(settings: LogSection, key: str, axis: Axis) -> ReplayedAxis:
    async with FleetLog(settings, "test") as log:
        return await replayed(log, key, axis, 0.0)


async def _purge(settings: LogSection) -> None:
    async with FleetLog(settings, "test") as log:
        await log._js.purge_stream(STATE_STREAM)


async def _remove_first(settings: LogSection) -> None:
    async with FleetLog(settings, "test") as log:
        last = (await log.extent(RESULT_STREAM)).last
        async for message in stored_messages(log, RESULT_STREAM, f"{RESULTS}.*", last):
            if ResultMessage.from_bytes(message.data).parameters.num_rows:
                await log._js.delete_msg(RESULT_STREAM, message.number)
                return


async def _results(settings: LogSection) -> list[ResultMessage]:
    async with FleetLog(settings, "test") as log:
        last = (await log.extent(RESULT_STREAM)).last
        found = stored_messages(log, RESULT_STREAM, f"{RESULTS}.*", last)
        return [ResultMessage.from_bytes(message.data) async for message in found]
