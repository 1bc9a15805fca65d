"""A hostile edge among good ones on a real server: the good axes have the results that they have without it."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np

from livebode.sources.live import Batch
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.message import message_id, write_message
from livebode_plant.fleet.reader import stored_messages
from livebode_plant.fleet.result_message import ResultMessage
from livebode_plant.fleet.subjects import EDGE, RESULT_STREAM, RESULTS
from tests.support.fleet_runs import CHANNELS, RATE_HZ, batch, checked, owned_until_current
from tests.support.secure_fleet import SecureFleet, secure_fleet

BATCHES, SAMPLES = 20, 50


def test_a_hostile_edge_changes_no_result_of_another_and_the_check_is_exact(tmp_path: Path) -> None:
    alone, disturbed = _results(tmp_path / "alone", hostile=False), _results(tmp_path / "disturbed", hostile=True)
    assert len(alone) == BATCHES * SAMPLES // 25
    assert disturbed == alone


def _results(folder: Path, *, hostile: bool) -> list[tuple[object, ...]]:
    """The stored responses of the good axis."""
    folder.mkdir()
    with secure_fleet(folder) as fleet:
        asyncio.run(_send(fleet, hostile=hostile))
        owned_until_current(fleet.log("fleet"), fleet.axes)
        result = checked(fleet.log("fleet"), fleet.axes)
        assert result.exact
        return asyncio.run(_stored(fleet))


async def _send(fleet: SecureFleet, *, hostile: bool) -> None:
    good, own = fleet.keys
    async with FleetLog(fleet.log("fleet"), "test") as log:
        await log.create_streams()
    rng = np.random.default_rng(1)
    async with FleetLog(fleet.log("edge 0"), "good") as log, FleetLog(fleet.log("edge 1"), "hostile") as enemy:
        for first in range(0, BATCHES * SAMPLES, SAMPLES):
            message = write_message(batch(0, first))
            if hostile:
                await enemy.append(f"{EDGE}.{own}", _poison(rng), message_id(good, message).rpartition(":")[0])
            await log.append(f"{EDGE}.{good}", message, message_id(good, message))


def _poison(rng: np.random.Generator) -> bytes:
    """Random bytes, or the longest message that a frame permits, with any number and epoch."""
    if rng.random() < 0.5:
        return rng.bytes(1000)
    first, epoch = (int(number) for number in rng.integers(0, 2**61, 2))
    samples = int(rng.integers(1, 60_000))
    return write_message(Batch(first, np.zeros((len(CHANNELS), samples)), CHANNELS, RATE_HZ, epoch))


async def _stored(fleet: SecureFleet) -> list[tuple[object, ...]]:
    good, _ = fleet.keys
    rows: list[tuple[object, ...]] = []
    async with FleetLog(fleet.log("fleet"), "test") as log:
        last = (await log.extent(RESULT_STREAM)).last
        async for message in stored_messages(log, RESULT_STREAM, f"{RESULTS}.*", last):
            found = ResultMessage.from_bytes(message.data).rows.to_pylist()
            rows += [tuple(map(repr, row.values())) for row in found if row.pop("run") and row["axis"] == good]
    return rows
