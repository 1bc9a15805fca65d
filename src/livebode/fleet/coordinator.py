"""FleetCoordinator: Dask's scheduler and workers, and which worker owns which partition."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from livebode.configuration.axis import Axis
from livebode.core.errors import FleetError
from livebode.core.installing import not_installed
from livebode.fleet.settings import FleetSettings, LogSection
from livebode.fleet.worker import own_partitions

WORKER_TTL_S = 5
"""Silence after which Dask restarts a worker. It looks as often, and a frozen process takes some seconds to end."""
_SILENT_S = 4.0
"""Silence after which a worker gets no partitions and loses its own; a heartbeat comes each half second."""
_AGAIN_S = 1.0
_STARTS_MAX = 5
_LOST_S = 1
"""After which the cluster forgets a worker that its process has left."""
_logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Place:
    worker: str
    task: Any


class FleetCoordinator:
    """Starts workers on this computer and gives each partition to one of them; a context manager.

    Every partition is one endless task. If its worker dies or its task ends, another worker gets it; a worker that
    comes back gets some of them again. None of this has to be right for the results: a partition that two workers own
    for a while is fenced by the log.

    Parameters
    ----------
    settings
        Of the fleet.
    axes
        Configurations by key.

    Raises
    ------
    ExtraError
        If dask.distributed is not installed.
    FleetError
        If workers end again and again while they start.
    """

    def __init__(self, settings: FleetSettings, axes: Mapping[str, Axis]) -> None:
        self._settings, self._axes = settings, dict(axes)
        self._places: dict[int, _Place] = {}
        self._failed_s: dict[int, float] = {}

    def __enter__(self) -> Self:
        try:
            import dask
            from distributed import Client, LocalCluster
        except ImportError:
            raise not_installed(
                "a fleet needs dask.distributed, which is not installed", "distributed", "fleet"
            ) from None
        dask.config.set(
            {
                "distributed.scheduler.allowed-failures": 1_000_000,
                "distributed.scheduler.work-stealing": False,
                "distributed.scheduler.worker-ttl": f"{WORKER_TTL_S}s",
                "distributed.deploy.lost-worker-timeout": f"{_LOST_S}s",
            }
        )
        self._cluster = self._started(LocalCluster)
        self._client = Client(self._cluster)
        return self

    def _started(self, cluster: Any) -> Any:
        """The cluster with its workers; it ends itself where one of them ends before all have started."""
        for _ in range(_STARTS_MAX):
            try:
                return cluster(
                    n_workers=self._settings.workers,
                    threads_per_worker=self._settings.partitions,
                    host="127.0.0.1",
                    dashboard_address=None,
                    scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # else that of all schedulers
                    memory_limit=0,
                    preload=[__name__],  # imported in the first task, it would keep a slow computer from a heartbeat
                    silence_logs=logging.CRITICAL,
                )
            except RuntimeError as error:
                reason = error
                _logger.warning("a worker ended while it started (%s); starting all again", error)
        raise FleetError(
            "workers-ended",
            f"the workers ended while they started, {_STARTS_MAX} times in succession: {reason}",
            "look for the reason in the messages before this one and in the system's log, such as too little memory",
        )

    def __exit__(self, *_: object) -> None:
        self._client.close()
        self._cluster.close()

    @property
    def workers(self) -> list[str]:
        """Addresses of the workers that are alive."""
        known = self._client.scheduler_info()["workers"]
        return sorted(name for name, about in known.items() if time.time() - about["last_seen"] < _SILENT_S)

    def step(self) -> None:
        """Give partitions without an owner to workers, and one from the most loaded worker to the least loaded one."""
        if len(self._cluster.workers) < self._settings.workers:
            # What starts the process of a worker again gives up if that is killed while it starts.
            self._cluster.scale(self._settings.workers)
        workers = self.workers
        for number in range(self._settings.partitions):
            place = self._places.get(number)
            if place is not None and (place.worker not in workers or place.task.done()):
                self._lose(number, place, alive=place.worker in workers)
        loads = dict.fromkeys(workers, 0)
        for place in self._places.values():
            loads[place.worker] += 1
        for number in range(self._settings.partitions):
            if number not in self._places and loads and time.monotonic() > self._failed_s.get(number, 0.0):
                self._give(number, min(loads, key=loads.__getitem__), loads)
        if loads and max(loads.values()) - min(loads.values()) > 1:
            most = max(loads, key=loads.__getitem__)
            moved = next(number for number, place in self._places.items() if place.worker == most)
            loads[most] -= 1
            self._give(moved, min(loads, key=loads.__getitem__), loads)

    def _lose(self, number: int, place: _Place, *, alive: bool) -> None:
        if not alive:
            _logger.warning("partition %d lost its worker %s", number, place.worker)
        elif place.task.status == "error":
            _logger.error("the owner of partition %d failed: %s", number, place.task.exception())
            self._failed_s[number] = time.monotonic() + _AGAIN_S
        del self._places[number]

    def _give(self, number: int, worker: str, loads: dict[str, int]) -> None:
        """Start an owner; a former one is fenced by its claim, and ends."""
        task = self._client.submit(
            own_partition,
            self._settings.log,
            self._axes,
            number,
            workers=[worker],
            allow_other_workers=False,
            pure=False,
            key=f"partition-{number}-{time.time_ns()}",
        )
        _logger.info("partition %d is given to %s", number, worker)
        self._places[number] = _Place(worker, task)
        loads[worker] += 1


def own_partition(log: LogSection, axes: Mapping[str, Axis], number: int) -> bool:
    """The task of a worker: own a partition until another process claims it."""
    return own_partitions(log, axes, [number], threading.Event())[0]
