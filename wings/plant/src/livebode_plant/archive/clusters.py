"""The processes of an archive as a client of Dask: on this computer, or others behind mutual TLS."""

from __future__ import annotations

import logging
import os
import signal
import threading
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

import pyarrow as pa

from livebode.core import ArchiveError, not_installed
from livebode.dataclass import dataclass
from livebode_plant.archive.archive_settings import ClusterSection

try:
    import dask
    from distributed import Client, LocalCluster, Security
    from distributed.diagnostics.plugin import WorkerPlugin
except ImportError:
    raise not_installed("Dask is not installed, and an archive needs it", "distributed", "archive") from None

_CONNECT_S = 30
_CLOSE_S = 10
_ADAPT = "2s"
_SETTINGS = {
    # The first death of a worker ends the tasks that it had; the archive tries each of their recordings again.
    "distributed.scheduler.allowed-failures": 0,
    "distributed.scheduler.work-stealing": False,
    # A computer that is switched off closes no connection; its tasks go to others after this time.
    "distributed.scheduler.worker-ttl": "2 minutes",
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": 0.95,
    # What Dask measures of itself several times a second takes processor time from the tasks.
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "2s",
    "distributed.scheduler.active-memory-manager.start": False,
    # A scheduler by SSH whose coordinator was killed ends by itself, and its workers with it.
    "distributed.scheduler.idle-timeout": "10 minutes",
    # Events of the scheduler, which nobody reads, grow with the number of tasks.
    "distributed.admin.low-level-log-length": 100,
}


_ENVIRONMENT = {
    # With a pool of its own, Arrow could not use what NumPy has freed. Dask's own threshold returns memory so often
    # that tracking takes a third longer.
    "ARROW_DEFAULT_MEMORY_POOL": "system",
    "MALLOC_TRIM_THRESHOLD_": str(8 << 20),
    "MALLOC_MMAP_THRESHOLD_": str(1 << 20),
}


def _environment() -> dict[str, str]:
    """Environment of each worker: fits on different processors differ in the last digits if routines differ."""
    same = os.environ.get("OPENBLAS_CORETYPE")
    return _ENVIRONMENT | ({"OPENBLAS_CORETYPE": same} if same else {})


class QuietWorker(WorkerPlugin):  # type: ignore[misc]
    """A worker uses one core; Ctrl-C is for the coordinator; a damaged file's messages are not for the terminal."""

    def setup(self, worker: Any) -> None:  # noqa: ARG002
        """Apply it to a worker's process; nothing to a worker in another program, which is a thread there."""
        if threading.current_thread() is not threading.main_thread():
            return
        pa.set_cpu_count(1)  # each worker has a core
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        warnings.simplefilter("ignore")
        logging.disable(logging.CRITICAL)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)


@dataclass(frozen=True)
class Cluster:
    """A client of Dask, and the number of its workers."""

    client: Client

    @property
    def workers(self) -> int:
        """Workers at this moment; none where the scheduler does not answer."""
        try:
            return len(self.client.scheduler_info(n_workers=-1).get("workers", ()))
        except OSError:
            return 0

    @property
    def dashboard(self) -> str | None:
        """Address of Dask's page."""
        found: str | None = self.client.dashboard_link
        return found


@contextmanager
def started(section: ClusterSection) -> Iterator[Cluster]:
    """The cluster of a configuration; its processes end with the block, those behind an address remain.

    Raises
    ------
    ArchiveError
        If its scheduler does not answer.
    ExtraError
        If a package for this kind is not installed.
    """
    with ExitStack() as stack:
        own = {f"distributed.nanny.pre-spawn-environ.{name}": value for name, value in _environment().items()}
        stack.enter_context(dask.config.set(_SETTINGS | own | _certificates(section)))
        stack.callback(logging.disable, logging.root.manager.disable)
        for name in ("distributed", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        try:
            target = section.address or stack.enter_context(_closing(_cluster(section)))
            security = Security() if section.encrypted else None
            client = stack.enter_context(
                _closing(Client(target, security=security, timeout=_CONNECT_S, set_as_default=False))
            )
            client.register_plugin(QuietWorker())
            client.wait_for_workers(1, timeout=None if section.kind == "slurm" else _CONNECT_S)
        except (OSError, TimeoutError, RuntimeError) as error:  # RuntimeError: what Dask makes of an error of SSH
            raise ArchiveError(
                "cluster-unreachable",
                f"the cluster {section.address or section.kind!r} does not answer: {error or type(error).__name__}",
                "check that its scheduler and a worker run, and that the certificates belong together",
                address=section.address,
            ) from error
        yield Cluster(client)


@contextmanager
def _closing(part: Any) -> Iterator[Any]:
    """A client or a cluster until the end of the block; what does not answer any more cannot be asked to close."""
    try:
        yield part
    finally:
        with suppress(OSError, TimeoutError, RuntimeError):
            part.close(timeout=_CLOSE_S)


def _cluster(section: ClusterSection) -> Any:
    if section.kind == "ssh":
        return _by_ssh(section)
    if section.kind == "slurm":
        return _by_slurm(section)
    return LocalCluster(
        n_workers=section.workers or os.cpu_count(),
        threads_per_worker=1,
        processes=True,
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        memory_limit=section.memory_mb * 1_000_000,
        silence_logs=logging.CRITICAL,
    )


def _by_ssh(section: ClusterSection) -> Any:
    try:
        import asyncssh  # noqa: F401 - what SSHCluster needs
        from distributed import SSHCluster
    except ImportError:
        raise not_installed("asyncssh is not installed, and a cluster by ssh needs it", "asyncssh", "ssh") from None
    each = {"nthreads": 1, "memory_limit": section.memory_mb * 1_000_000, "protocol": "tls"}
    if section.workers:
        each["n_workers"] = max(section.workers // max(len(section.hosts) - 1, 1), 1)
    return SSHCluster(
        section.hosts,
        worker_options=each,
        scheduler_options={"protocol": "tls", "port": 0, "dashboard_address": "127.0.0.1:0"},
        security=Security(),
    )


def _by_slurm(section: ClusterSection) -> Any:
    """A scheduler here and workers as jobs of Slurm, one process each; a job that ends is submitted again."""
    try:
        from dask_jobqueue import SLURMCluster
    except ImportError:
        raise not_installed("dask-jobqueue is not installed, and Slurm needs it", "dask-jobqueue", "slurm") from None
    cluster = SLURMCluster(
        queue=section.queue,
        cores=1,
        processes=1,
        memory=f"{section.memory_mb}MB",
        protocol="tls://",
        security=Security(),
        scheduler_options={"dashboard_address": "127.0.0.1:0"},
        job_script_prologue=[f"export {name}={value}" for name, value in _environment().items()],
    )
    workers = section.workers or 1
    cluster.adapt(minimum=workers, maximum=workers, interval=_ADAPT)
    return cluster


def _certificates(section: ClusterSection) -> dict[str, Any]:
    if not section.encrypted:
        return {}
    own = {"cert": str(section.certificate), "key": str(section.key)}
    each = {f"distributed.comm.tls.{role}.{name}": path for role in ("scheduler", "worker", "client")
            for name, path in own.items()}  # fmt: skip
    return each | {
        "distributed.comm.tls.ca-file": str(section.authority),
        "distributed.comm.require-encryption": True,
    }
