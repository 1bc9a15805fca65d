"""FleetCoordinator: the worker processes of a fleet on this computer, and which partitions each of them owns."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from livebode.core import FleetError
from livebode_plant.fleet.fleet_settings import FleetSettings
from livebode_plant.fleet.worker_process import END_S, WorkerProcess, import_early

if TYPE_CHECKING:
    from livebode.configuration import Axis

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
