"""An edge that sends without end: its own oldest messages are deleted, those of others are not."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from nats.errors import Error

from livebode.sources.live import FRAME_BYTES_MAX
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.status import fleet_status
from livebode_plant.fleet.subjects import EDGE, LOG, LOG_STREAM, axis_path
from tests.support.secure_fleet import SecureFleet, secure_fleet

QUOTA = 20


def test_an_axis_that_has_used_its_part_loses_its_own_oldest_messages_and_is_reported(tmp_path: Path) -> None:
    with secure_fleet(tmp_path) as fleet:
        counts, alarms = asyncio.run(_flooded(fleet))
    good, mad = fleet.keys
    assert {subject.split(".", 2)[2]: count for subject, count in counts.items()} == {good: 5, mad: QUOTA}
    assert [alarm for alarm in alarms if "its oldest are deleted" in alarm] == [
        f"{axis_path(mad)} has log.axis_messages = {QUOTA} messages in the log: its oldest are deleted, "
        "those of others are not; check its edge"
    ]


async def _flooded(fleet: SecureFleet) -> tuple[dict[str, int], list[str]]:
    good, mad = fleet.keys
    own = fleet.log("fleet").model_copy(update={"axis_messages": QUOTA})
    async with FleetLog(own, "test") as log:
        await log.create_streams()
        async with FleetLog(fleet.log("edge 0"), "good") as edge, FleetLog(fleet.log("edge 1"), "mad") as enemy:
            for number in range(5):
                await edge.append(f"{EDGE}.{good}", b"%d" % number)
            for number in range(3 * QUOTA):
                await enemy.append(f"{EDGE}.{mad}", b"%d" % number)
        counts = dict((await log.extent(LOG_STREAM, f"{LOG}.>")).subjects)
        return counts, (await fleet_status(log, fleet.axes))["alarms"]


def test_the_server_ends_a_connection_that_is_one_too_many_or_sends_a_message_that_is_too_long(tmp_path: Path) -> None:
    with secure_fleet(tmp_path) as fleet:
        opened = asyncio.run(_opened(fleet, 20))
        assert 1 <= opened < 10
        asyncio.run(_too_long(fleet))


async def _opened(fleet: SecureFleet, wanted: int) -> int:
    """How many connections of the first edge the server accepts at once, and one of the second is among them."""
    logs: list[FleetLog] = []
    try:
        for _ in range(wanted):
            log = FleetLog(fleet.log("edge 0"), "test")
            try:
                logs.append(await log.__aenter__())
            except Exception:
                break
        async with FleetLog(fleet.log("edge 1"), "test") as other:
            assert other._connection.is_connected
        return len(logs)
    finally:
        for log in logs:
            await log.__aexit__()


async def _too_long(fleet: SecureFleet) -> None:
    own, _ = fleet.keys
    async with FleetLog(fleet.log("fleet"), "test") as log:
        await log.create_streams()
        async with FleetLog(fleet.log("edge 0"), "test") as edge:
            with pytest.raises((Error, TimeoutError)):
                await edge._js.publish(f"{EDGE}.{own}", bytes(2 * FRAME_BYTES_MAX + 1), timeout=1)
        assert (await log.extent(LOG_STREAM)).last == 0
