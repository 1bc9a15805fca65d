"""Workers of a coordinator that are killed, and again while they start."""

from __future__ import annotations

import threading
import time

import psutil

from livebode.fleet.coordinator import FleetCoordinator
from livebode.fleet.settings import FleetSettings

_ABOUT = {"axes": ["a.toml"], "partitions": 1, "workers": 1, "log": {"url": "nats://127.0.0.1:1"}}


def test_a_worker_that_is_killed_again_while_it_starts_is_replaced() -> None:
    with FleetCoordinator(FleetSettings.of(_ABOUT, "a test"), {}) as coordinator:
        killed = set()
        for pause_s in (0.0, 0.2):
            (process,) = _new(killed)
            time.sleep(pause_s)
            process.kill()
            killed.add(process.pid)
        _new(killed, coordinator)
        while not coordinator.workers:
            coordinator.step()
            time.sleep(0.1)
        # Which of two that were started is the one that remains depends on the moments of the kills.
        assert any(process.is_running() for process in _new(killed, coordinator))


def test_a_coordinator_whose_first_worker_is_killed_while_it_starts_starts_again() -> None:
    killed: set[int] = set()
    killer = threading.Thread(target=lambda: _new(killed)[0].kill())
    killer.start()
    with FleetCoordinator(FleetSettings.of(_ABOUT, "a test"), {}) as coordinator:
        killer.join()
        while not coordinator.workers:
            time.sleep(0.1)


def _new(killed: set[int], coordinator: FleetCoordinator | None = None) -> list[psutil.Process]:
    """Processes of workers that were not killed yet, as soon as there are some."""
    while True:
        found = []
        for child in psutil.Process().children():
            try:
                if child.pid not in killed and "spawn_main" in " ".join(child.cmdline()):
                    found.append(child)
            except psutil.NoSuchProcess:
                continue
        if found:
            return found
        if coordinator is not None:
            coordinator.step()
        time.sleep(0.02)
