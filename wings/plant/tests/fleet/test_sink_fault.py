"""`livebode fleet sink`: each stored response is in the lake once, wherever it is killed, whatever the log deletes."""

from __future__ import annotations

import asyncio
import itertools
import os
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pytest

from livebode.core import LEVELS
from livebode_plant.fleet import sink_tables
from livebode_plant.fleet.fleet_settings import LogSection, SinkSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.reader import StoredMessage, stored_messages
from livebode_plant.fleet.result_message import ResultMessage
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.sink import Sink
from livebode_plant.fleet.sink_tables import SinkTables
from livebode_plant.fleet.status import fleet_status
from livebode_plant.fleet.subjects import RESULT_STREAM, RESULTS, axis_path
from livebode_plant.lake import Lake, stream_table
from tests.support.command import livebode
from tests.support.fitted_fleet import fitted_axes, fitted_sent
from tests.support.fleet_runs import (
    PARTITIONS,
    fleet_axes,
    log_section,
    owned_until_current,
    sent,
    stored_responses,
)
from tests.support.forked import server as forked
from tests.support.sinks import sink_once

AXES, BATCHES, KILLS = 3, 30, 7


@pytest.fixture
def server(tmp_path: Path) -> Iterator[LogServer]:
    with LogServer(tmp_path / "log", PARTITIONS) as one:
        yield one


def keys(lake: Path) -> list[tuple[object, ...]]:
    """Axis, run and number of each response in the lake."""
    rows = Lake(str(lake)).read("fleet_responses", [*LEVELS, "run", "number"])
    return sorted(tuple(str(value) for value in row.values()) for row in rows.to_pylist())


def start_sink(log: LogSection, lake: Path) -> ForkServerProcess:
    """A process that commits as often as it can, until it is killed."""
    process = forked().Process(target=sink_forever, args=(log, lake), daemon=True)
    process.start()
    return process


def sink_forever(log: LogSection, lake: Path) -> None:
    async def store() -> None:
        async with FleetLog(log, "sink") as connection:
            await Sink(connection, SinkSection(lake=str(lake), commit_s=0.001)).run(asyncio.Event())

    asyncio.run(store())


def numbers_as_times(began_s: float) -> None:
    """Let the log have received a message each second, and means be those of five seconds and of ten.

    So many periods end during a test, and which ones does not depend on how long it takes.
    """
    sink_tables._TIERS, sink_tables._LATE_S = {"minute": 5, "hour": 10}, 0.1  # type: ignore[attr-defined]
    process = SinkTables.process

    def timed(self: SinkTables, messages: list[StoredMessage]) -> list[pa.Table]:
        return process(self, [replace(one, stored_s=began_s + one.number) for one in messages])

    SinkTables.process = timed  # type: ignore[method-assign]


def kill_at(step: int) -> None:
    """End this process before or after a file is written or a version committed, at so many of these moments."""
    moments = itertools.count(1)

    def around(action: Callable[..., Any]) -> Callable[..., Any]:
        def run(*arguments: Any, **named: Any) -> Any:
            for at in (None, action):
                result = at(*arguments, **named) if at else None
                if next(moments) == step:
                    os.kill(os.getpid(), signal.SIGKILL)
            return result

        return run

    stream_table.write_whole = around(stream_table.write_whole)  # type: ignore[attr-defined]
    Lake.commit = around(Lake.commit)  # type: ignore[method-assign]


def killed_sinks(log: LogSection, lake: Path, began_s: float, kills: int) -> None:
    """One sink after the other, each killed a moment later than the one before it, and a last one that is not."""
    numbers_as_times(began_s)
    for step in [*range(1, kills + 1), 10**9]:
        if not (child := os.fork()):
            kill_at(step)
            sink_once(log, lake, 0.001)
            os._exit(0)
        os.waitpid(child, 0)


def in_process(action: Callable[..., None], *arguments: object) -> None:
    process = forked().Process(target=action, args=arguments)
    process.start()
    process.join()
    assert process.exitcode == 0


def test_a_sink_that_is_killed_at_every_moment_of_a_commit_stores_every_response_once(
    server: LogServer, tmp_path: Path
) -> None:
    log, axes = log_section(server.url), fleet_axes(AXES)
    for part in range(4):
        sent(log, axes, BATCHES, BATCHES * part)
        owned_until_current(log, axes)
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    began_s = time.time() // 3600 * 3600 - 3600  # recent, because the sink deletes what is old
    in_process(killed_sinks, log, killed, began_s, KILLS)
    in_process(killed_sinks, log, whole, began_s, 0)
    found = keys(killed)
    assert len(set(found)) == len(found) == stored_responses(log) == AXES * 4 * BATCHES * 2
    for name in ("fleet_responses", "fleet_runs", "fleet_events", "fleet_responses_minute", "fleet_responses_hour"):
        assert text(killed, name) == text(whole, name)
    # In each part owners claim all partitions, five messages at least: an axis has four periods, the last one open.
    assert len(text(whole, "fleet_responses_minute")) >= 3 * AXES
    runs = Lake(str(killed)).read("fleet_runs").to_pylist()
    assert sorted(axis_path(key) for key in axes) == sorted(f"{r['site']}/{r['machine']}/{r['axis']}" for r in runs)
    assert {(run["window"], run["rate_hz"], tuple(run["frequencies_hz"])) for run in runs} == {
        (100, 1000.0, (20.0, 40.0, 60.0, 80.0, 100.0))
    }


def text(lake: Path, name: str) -> list[str]:
    """The rows of a table, in an order that does not depend on the files; NaN equals NaN."""
    return sorted(map(str, Lake(str(lake)).read(name).to_pylist()))


