"""FaultyFleet: log, coordinator, workers and simulated axes that can be killed, frozen or disturbed."""

from __future__ import annotations

import asyncio
import contextlib
import random
import sys
import threading
import time
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Any

import psutil

from livebode.core import FleetError
from livebode_plant.fleet.demo import BLOCK_S, RATE_HZ, SimulatedMachines, write_simulated_fleet
from livebode_plant.fleet.fleet_settings import FleetSettings
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.message import read_message
from livebode_plant.fleet.reader import stored_messages
from livebode_plant.fleet.replay import CheckResult, check_results
from livebode_plant.fleet.result_message import ResultMessage
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.status import fleet_status, status_of
from livebode_plant.fleet.subjects import EDGE, LOG, LOG_STREAM, RESULT_STREAM, RESULTS, key_of

PARTITIONS, WORKERS = 4, 2
_BUFFER_BYTES, _SMALL_BUFFER_BYTES = 1 << 30, 100_000
"""Of an axis: more than a round sends, and what a log that is stopped for half a minute fills."""
_REPEATED = 100
"""Messages of the log that are sent again."""
_SWAPPED = 5
LATE_MAX = round(_SWAPPED * BLOCK_S * RATE_HZ)
"""Samples of an axis that a reordering can make late: after a gap a message is not waited for any more."""
_FROZEN_S = (1.0, 9.0)
_BROKER_S = 0.3
_REPORTED_S = 1.0
"""From the end of the messages to the report that counts."""
_STEP_S, _RECOVERY_S_MAX, _WORKER_S_MAX = 0.2, 600.0, 120.0
_COMMAND = "from livebode.cli import main; main()"
_SERVER = "multiprocessing.forkserver"
"""The process from which the coordinator forks its workers."""


class FaultyMachines(SimulatedMachines):
    """Machines whose messages can be sent in another order."""

    swapped = 0
    """Pairs of messages that are still to be swapped."""
    _late: int | None = None

    def _take_batches(self, number: int) -> None:
        if self._late is not None:
            super()._take_batches(number)
            super()._take_batches(self._late)
            self._late = None
        elif self.swapped > 0:
            self.swapped, self._late = self.swapped - 1, number
        else:
            super()._take_batches(number)


