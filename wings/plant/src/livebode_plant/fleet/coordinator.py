"""FleetCoordinator: the worker processes of a fleet on this computer, and which partitions each of them owns.

Processes are forked from a server that has imported what they need, so that another worker computes at once.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

from livebode.core import FleetError
from livebode.dataclass import dataclass

if TYPE_CHECKING:
    from livebode.configuration import Axis
    from livebode_plant.fleet.fleet_settings import FleetSettings, LogSection

SILENT_S = 4.0
"""Time without a sign of life after which a worker is frozen."""
_START_S = 30.0
"""Time until its first one: on a busy computer the imports take that long."""
_SIGN_S = 0.5
END_S = 5.0
"""Time that a worker has to store its results and states when it is to end."""
ORPHAN_S = 60.0
"""Longest time for which a worker continues without its coordinator."""
_IMPORTED = ["livebode_plant.fleet.worker", "nats.aio.client", "scipy.optimize"]
"""By name, so that a coordinator does not import it itself."""
_METHOD = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
_CONTEXT: Any = multiprocessing.get_context(_METHOD)


def import_early() -> None:
    """Let the imports of the workers begin in the server, where the system has one; the caller need not wait."""
    if _METHOD == "forkserver":
        from multiprocessing.forkserver import ensure_running

        _CONTEXT.set_forkserver_preload(_IMPORTED)
        ensure_running()


class WorkerProcess:
    """A process that owns partitions from now on.

    Parameters
    ----------
    log
        Of the fleet.
    axes
        Configurations by key.
    numbers
        Of the partitions.
    """

    def __init__(self, log: LogSection, axes: Mapping[str, Axis], numbers: list[int]) -> None:
        self._sign_s = _CONTEXT.RawValue("d", time.monotonic() + _START_S - SILENT_S)
        self._process = _CONTEXT.Process(target=_work, args=(log, axes, numbers, self._sign_s), daemon=True)
        self._process.start()

    @property
    def pid(self) -> int:
        """Number of the process."""
        return int(self._process.pid)

    @property
    def alive(self) -> bool:
        """Whether it runs and is not frozen."""
        return not self.trouble

    @property
    def trouble(self) -> str:
        """What is wrong with it, as a verb; empty while it works."""
        if not self._process.is_alive():
            return f"ended with exit code {self._process.exitcode}"
        silent_s = time.monotonic() - self._sign_s.value
        return f"gave no sign of life for {silent_s:.0f} s" if silent_s > SILENT_S else ""

    def end(self) -> None:
        """Let it store its results and states, and end."""
        self._process.terminate()

    def wait_or_kill(self, timeout_s: float) -> None:
        """Wait for its end, and kill it after that time."""
        self._process.join(max(0.0, timeout_s))
        self.kill()

    def kill(self) -> None:
        """End it at once, as far as the system can."""
        self._process.kill()


def _work(log: LogSection, axes: Mapping[str, Axis], numbers: list[int], sign_s: Any) -> None:
    """Own partitions until SIGTERM, until others have claimed all, or until the coordinator is away too long."""
    from livebode_plant.fleet.worker import own_partitions

    stop = threading.Event()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the coordinator
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    logging.getLogger("livebode").addHandler(_warnings())
    threading.Thread(target=_live, args=(sign_s, stop), daemon=True).start()
    own_partitions(log, axes, numbers, stop)


def _warnings() -> logging.Handler:
    """What prints warnings on standard error."""
    handler = logging.StreamHandler()
    handler.setLevel(logging.WARNING)
    return handler


def _live(sign_s: Any, stop: threading.Event) -> None:
    """Show life until the end, which does not wait for a log that is away: what is not stored is computed again."""
    _show_life(sign_s, stop)
    time.sleep(END_S)
    os._exit(0)


def _show_life(sign_s: Any, stop: threading.Event) -> None:
    parent, seen_s = multiprocessing.parent_process(), time.monotonic()
    while not stop.wait(_SIGN_S):
        sign_s.value = now_s = time.monotonic()
        if parent is not None and parent.is_alive():
            seen_s = now_s
        elif now_s - seen_s > ORPHAN_S:
            stop.set()


_AGAIN_S = 1.0
"""Least time between two starts of workers of the same partitions."""
_logger = logging.getLogger(f"livebode.{__name__}")


@dataclass
class _Place:
    """The worker of some partitions, and when it was started."""

    numbers: list[int]
    worker: WorkerProcess
    started_s: float


class FleetCoordinator:
    """Starts workers on this computer, and another one where one ends or freezes; a context manager.

    Worker i of n owns the partitions i, i + n, i + 2 n … for as long as it lives. None of this has to be right for the
    results: a partition that two workers own for a while is fenced by the log.

    Workers outlive a coordinator that is killed, for `ORPHAN_S` at most: they own their partitions until the workers
    of the next coordinator claim them.

    Parameters
    ----------
    settings
        Of the fleet.
    axes
        Configurations by key.

    Raises
    ------
    FleetError
        If no process can be started.
    """

    def __init__(self, settings: FleetSettings, axes: Mapping[str, Axis]) -> None:
        self._settings, self._axes = settings, dict(axes)

    def __enter__(self) -> Self:
        import_early()
        count = min(self._settings.workers, self._settings.partitions)
        every = range(self._settings.partitions)
        self._places = [self._started(list(every[first::count])) for first in range(count)]
        return self

    def __exit__(self, *_: object) -> None:
        for place in self._places:
            place.worker.end()
        until_s = time.monotonic() + END_S
        for place in self._places:
            place.worker.wait_or_kill(until_s - time.monotonic())

    @property
    def workers(self) -> list[int]:
        """Numbers of the processes that are alive."""
        return [place.worker.pid for place in self._places if place.worker.alive]

    def step(self) -> None:
        """Start a worker in the place of each one that has ended or is frozen."""
        for number, place in enumerate(self._places):
            if place.worker.alive or time.monotonic() < place.started_s + _AGAIN_S:
                continue
            _logger.warning("worker %d %s; starting another one", place.worker.pid, place.worker.trouble)
            place.worker.kill()
            self._places[number] = self._started(place.numbers)

    def _started(self, numbers: list[int]) -> _Place:
        try:
            return _Place(numbers, WorkerProcess(self._settings.log, self._axes, numbers), time.monotonic())
        except (EOFError, OSError) as error:  # what forks them has ended, or cannot fork
            raise FleetError(
                "worker-not-started",
                f"no worker can be started ({error or 'the process that starts them has ended'})",
                "look into the system's log for the reason, such as too little memory or too many processes",
            ) from None
