"""ClusterMember: one of several servers that store the same log."""

from __future__ import annotations

import json
from dataclasses import dataclass

from livebode.core import FleetError, on_loopback
from livebode_plant.fleet.fleet_settings import FleetSettings, ServerSection


@dataclass(frozen=True)
class ClusterMember:
    """A server of the cluster in `server.cluster`, by its number there, which begins with 1."""

    server: ServerSection
    number: int

    def lines(self, host: str) -> list[str]:
        """Lines of the configuration of nats-server, which listens at `host` for the others."""
        files = {"cert_file": self.server.certificate, "key_file": self.server.key, "ca_file": self.server.authority}
        tls = [f"    {name}: {json.dumps(str(path.absolute()))}" for name, path in files.items() if path is not None]
        scheme = "tls" if tls else "nats"
        port = self.server.cluster[self.number - 1].rpartition(":")[2]
        return [
            f"server_name: log-{self.number}",
            "cluster {",
            "  name: livebode",
            f"  listen: {json.dumps(f'{host}:{port}')}",
            f"  routes: {json.dumps([f'{scheme}://{address}' for address in self.server.cluster])}",
            "  no_advertise: true",
            *(["  tls {", *tls, "  }"] if tls else []),
            "}",
        ]


def cluster_member(settings: FleetSettings, number: int | None) -> ClusterMember | None:
    """The member with this number; None if the fleet has one server.

    Raises
    ------
    FleetError
        If there is no such member, or fewer servers than copies, or if others could join the cluster: off the loopback
        it needs TLS.
    """
    server, replicas = settings.server, settings.log.replicas
    if replicas > max(1, len(server.cluster)):
        raise FleetError(
            "servers-missing",
            f"log.replicas = {replicas} needs {replicas} servers, and server.cluster has {len(server.cluster)}",
            "list the address HOST:PORT of every server in server.cluster",
            replicas=replicas,
        )
    if not server.cluster:
        return None
    if number is None or number > len(server.cluster):
        raise FleetError(
            "member-unknown",
            f"server.cluster has {len(server.cluster)} servers, and it is not known which of them this one is",
            f"give its number there, member = 1 to {len(server.cluster)}",
            servers=len(server.cluster),
        )
    complete = server.certificate and server.key and server.authority
    if not complete and not all(on_loopback(address.rpartition(":")[0]) for address in server.cluster):
        raise FleetError(
            "cluster-open",
            "everyone who reaches the servers of the cluster could join it",
            "set server.certificate, server.key and server.authority",
        )
    return ClusterMember(server, number)