class FaultyFleet:
    """A fleet in a directory; a context manager. Several faults may happen at once, each in a thread.

    As a service manager does, it restarts the coordinator if that ends by itself. Only a fleet that is disturbed by
    `buffer` has small buffers: in others they never drop a message, however long the log is away on a busy computer.
    """

    def __init__(self, folder: Path, axes: int, kinds: Collection[str], rng: random.Random) -> None:
        self._rng = rng
        self._server = LogServer(folder / "log", PARTITIONS)
        self._path = write_simulated_fleet(folder, self._server.url, axes=axes, partitions=PARTITIONS, workers=WORKERS)
        self._settings = FleetSettings.read(self._path)
        self._axes = self._settings.read_axes()
        buffer_bytes = _SMALL_BUFFER_BYTES if "buffer" in kinds else _BUFFER_BYTES
        self._machines = FaultyMachines(self._settings, buffer_bytes)
        self._output = (folder / "fleet.log").open("ab")
        self._serving, self._coordinating, self._choosing = threading.Lock(), threading.Lock(), threading.Lock()
        self._frozen: set[psutil.Process] = set()
        self._workers: set[psutil.Process] = set()

    def __enter__(self) -> FaultyFleet:
        self._server.start()
        self._start()
        self._running = contextlib.ExitStack()
        self._running.enter_context(self._machines)
        self.settled()
        return self

    def __exit__(self, *_: object) -> None:
        self._running.close()
        self._process.terminate()
        with contextlib.suppress(psutil.TimeoutExpired):
            self._process.wait(10)
        for process in [*self._children(), self._process, *self._workers]:
            with contextlib.suppress(psutil.Error):
                process.kill()
        self._process.wait()
        self._server.__exit__()
        self._output.close()

    def finished(self) -> tuple[CheckResult, int, int]:
        """Stop the machines; when everything is processed, the check, and the samples that were dropped and are lost.

        Samples that were dropped before the log had the first ones of their axis are not counted: nobody misses them.
        """
        self._running.close()
        while True:
            self._restart_if_ended()
            status: dict[str, Any] = self.asked(lambda log: fleet_status(log, self._axes))
            if not status["log"]["waiting"] and self._stored(self._sent()):
                break
            time.sleep(_STEP_S)
        self._reported_since(time.time() + _REPORTED_S)  # the last messages give no response, but the owners know them
        status = self.asked(lambda log: fleet_status(log, self._axes))
        lost = sum(axis["lost"] for axis in status["axes"])
        dropped = round(self._machines.dropped * BLOCK_S * RATE_HZ) - self.asked(_before_the_log)
        return self.asked(lambda log: check_results(log, self._axes)), dropped, lost

    def _reported_since(self, since_s: float) -> None:
        """Wait until the owner of each partition has reported after a moment, seconds since 1970."""

        async def reported(log: FleetLog) -> bool:
            found = [await status_of(log, number) for number in range(PARTITIONS)]
            return all(about is not None and about["at_s"] > since_s for about in found)

        while not self.asked(reported):
            self._restart_if_ended()
            time.sleep(_STEP_S)

    def asked(self, question: Callable[[FleetLog], Any]) -> Any:
        """The answer of the log to a question."""

        async def ask() -> Any:
            async with FleetLog(self._settings.log, "faults") as log:
                return await question(log)

        until = time.monotonic() + _RECOVERY_S_MAX
        while True:
            try:
                return asyncio.run(ask())
            except FleetError:
                if time.monotonic() > until:
                    raise

    def recovered(self) -> None:
        """Wait until each partition has stored the results of messages that were sent after now, twice in succession.

        Twice, because a worker that was frozen may store results for a moment before it is replaced.
        """
        until = time.monotonic() + _RECOVERY_S_MAX
        for _ in range(2):
            sent: dict[int, int] = {}
            while not sent or not self._stored(sent):
                sent = sent or self._sent()
                self._restart_if_ended()
                if time.monotonic() > until:
                    raise TimeoutError(f"a partition is behind for {_RECOVERY_S_MAX:g} s")
                time.sleep(_STEP_S)

    def settled(self) -> None:
        """Wait until all workers own partitions, so that the next fault happens alone."""
        until = time.monotonic() + _RECOVERY_S_MAX
        while len(self._owners()) < WORKERS:
            if time.monotonic() > until:
                raise TimeoutError(f"a worker owns nothing for {_RECOVERY_S_MAX:g} s")
            time.sleep(_STEP_S)
        self.recovered()

    def _owners(self) -> set[str]:
        async def owners(log: FleetLog) -> set[str]:
            found = [await status_of(log, number) for number in range(PARTITIONS)]
            return {about["owner"] for about in found if about is not None}

        found: set[str] = self.asked(owners)
        return {owner for owner in found if psutil.pid_exists(int(owner.rpartition(":")[2]))}

    def _sent(self) -> dict[int, int]:
        """Number of the newest message of each partition in the log."""

        async def newest(log: FleetLog) -> dict[int, int]:
            found: dict[int, int] = {}
            # One by one: nats-server 2.9.10 can end at the request for the newest message of several subjects.
            for subject in (await log.extent(LOG_STREAM, f"{LOG}.>")).subjects:
                number, last = int(subject.split(".")[1]), await log.last(LOG_STREAM, subject)
                found[number] = max(found.get(number, 0), last.number if last else 0)
            return found

        found: dict[int, int] = self.asked(newest)
        return found

    def _stored(self, sent: dict[int, int]) -> bool:
        async def stored(log: FleetLog) -> bool:
            for number, wanted in sent.items():
                last = await log.last(RESULT_STREAM, f"{RESULTS}.{number}")
                if last is None or ResultMessage.from_bytes(last.data).through < wanted:
                    return False
            return True

        return bool(self.asked(stored))

    def _start(self) -> None:
        words = [sys.executable, "-c", _COMMAND, "fleet", "run", str(self._path)]
        self._process = psutil.Popen(words, stdout=self._output, stderr=self._output)

    def _restart_if_ended(self) -> None:
        with self._coordinating:
            if self._process.poll() is not None:
                self._start()

    def _children(self) -> list[psutil.Process]:
        """Workers of the coordinator that are alive."""
        found = []
        with contextlib.suppress(psutil.NoSuchProcess):
            for child in self._process.children():
                with contextlib.suppress(psutil.NoSuchProcess):  # it has just ended
                    if _SERVER in " ".join(child.cmdline()):
                        found += child.children()
        self._workers.update(found)
        return found

    def _victim(self, *, but: Sequence[psutil.Process] = ()) -> psutil.Process:
        until = time.monotonic() + _WORKER_S_MAX
        while not (found := [worker for worker in self._children() if worker not in but]):
            if time.monotonic() > until:
                raise TimeoutError(f"there is no worker for {_WORKER_S_MAX:g} s")
            self._restart_if_ended()
            time.sleep(_STEP_S)
        return self._rng.choice(found)

    def fault(self, kind: str) -> None:
        """Make a fault happen; returns when it is over."""
        getattr(self, f"_{kind}")()

    def _kill(self) -> None:
        while True:
            with contextlib.suppress(psutil.NoSuchProcess):  # it has just ended: another one
                return self._victim().kill()

    def _freeze(self) -> None:
        with self._choosing:
            worker = self._victim(but=list(self._frozen))
            self._frozen.add(worker)
        with contextlib.suppress(psutil.NoSuchProcess):
            worker.suspend()
            time.sleep(self._rng.uniform(*_FROZEN_S))
            worker.resume()
        self._frozen.discard(worker)

    def _broker(self) -> None:
        with self._serving:
            self._server.kill()
            time.sleep(_BROKER_S)
            self._server.start()

    def _coordinator(self) -> None:
        """Kill the coordinator: its workers continue until those of the next one claim their partitions."""
        self._restart(with_workers=False)

    def _service(self) -> None:
        """Kill the coordinator and its workers, as a service manager does that kills all processes of a service."""
        self._restart(with_workers=True)

    def _restart(self, *, with_workers: bool) -> None:
        with self._coordinating:
            workers = self._children()
            for process in [self._process, *(workers if with_workers else [])]:
                with contextlib.suppress(psutil.NoSuchProcess):
                    process.kill()
            self._process.wait()
            self._start()
        # Those that live end when others have claimed their partitions; a frozen one when it continues.
        until = time.monotonic() + _WORKER_S_MAX
        while any(map(_alive, set(workers) - self._frozen)) and time.monotonic() < until:
            time.sleep(_STEP_S)

    def _repeats(self) -> None:
        """Send messages again that the log has, without their identity: as later than it remembers them."""

        async def repeat(log: FleetLog) -> None:
            last = (await log.extent(LOG_STREAM)).last
            async for message in stored_messages(log, LOG_STREAM, f"{LOG}.>", last, max(1, last - _REPEATED)):
                await log.append(f"{EDGE}.{key_of(message.subject)}", message.data)

        with self._serving:
            pass  # a new connection needs a server; from here on it may be killed again
        self.asked(repeat)

    def _reordering(self) -> None:
        self._machines.swapped += _SWAPPED
        time.sleep(2 * (_SWAPPED + 1) * BLOCK_S)

    def _buffer(self) -> None:
        with self._serving:
            dropped = self._machines.dropped
            self._server.kill()
            while self._machines.dropped == dropped:
                time.sleep(BLOCK_S)
            self._server.start()


async def _before_the_log(log: FleetLog) -> int:
    """Samples before the first ones that the log has, of all axes."""
    first = 0
    for subject in (await log.extent(LOG_STREAM, f"{LOG}.>")).subjects:
        number = await log.following(LOG_STREAM, subject, 1)
        assert number is not None
        async for message in stored_messages(log, LOG_STREAM, subject, number, number):
            first += read_message(message.data, message.stored_s).first_sample
    return first


def _alive(process: psutil.Process) -> bool:
    """Whether it runs; one that has ended and that nobody waits for does not."""
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
