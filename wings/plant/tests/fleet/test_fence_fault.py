"""A frozen owner that wakes up after another one took its partitions over: with the fence nothing is doubled."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from multiprocessing.context import ForkServerProcess
from pathlib import Path

import pytest

from livebode.configuration import Axis
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.partition import PartitionOwner
from livebode_plant.fleet.replay import CheckResult
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.subjects import RESULT_STREAM
from livebode_plant.fleet.worker import own_partitions
from tests.support.fleet_runs import (
    PARTITIONS,
    UnfencedOwner,
    checked,
    fleet_axes,
    log_section,
    sent,
    start_owner,
    stored_responses,
)
from tests.support.peers.peer import PATIENCE_S

RESPONSES = 2  # of a batch, at a hop of half its samples


@pytest.fixture
def server(tmp_path: Path) -> Iterator[LogServer]:
    with LogServer(tmp_path, PARTITIONS) as one:
        yield one


def test_without_the_fence_a_frozen_owner_doubles_responses_and_the_check_says_so(server: LogServer) -> None:
    result = _frozen(server, UnfencedOwner)
    assert result.total.doubled > 0
    assert not result.exact


def test_with_the_fence_a_frozen_owner_doubles_nothing(server: LogServer) -> None:
    result = _frozen(server, PartitionOwner)
    assert result.exact
    assert result.total.responses > 0
    assert result.claims == 2 * PARTITIONS


def test_an_owner_without_data_ends_when_another_one_claims_its_partition(server: LogServer) -> None:
    # Else it keeps the thread of its worker, and when all are taken no partition that moves there begins.
    settings, ended = log_section(server.url), []
    asyncio.run(_streams(settings))
    first = threading.Thread(target=lambda: ended.append(own_partitions(settings, {}, [0], threading.Event())))
    first.start()
    _until(lambda: _claims(settings), at_least=1)
    stop = threading.Event()
    second = threading.Thread(target=own_partitions, args=(settings, {}, [0], stop))
    second.start()
    first.join()
    stop.set()
    second.join()
    assert ended == [[False]]


async def _streams(settings: LogSection) -> None:
    async with FleetLog(settings, "test") as log:
        await log.create_streams()


def _claims(settings: LogSection) -> int:
    async def count() -> int:
        async with FleetLog(settings, "test") as log:
            return (await log.extent(RESULT_STREAM)).last

    return asyncio.run(count())


def _frozen(server: LogServer, kind: type[PartitionOwner]) -> CheckResult:
    """Freeze an owner, let another one take over, thaw the first, and let both see more data."""
    settings, axes = log_section(server.url), fleet_axes(4)
    sent(settings, axes, 20)
    with _owner(settings, axes, kind) as first:
        _until(lambda: stored_responses(settings), at_least=1)
        os.kill(first.pid or 0, signal.SIGSTOP)
        sent(settings, axes, 20, 20)
        with _owner(settings, axes, kind):
            before = _until(lambda: stored_responses(settings), at_least=4 * 30 * RESPONSES)
            os.kill(first.pid or 0, signal.SIGCONT)
            sent(settings, axes, 20, 40)
            _until(lambda: stored_responses(settings), at_least=before + 4 * 20 * RESPONSES)
            if kind is UnfencedOwner:
                _until(lambda: checked(settings, axes).total.doubled, at_least=1)
    return checked(settings, axes)


@contextlib.contextmanager
def _owner(settings: LogSection, axes: dict[str, Axis], kind: type[PartitionOwner]) -> Iterator[ForkServerProcess]:
    process = start_owner(settings, axes, kind)
    try:
        yield process
    finally:
        process.kill()
        process.join()


def _until(count: Callable[[], int], *, at_least: int) -> int:
    until = time.monotonic() + PATIENCE_S
    while (found := count()) < at_least:
        assert time.monotonic() < until, f"{found} instead of {at_least}"
        time.sleep(0.2)
    return found
