"""The store of a log that is copied while its server is stopped, and put back later."""

from __future__ import annotations

import asyncio
import shutil
from pathlib import Path
from typing import Any

from livebode.configuration import Axis
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.status import fleet_status
from tests.support.fleet_runs import PARTITIONS, SAMPLES, checked, fleet_axes, log_section, owned_until_current, sent


def test_a_restored_copy_continues_exactly_and_reports_what_came_after_it_as_lost(tmp_path: Path) -> None:
    axes = fleet_axes(2)
    store, copy = tmp_path / "log" / "store", tmp_path / "copy"
    with LogServer(tmp_path / "log", PARTITIONS) as server:
        settings = log_section(server.url)
        sent(settings, axes, 20)
        owned_until_current(settings, axes)
        server.kill()
        shutil.copytree(store, copy)
        server.start()
        sent(settings, axes, 20, 20)
        owned_until_current(settings, axes)
        server.kill()
        shutil.rmtree(store)
        shutil.copytree(copy, store)
        server.start()
        sent(settings, axes, 20, 40)
        owned_until_current(settings, axes)
        result = checked(settings, axes)
        assert result.exact
        assert result.messages == 2 * 40
        assert [axis["lost"] for axis in asyncio.run(_status(settings, axes))["axes"]] == [20 * SAMPLES] * 2


async def _status(settings: LogSection, axes: dict[str, Axis]) -> dict[str, Any]:
    async with FleetLog(settings, "test") as log:
        return await fleet_status(log, axes)
