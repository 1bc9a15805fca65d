"""Three servers of a log as a cluster on loopback."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from livebode_plant.fleet.fleet_settings import LogSection, ServerSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.server import LogServer, free_port
from livebode_plant.fleet.server_config import ClusterMember
from livebode_plant.fleet.subjects import LOG_STREAM
from tests.support.fleet_runs import PARTITIONS
from tests.support.peers.peer import PATIENCE_S


@dataclass(frozen=True)
class LogCluster:
    """The servers by their name, and the settings of a log with three copies."""

    servers: dict[str, LogServer]
    log: LogSection

    def leader(self, stream: str = LOG_STREAM) -> LogServer:
        """The server that answers for a stream at the moment."""

        async def name() -> str:
            async with FleetLog(self.log, "test") as log:
                while True:
                    found = (await log._repeated(lambda: log._js.stream_info(stream))).cluster
                    if found is not None and found.leader:
                        return str(found.leader)
                    await asyncio.sleep(0.1)

        return self.servers[asyncio.run(name())]


@contextmanager
def log_cluster(folder: Path) -> Iterator[LogCluster]:
    """The cluster, running, with the streams of a fleet."""
    section = ServerSection(cluster=[f"127.0.0.1:{free_port()}" for _ in range(3)])
    servers = {
        f"log-{number}": LogServer(folder / f"log-{number}", PARTITIONS, member=ClusterMember(section, number))
        for number in (1, 2, 3)
    }
    urls = ",".join(server.url for server in servers.values())
    settings = LogSection(url=urls, size_gb=0.5, results_gb=0.5, replicas=3)

    async def create() -> None:
        async with FleetLog(settings, "test") as log:
            await log.create_streams()

    with ExitStack() as stack:
        for server in servers.values():
            stack.enter_context(server)
        asyncio.run(asyncio.wait_for(create(), PATIENCE_S))  # without a majority it would wait forever
        yield LogCluster(servers, settings)
