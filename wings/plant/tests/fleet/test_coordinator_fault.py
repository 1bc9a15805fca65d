"""Workers that end, freeze or lose their coordinator: others own their partitions; no response is lost or doubled."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from multiprocessing.sharedctypes import RawValue
from pathlib import Path

import psutil
import pytest

from livebode.configuration import Axis
from livebode_plant.fleet import coordinator as coordinator_module
from livebode_plant.fleet.coordinator import FleetCoordinator
from livebode_plant.fleet.fleet_settings import FleetSettings, LogSection
from livebode_plant.fleet.server import LogServer
from tests.support.fleet_runs import PARTITIONS, checked, fleet_axes, log_section, sent
from tests.support.forked import server
from tests.support.peers.peer import PATIENCE_S

AXES, BATCHES = 2, 20


@pytest.fixture
def log(tmp_path: Path) -> Iterator[LogServer]:
    with LogServer(tmp_path, PARTITIONS) as log:
        # As `livebode fleet run` does: nats-server 2.9.10 ends with a nil pointer where a worker asks for a message of
        # a stream that somebody is just creating.
        sent(log_section(log.url), {}, 0)
        yield log


def _settings(url: str) -> FleetSettings:
    about = {"axes": ["a.toml"], "partitions": PARTITIONS, "workers": 2, "log": log_section(url).model_dump()}
    return FleetSettings.of(about, "a test")


def _until(reached: Callable[[], bool], coordinator: FleetCoordinator | None = None) -> None:
    until_s = time.monotonic() + PATIENCE_S
    while not reached():
        assert time.monotonic() < until_s
        if coordinator is not None:
            coordinator.step()
        time.sleep(0.05)


def _complete(settings: LogSection, axes: dict[str, Axis]) -> bool:
    """Whether all responses of all that was sent are stored, each once."""
    result = checked(settings, axes)
    assert not result.total.doubled
    assert not result.total.different
    return result.exact and result.total.responses > 0


def test_partitions_of_workers_that_are_killed_while_they_start_or_freeze_are_owned_again(
    log: LogServer,
) -> None:
    settings, axes = log_section(log.url), fleet_axes(AXES)
    with FleetCoordinator(_settings(log.url), axes) as coordinator:
        for number, fault in enumerate((signal.SIGKILL, signal.SIGSTOP)):
            before = coordinator.workers
            os.kill(before[0], fault)
            _until(lambda before=before: len(set(coordinator.workers) - set(before)) == 1, coordinator)
            assert before[1] in coordinator.workers
            sent(settings, axes, BATCHES, BATCHES * number)
            _until(lambda: _complete(settings, axes), coordinator)


def _coordinate(url: str, axes: dict[str, Axis], outlet: Connection) -> None:
    with FleetCoordinator(_settings(url), axes) as coordinator:
        outlet.send(coordinator.workers)
        while True:
            coordinator.step()
            time.sleep(0.1)


def test_workers_continue_without_their_coordinator_and_end_when_those_of_the_next_one_have_claimed_all(
    log: LogServer,
) -> None:
    settings, axes = log_section(log.url), fleet_axes(AXES)
    found, outlet = server().Pipe(duplex=False)
    first = server().Process(target=_coordinate, args=(log.url, axes, outlet))
    first.start()
    assert found.poll(PATIENCE_S)
    workers = [psutil.Process(pid) for pid in found.recv()]
    sent(settings, axes, BATCHES)
    _until(lambda: _complete(settings, axes))
    first.kill()
    first.join()
    sent(settings, axes, BATCHES, BATCHES)
    _until(lambda: _complete(settings, axes))
    with FleetCoordinator(_settings(log.url), axes) as second:
        assert all(worker.is_running() for worker in workers)
        _until(lambda: not any(worker.is_running() for worker in workers), second)
        sent(settings, axes, BATCHES, 2 * BATCHES)
        _until(lambda: _complete(settings, axes), second)


def test_a_worker_without_a_coordinator_for_too_long_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(coordinator_module, "ORPHAN_S", 0.0)
    stop = threading.Event()
    coordinator_module._show_life(RawValue("d"), stop)  # this process has no parent that started it
    assert stop.is_set()
