"""The number of partitions may change only while the log has no data."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from livebode.core import FleetError
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.server import LogServer
from tests.support.command import livebode
from tests.support.fleet_runs import PARTITIONS, fleet_axes, log_section, sent


@pytest.fixture
def server(tmp_path: Path) -> Iterator[LogServer]:
    with LogServer(tmp_path, PARTITIONS) as one:
        yield one


def _use(settings: LogSection, count: int) -> None:
    async def use() -> None:
        async with FleetLog(settings, "test") as log:
            await log.create_streams(update=True)
            await log.use_partitions(count)

    asyncio.run(use())


def test_another_number_is_refused_while_the_log_has_data_and_accepted_before(
    server: LogServer, tmp_path: Path
) -> None:
    settings = log_section(server.url)
    _use(settings, PARTITIONS + 1)
    _use(settings, PARTITIONS)
    sent(settings, fleet_axes(1), 2)
    _use(settings, PARTITIONS)
    with pytest.raises(
        FleetError, match=rf"data in {PARTITIONS} partitions, and the fleet has partitions = 9"
    ) as caught:
        _use(settings, 9)
    assert caught.value.code == "fleet.partitions-changed"
    fleet = tmp_path / "fleet.toml"
    fleet.write_text(f'axes = ["axis.toml"]\npartitions = 9\n[log]\nurl = "{server.url}"')
    refused = livebode("fleet", "setup", fleet, "--store", tmp_path / "store")
    assert (refused.code, f"set partitions = {PARTITIONS}" in refused.err) == (2, True)
    fleet.write_text(f'axes = ["axis.toml"]\npartitions = {PARTITIONS}')
    assert livebode("fleet", "setup", fleet, "--store", tmp_path / "store").code == 0


def test_limits_of_an_existing_log_follow_the_settings_at_the_start_of_the_fleet(server: LogServer) -> None:
    _use(log_section(server.url), PARTITIONS)
    changed = log_section(server.url).model_copy(update={"size_gb": 0.25, "axis_messages": 7, "age_days": 2.0})
    _use(changed, PARTITIONS)
    config = asyncio.run(_config(changed))
    assert (config.max_bytes, config.max_msgs_per_subject, config.max_age) == (250_000_000, 7, 2 * 86400)
    assert config.description == f"livebode, {PARTITIONS} partitions"


async def _config(settings: LogSection) -> Any:
    async with FleetLog(settings, "test") as log:
        return (await log._js.stream_info("LOG")).config
