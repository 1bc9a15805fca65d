"""Owners of partitions in processes: kills, restarts of the log, lost states and foreign data."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from livebode.configuration import Axis
from livebode.core import FleetError
from livebode_plant.fleet import connection
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.message import write_message
from livebode_plant.fleet.reader import stored_messages
from livebode_plant.fleet.result_message import ResultMessage
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.status import fleet_status
from livebode_plant.fleet.subjects import EDGE, LOG, LOG_STREAM, RESULT_STREAM, RESULTS, STATE_STREAM, axis_path
from tests.support.fleet_runs import (
    PARTITIONS,
    batch,
    checked,
    fleet_axes,
    log_section,
    owned_until_current,
    sent,
)


@pytest.fixture
def server(tmp_path: Path) -> Iterator[LogServer]:
    with LogServer(tmp_path, PARTITIONS) as one:
        yield one


def test_an_owner_continues_from_states_as_if_there_had_been_one(server: LogServer) -> None:
    settings, axes = log_section(server.url), fleet_axes(5)
    for part in range(3):
        sent(settings, axes, 30, 30 * part)
        owned_until_current(settings, axes)
    result = checked(settings, axes)
    assert result.exact
    assert result.total.responses == 5 * (90 * 2)
    assert result.claims == 3 * PARTITIONS


def test_a_log_that_is_killed_and_restarted_loses_nothing(server: LogServer) -> None:
    settings, axes = log_section(server.url), fleet_axes(3)
    sent(settings, axes, 30)
    owned_until_current(settings, axes)
    server.kill()
    server.start()
    sent(settings, axes, 30, 30)
    owned_until_current(settings, axes)
    assert checked(settings, axes).exact


def test_without_their_states_axes_are_computed_again_and_what_is_stored_is_dropped(server: LogServer) -> None:
    settings, axes = log_section(server.url), fleet_axes(3)
    sent(settings, axes, 30)
    owned_until_current(settings, axes)
    asyncio.run(_purge(settings, STATE_STREAM))
    sent(settings, axes, 30, 30)
    owned_until_current(settings, axes)
    result = checked(settings, axes)
    assert result.exact
    assert result.total.responses == 3 * (60 * 2)


def test_a_state_of_another_configuration_is_rejected_with_the_reason_and_the_axis_begins_again(
    server: LogServer,
) -> None:
    settings, axes = log_section(server.url), fleet_axes(2)
    sent(settings, axes, 30)
    owned_until_current(settings, axes)
    changed = {
        key: axis.model_copy(update={"tracking": axis.tracking.model_copy(update={"hop": 50})})
        for key, axis in axes.items()
    }
    sent(settings, axes, 30, 30)
    owned_until_current(settings, changed)
    assert sorted(event["kind"] for event in _events(settings) if event["kind"] == "state-rejected") == [
        "state-rejected"
    ] * len(axes)
    result = checked(settings, changed)
    assert result.exact
    assert result.total.other_recipe == 2 * (30 * 2)
    assert result.total.responses > 0


def test_a_result_that_was_removed_is_missing_and_a_repeated_one_doubled(server: LogServer) -> None:
    settings, axes = log_section(server.url), fleet_axes(2)
    for part in range(2):
        sent(settings, axes, 20, 20 * part)
        owned_until_current(settings, axes)
    before = checked(settings, axes)
    assert before.exact
    asyncio.run(_store_first_again(settings))
    assert checked(settings, axes).total.doubled > 0
    asyncio.run(_purge(settings, RESULT_STREAM, keep=1))
    after = checked(settings, axes).total
    assert after.missing > 0
    assert after.doubled == 0


def test_foreign_and_damaged_messages_are_reported_and_disturb_no_axis(server: LogServer) -> None:
    settings, axes = log_section(server.url), fleet_axes(2)
    key = next(iter(axes))
    sent(settings, axes, 20)
    asyncio.run(_append(settings, f"{EDGE}.{key}", b"LBOD and nothing else"))
    asyncio.run(_append(settings, f"{EDGE}.ulm._.unknown.x", b"anything"))
    sent(settings, axes, 20, 20)
    owned_until_current(settings, axes)
    result = checked(settings, axes)
    assert result.exact
    assert result.total.responses == 2 * (40 * 2)
    assert [event["axis"] for event in _events(settings) if event["kind"] == "malformed"] == [key]
    assert any("ulm/unknown/x" in alarm for alarm in _status(settings, axes)["alarms"])


def test_repeated_and_reordered_messages_give_the_responses_of_ordered_ones(server: LogServer) -> None:
    settings, axes = log_section(server.url), fleet_axes(1)
    ((key, _),) = axes.items()
    sent(settings, axes, 20)
    for first in (1000, 1100, 1050, 1200, 1150, 1100, 1250):
        asyncio.run(_append(settings, f"{EDGE}.{key}", write_message(batch(0, first))))
    sent(settings, axes, 10, 26)
    owned_until_current(settings, axes)
    kinds = [event["kind"] for event in _events(settings)]
    assert (kinds.count("reordered"), kinds.count("repeat"), kinds.count("loss")) == (2, 1, 0)
    result = checked(settings, axes)
    assert result.exact
    assert result.total.responses == 36 * 2


def test_missing_samples_are_reported_with_their_exact_number(server: LogServer) -> None:
    settings, axes = log_section(server.url), fleet_axes(1)
    sent(settings, axes, 20)
    sent(settings, axes, 20, 23)
    owned_until_current(settings, axes)
    losses = [event for event in _events(settings) if event["kind"] == "loss"]
    assert [event["details"]["missing_samples"] for event in losses] == [3 * 50]
    assert checked(settings, axes).exact
    assert _status(settings, axes)["axes"][0]["lost"] == 3 * 50


def test_a_log_without_its_beginning_cannot_be_checked(server: LogServer) -> None:
    settings, axes = log_section(server.url), fleet_axes(1)
    sent(settings, axes, 20)
    asyncio.run(_purge(settings, LOG_STREAM, keep=5))
    with pytest.raises(FleetError, match="begins at message 16"):
        checked(settings, axes)


def test_an_axis_whose_channels_are_missing_is_not_tracked_and_the_others_are(server: LogServer) -> None:
    settings, axes = log_section(server.url), fleet_axes(2)
    key, other = axes
    wrong = axes | {
        key: axes[key].model_copy(update={"signals": axes[key].signals.model_copy(update={"outputs": "z"})})
    }
    sent(settings, axes, 20)
    owned_until_current(settings, wrong)
    found = {axis["axis"]: axis for axis in _status(settings, wrong)["axes"]}
    assert "'z'" in found[axis_path(key)]["failure"]
    assert found[axis_path(other)]["responses"] == 20 * 2
    assert checked(settings, wrong).exact


def test_a_server_that_is_not_there_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "_START_S", 0.3)
    with pytest.raises(FleetError, match="cannot be reached"):
        checked(LogSection(url="nats://127.0.0.1:1"), {})


def test_the_server_maps_every_axis_to_one_partition(server: LogServer) -> None:
    settings, axes = log_section(server.url), fleet_axes(12)
    sent(settings, axes, 2)
    subjects = asyncio.run(_subjects(settings))
    assert sorted(subject.split(".", 2)[2] for subject in subjects) == sorted(axes)
    assert all(0 <= int(subject.split(".")[1]) < PARTITIONS for subject in subjects)


async def _subjects(settings: LogSection) -> list[str]:
    async with FleetLog(settings, "test") as log:
        return list((await log.extent(LOG_STREAM, f"{LOG}.>")).subjects)


async def _purge(settings: LogSection, stream: str, keep: int = 0) -> None:
    async with FleetLog(settings, "test") as log:
        await log._js.purge_stream(stream, keep=keep or None)


async def _append(settings: LogSection, subject: str, data: bytes) -> None:
    async with FleetLog(settings, "test") as log:
        await log.append(subject, data)


async def _results(settings: LogSection) -> list[tuple[str, bytes]]:
    async with FleetLog(settings, "test") as log:
        last = (await log.extent(RESULT_STREAM)).last
        return [(m.subject, m.data) async for m in stored_messages(log, RESULT_STREAM, f"{RESULTS}.*", last)]


async def _store_first_again(settings: LogSection) -> None:
    found = await _results(settings)
    subject, first = next((name, data) for name, data in found if ResultMessage.from_bytes(data).rows.num_rows)
    last = next(ResultMessage.from_bytes(data) for name, data in reversed(found) if name == subject)
    again = ResultMessage.from_bytes(first)
    again = ResultMessage(last.through, again.owner, rows=again.rows, recipes=again.recipes)
    await _append(settings, subject, again.to_bytes())


def _events(settings: LogSection) -> list[dict[str, object]]:
    found = asyncio.run(_results(settings))
    return [dict(event) for _, data in found for event in ResultMessage.from_bytes(data).events]


def _status(settings: LogSection, axes: dict[str, Axis]) -> dict[str, list[dict[str, object]]]:
    async def status() -> dict[str, list[dict[str, object]]]:
        async with FleetLog(settings, "test") as log:
            found: dict[str, list[dict[str, object]]] = json.loads(json.dumps(await fleet_status(log, axes)))
            return found

    return asyncio.run(status())
