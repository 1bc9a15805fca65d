"""Random faults of a fleet, and a check that every response is stored exactly once.

`python -m studies.fleet_faults 1000` starts a log, a coordinator with workers, and simulated axes that send in real
time. At random moments it kills a worker, freezes one and lets it continue, kills and restarts the log or the
coordinator, repeats and reorders messages, and stops the log for so long that the buffers at the edge are full. After
each round of faults all responses are computed again from the log, without interruption, and compared bit for bit. It
prints what is missing, doubled or different, whether the counted losses are exact, and for each kind of fault the
longest time without a new result in a partition.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from livebode.fleet.check import AxisCheck, CheckResult, check_results
from livebode.fleet.log import FleetLog
from livebode.fleet.message import write_message
from livebode.fleet.server import LogServer
from livebode.fleet.settings import FleetSettings
from livebode.fleet.simulated import BLOCK_S, RATE_HZ, SimulatedMachines, write_simulated_fleet
from livebode.fleet.status import fleet_status, silences, status_of
from livebode.fleet.subjects import EDGE

KINDS = ("kill", "freeze", "broker", "coordinator", "repeats", "reordering", "buffer")
TARGETS_S = {"kill": 5.0, "broker": 7.0, "freeze": 15.0, "coordinator": 15.0}
PARTITIONS, WORKERS = 4, 2
ROUND = 50
"""Faults before a check; each round has a log of its own."""
_BUFFER_BYTES = 160_000
_REPEATED = 20
_FROZEN_S = (1.0, 9.0)
_BROKER_S = 0.3
_RECOVERED_S, _RECOVERY_S_MAX = 2.0, 90.0
_DEAD_S = 1.5
"""After which a process that a fault has ended reports nothing any more."""
_COMMAND = "from livebode.cli import main; main()"


@dataclass
class Campaign:
    """What was found until now.

    Attributes
    ----------
    silence_s
        Longest time without a new result by kind.
    dropped, lost
        Samples that the edges' buffers dropped, and samples that the owners report as lost.
    """

    faults: int = 0
    total: AxisCheck = field(default_factory=AxisCheck)
    takeovers: int = 0
    dropped: int = 0
    lost: int = 0
    silence_s: dict[str, float] = field(default_factory=dict)

    @property
    def exact(self) -> bool:
        return self.total.exact and self.dropped == self.lost

    def add(self, check: CheckResult, faults: int, dropped: int, lost: int) -> None:
        """Add a round."""
        sums = {name: value + getattr(check.total, name) for name, value in vars(self.total).items()}
        self.total = AxisCheck(**sums)
        self.faults, self.takeovers = self.faults + faults, self.takeovers + check.claims - PARTITIONS
        self.dropped, self.lost = self.dropped + dropped, self.lost + lost


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


class Fleet:
    """A log, a coordinator in a process of its own, and machines; a context manager."""

    def __init__(self, folder: Path, axes: int, rng: random.Random) -> None:
        self._rng = rng
        self.server = LogServer(folder / "log", PARTITIONS)
        self._path = write_simulated_fleet(folder, self.server.url, axes=axes, partitions=PARTITIONS, workers=WORKERS)
        self.settings = FleetSettings.read(self._path)
        self.axes = self.settings.read_axes()
        self.machines = FaultyMachines(self.settings, _BUFFER_BYTES)
        self._output = (folder / "fleet.log").open("ab")

    def __enter__(self) -> Fleet:
        self.server.start()
        self._start()
        self._running = contextlib.ExitStack()
        self._running.enter_context(self.machines)
        self.recovered(0.0)
        return self

    def __exit__(self, *_: object) -> None:
        self.stop_machines()
        self._end(signal.SIGINT)
        self.server.__exit__()
        self._output.close()

    def stop_machines(self) -> None:
        """Stop the machines when the log has their messages."""
        self._running.close()

    def _start(self) -> None:
        words = [sys.executable, "-c", _COMMAND, "fleet", "run", str(self._path)]
        self._process = subprocess.Popen(words, stdout=self._output, stderr=self._output)

    def _end(self, number: int) -> None:
        self._process.send_signal(number)
        self._process.wait()

    def asked(self, question: Callable[[FleetLog], Any]) -> Any:
        """The answer of the log to a question."""

        async def ask() -> Any:
            async with FleetLog(self.settings.log, "faults") as log:
                return await question(log)

        return asyncio.run(ask())

    def recovered(self, since_s: float) -> None:
        """Wait until every partition has an owner that has reported after a moment and is not behind."""
        until = time.monotonic() + _RECOVERY_S_MAX
        while not self.asked(lambda log: self._current(log, since_s)):
            if time.monotonic() > until:
                raise TimeoutError(f"a partition is behind for {_RECOVERY_S_MAX:g} s")
            time.sleep(0.25)

    async def _current(self, log: FleetLog, since_s: float) -> bool:
        found = [await status_of(log, number) for number in range(PARTITIONS)]
        return all(one is not None and one["at_s"] > since_s and one["lag_s"] < _RECOVERED_S for one in found)

    def fault(self, kind: str) -> None:
        """Make a fault happen."""
        getattr(self, f"_{kind}")()

    def _worker(self) -> int:
        about = self.asked(lambda log: status_of(log, self._rng.randrange(PARTITIONS)))
        return int(about["owner"].rpartition(":")[2])

    def _kill(self) -> None:
        with contextlib.suppress(ProcessLookupError):  # the owner of a moment ago
            os.kill(self._worker(), signal.SIGKILL)

    def _freeze(self) -> None:
        with contextlib.suppress(ProcessLookupError):
            worker = self._worker()
            os.kill(worker, signal.SIGSTOP)
            time.sleep(self._rng.uniform(*_FROZEN_S))
            os.kill(worker, signal.SIGCONT)

    def _broker(self) -> None:
        self.server.kill()
        time.sleep(_BROKER_S)
        self.server.start()

    def _coordinator(self) -> None:
        self._end(signal.SIGKILL)
        self._start()

    def _repeats(self) -> None:
        async def repeat(log: FleetLog) -> None:
            for axis, key in enumerate(self.machines.keys):
                for number in range(max(0, self.machines.sent - _REPEATED), self.machines.sent - 1):
                    # Without an identity, as after more time than the log remembers them.
                    await log.append(f"{EDGE}.{key}", write_message(self.machines.batch(axis, number)))

        self.asked(repeat)

    def _reordering(self) -> None:
        self.machines.swapped = 5
        time.sleep(12 * BLOCK_S)

    def _buffer(self) -> None:
        dropped = self.machines.dropped
        self.server.kill()
        while self.machines.dropped == dropped:
            time.sleep(BLOCK_S)
        self.server.start()


def campaign(faults: int, *, axes: int, kinds: tuple[str, ...], seed: int) -> Campaign:
    """Make faults happen, in rounds, and check after each round."""
    found, rng = Campaign(), random.Random(seed)
    while found.faults < faults:
        chosen = [kinds[number % len(kinds)] for number in range(min(ROUND, faults - found.faults))]
        rng.shuffle(chosen)
        with tempfile.TemporaryDirectory() as folder, Fleet(Path(folder), axes, rng) as fleet:
            for kind in chosen:
                _measure(fleet, kind, rng, found)
            _finish(fleet, len(chosen), found)
    return found


def _measure(fleet: Fleet, kind: str, rng: random.Random, found: Campaign) -> None:
    time.sleep(rng.uniform(1.0, 3.0))
    began_s = time.time()
    fleet.fault(kind)
    fleet.recovered(time.time() + _DEAD_S)
    time.sleep(_DEAD_S)
    longest = fleet.asked(lambda log: silences(log, began_s, time.time()))
    found.silence_s[kind] = max([found.silence_s.get(kind, 0.0), *longest.values()])


def _finish(fleet: Fleet, faults: int, found: Campaign) -> None:
    """Stop the machines, wait until everything is processed, and check."""
    fleet.stop_machines()
    status = _processed(fleet)
    lost = sum(axis["lost"] for axis in status["axes"])
    check = fleet.asked(lambda log: check_results(log, fleet.axes))
    found.add(check, faults, round(fleet.machines.dropped * BLOCK_S * RATE_HZ), lost)


def _processed(fleet: Fleet) -> dict[str, Any]:
    """The state of the fleet when nothing waits."""
    while True:
        time.sleep(2.0)
        status: dict[str, Any] = fleet.asked(lambda log: fleet_status(log, fleet.axes))
        if not status["log"]["waiting"]:
            return status


def main() -> None:
    """Run the campaign that the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m studies.fleet_faults", description=__doc__)
    parser.add_argument("faults", type=int, nargs="?", default=1000)
    parser.add_argument("--axes", type=int, default=6)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", default=",".join(KINDS), help="of faults, joined by commas")
    asked = parser.parse_args()
    found = campaign(asked.faults, axes=asked.axes, kinds=tuple(asked.kinds.split(",")), seed=asked.seed)
    total = found.total
    print(f"{found.faults} faults, {found.takeovers} takeovers, {total.responses:,} responses of {asked.axes} axes")
    print(f"missing {total.missing}, doubled {total.doubled}, different {total.different + total.unexpected}")
    print(f"samples dropped by full buffers {found.dropped:,}, reported as lost {found.lost:,}")
    for kind, longest in sorted(found.silence_s.items()):
        target = TARGETS_S.get(kind)
        met = "" if target is None else f", target ≤ {target:g} s: {'met' if longest <= target else 'missed'}"
        print(f"longest silence, {kind:<12}{longest:6.1f} s{met}")
    sys.exit(not found.exact)


if __name__ == "__main__":
    main()
