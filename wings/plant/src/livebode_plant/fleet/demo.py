"""`livebode fleet run --demo`: a log, workers and simulated axes; a worker is killed, and nothing is lost."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from livebode.configuration import Axis
from livebode.core import counted
from livebode_plant.fleet.check import CheckResult, check_results
from livebode_plant.fleet.coordinator import FleetCoordinator
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.settings import FleetSettings
from livebode_plant.fleet.simulated import RATE_HZ, SimulatedMachines, write_simulated_fleet
from livebode_plant.fleet.status import fleet_status, silences

PARTITIONS = 8
_STEP_S, _DRAIN_S = 0.25, 30.0


@dataclass(frozen=True)
class DemoResult:
    """What the demonstration gave: the check, and the longest time without a new result after the kill."""

    check: CheckResult
    silence_s: float


def demo(folder: Path, *, axes: int, workers: int, seconds: float, say: Callable[[str], None]) -> DemoResult:
    """Run the demonstration in a folder; `say` gets what happens, in sentences.

    Raises
    ------
    FleetError
        If nats-server is not installed.
    ExtraError
        If a package of the extra "fleet" is not installed.
    """
    with LogServer(folder / "log", PARTITIONS) as server:
        path = write_simulated_fleet(folder, server.url, axes=axes, partitions=PARTITIONS, workers=workers)
        settings = FleetSettings.read(path)
        configured = settings.read_axes()
        say(f"nats-server stores the log at {server.url}")
        asyncio.run(_create_streams(settings))
        with FleetCoordinator(settings, configured) as coordinator:
            say(f"{workers} workers share {PARTITIONS} partitions")
            with SimulatedMachines(settings) as machines:
                say(f"{axes} axes send {RATE_HZ:g} samples per second each")
                _wait(coordinator, seconds / 2)
                killed_s = _kill(settings, configured, say)
                _wait(coordinator, seconds / 2)
            say(f"the axes stop after {machines.sent} messages each")
            _drain(coordinator, settings, configured)
            say(_shares(settings, configured))
        longest = asyncio.run(_longest(settings, killed_s))
        say(f"longest time without a new result in a partition after the kill: {longest:.1f} s")
        say("computing all responses again from the log, in one process without interruption")
        return DemoResult(asyncio.run(_check(settings, configured)), longest)


def _wait(coordinator: FleetCoordinator, seconds: float) -> None:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        coordinator.step()
        time.sleep(_STEP_S)


def _kill(settings: FleetSettings, axes: dict[str, Axis], say: Callable[[str], None]) -> float:
    owners = _owners(settings, axes)
    victim = max(owners, key=owners.__getitem__)
    os.kill(int(victim.rpartition(":")[2]), signal.SIGKILL)
    say(f"kill -9 of worker {victim}, the owner of {counted(owners[victim], 'partition')}")
    return time.time()


def _owners(settings: FleetSettings, axes: dict[str, Axis]) -> Counter[str]:
    async def owners() -> Counter[str]:
        async with FleetLog(settings.log, "livebode demo") as log:
            return Counter(one["owner"] for one in (await fleet_status(log, axes))["partitions"])

    return asyncio.run(owners())


def _shares(settings: FleetSettings, axes: dict[str, Axis]) -> str:
    owners = _owners(settings, axes)
    return f"partitions of each worker now: {', '.join(str(count) for _, count in sorted(owners.items()))}"


def _drain(coordinator: FleetCoordinator, settings: FleetSettings, axes: dict[str, Axis]) -> None:
    """Wait until the owners have processed what the log has."""
    until = time.monotonic() + _DRAIN_S
    while time.monotonic() < until:
        _wait(coordinator, 1.5)
        if not asyncio.run(_waiting(settings, axes)):
            return


async def _create_streams(settings: FleetSettings) -> None:
    async with FleetLog(settings.log, "livebode demo") as log:
        await log.create_streams()


async def _waiting(settings: FleetSettings, axes: dict[str, Axis]) -> int:
    async with FleetLog(settings.log, "livebode demo") as log:
        return int((await fleet_status(log, axes))["log"]["waiting"])


async def _longest(settings: FleetSettings, from_s: float) -> float:
    async with FleetLog(settings.log, "livebode demo") as log:
        return max((await silences(log, from_s, time.time())).values(), default=0.0)


async def _check(settings: FleetSettings, axes: dict[str, Axis]) -> CheckResult:
    async with FleetLog(settings.log, "livebode check") as log:
        return await check_results(log, axes)