def test_two_sinks_of_one_lake_store_every_response_once(server: LogServer, tmp_path: Path) -> None:
    log, axes, lake = log_section(server.url), fleet_axes(AXES), tmp_path / "lake"
    sent(log, axes, BATCHES)
    sinks = [start_sink(log, lake) for _ in range(2)]
    for part in (1, 2):
        sent(log, axes, BATCHES, BATCHES * part)
        owned_until_current(log, axes)
    sink_once(log, lake)
    for sink in sinks:
        sink.kill()
        sink.join()
    found = keys(lake)
    assert len(set(found)) == len(found) == stored_responses(log)


def test_what_the_log_deleted_before_it_was_read_is_an_event_with_its_extent(server: LogServer, tmp_path: Path) -> None:
    log, axes, lake = log_section(server.url), fleet_axes(1), tmp_path / "lake"
    sent(log, axes, BATCHES)
    owned_until_current(log, axes)
    sink_once(log, lake)
    for part in (1, 2):
        sent(log, axes, BATCHES, BATCHES * part)
        owned_until_current(log, axes)
    before = asyncio.run(_extent(log))
    asyncio.run(_purge(log, before - 1))
    totals = sink_once(log, lake)
    events = Lake(str(lake)).read("fleet_events", where=pc.field("kind") == "results-deleted")
    (message,) = events["message"].to_pylist()
    assert totals.deleted > 0
    assert f"to {before - 2})" in message
    assert sink_once(log, lake).deleted == 0
    assert len(set(keys(lake))) == len(keys(lake))


def test_the_status_says_how_far_a_sink_is_behind_and_warns_before_results_are_deleted(
    server: LogServer, tmp_path: Path
) -> None:
    log, axes, lake = log_section(server.url), fleet_axes(1), tmp_path / "lake"
    sent(log, axes, BATCHES)
    assert asyncio.run(_status(log))["sinks"] == []
    sink_once(log, lake)
    owned_until_current(log, axes)
    last, size_bytes = asyncio.run(_extent(log)), asyncio.run(_size_bytes(log))
    (behind,) = asyncio.run(_status(log))["sinks"]
    assert (behind["lake"], behind["through"], behind["behind"]) == (str(lake), 0, last)
    assert behind["behind_s"] > 0
    for room, warned in ((1.3, True), (1.6, False)):
        full = log.model_copy(update={"results_gb": room * size_bytes / 1e9})
        alarms = [alarm for alarm in asyncio.run(_status(full))["alarms"] if "sink" in alarm]
        assert [f"{1 / room:.0%} of log.results_gb" in alarm for alarm in alarms] == [True] * warned
    sink_once(log, lake)
    assert asyncio.run(_status(log))["sinks"] == [
        {"lake": str(lake), "through": last, "behind": 0, "behind_s": 0.0, "results_share": 0.0}
    ]


async def _status(log: LogSection) -> dict[str, Any]:
    async with FleetLog(log, "test") as connection:
        return await fleet_status(connection, {})


async def _size_bytes(log: LogSection) -> int:
    async with FleetLog(log, "test") as connection:
        return (await connection.extent(RESULT_STREAM)).size_bytes


async def _extent(log: LogSection) -> int:
    async with FleetLog(log, "test") as connection:
        return (await connection.extent(RESULT_STREAM)).last


async def _purge(log: LogSection, first: int) -> None:
    async with FleetLog(log, "test") as connection:
        await connection._js.purge_stream(RESULT_STREAM, seq=first)


def test_the_command_needs_a_lake_and_prints_what_it_has_stored(server: LogServer, tmp_path: Path) -> None:
    log, axes = log_section(server.url), fleet_axes(1)
    sent(log, axes, BATCHES)
    owned_until_current(log, axes)
    fleet = tmp_path / "fleet.toml"
    fleet.write_text(f'axes = ["a.toml"]\n[log]\nurl = "{server.url}"\n')
    refused = livebode("fleet", "sink", fleet, "--once")
    assert (refused.code, "'sink.lake' is missing" in refused.err) == (2, True)
    fleet.write_text(fleet.read_text() + '[sink]\nlake = "lake"\n')
    assert f"{2 * BATCHES} responses" in livebode("fleet", "sink", fleet, "--once").out
    assert isinstance(Lake(str(tmp_path / "lake")).read("fleet_responses"), pa.Table)
    assert len(keys(tmp_path / "lake")) == 2 * BATCHES


def test_fits_of_the_log_are_in_the_lake_with_the_numbers_of_their_responses(server: LogServer, tmp_path: Path) -> None:
    log, axes, lake = log_section(server.url), fitted_axes(1), tmp_path / "lake"
    fitted_sent(log, axes, range(16))
    owned_until_current(log, axes)
    sink_once(log, lake)
    names = ["run", "number", "model", "name", "value", "sigma", "status"]
    stored = pa.concat_tables(one.parameters.select(names) for one in asyncio.run(_results(log)))
    found = Lake(str(lake)).read("fleet_parameters", names)
    assert sorted(map(str, found.to_pylist())) == sorted(map(str, stored.to_pylist()))
    assert found.num_rows > 4 * 7


async def _results(log: LogSection) -> list[ResultMessage]:
    async with FleetLog(log, "test") as connection:
        last = (await connection.extent(RESULT_STREAM)).last
        messages = stored_messages(connection, RESULT_STREAM, f"{RESULTS}.*", last)
        return [ResultMessage.from_bytes(message.data) async for message in messages]
