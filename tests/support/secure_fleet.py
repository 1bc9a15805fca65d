"""A server of a log with TLS and keys: two edges, the workers and a viewer, each with a key of its own, a leaf node."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import trustme

from livebode.configuration import Axis
from livebode_plant.fleet.connection import write_credentials
from livebode_plant.fleet.fleet_settings import LogSection, ServerSection, UsersSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.server import LogServer, free_port
from livebode_plant.fleet.server_config import ServerAccess
from livebode_plant.fleet.subjects import axis_path
from tests.support.fleet_runs import PARTITIONS, fleet_axes

LEAF = "ulm.leaf"
"""Name in the certificate of the leaf node, which may send the axis of the first edge."""


@dataclass(frozen=True)
class SecureFleet:
    """The axes, of which each of two edges has one, and the files of keys and certificates."""

    folder: Path
    server: LogServer
    axes: dict[str, Axis]
    access: ServerAccess

    @property
    def keys(self) -> tuple[str, str]:
        """Keys of the axes of the first and the second edge in the log."""
        first, second = self.axes
        return first, second

    def log(self, user: str, access: Literal["full", "view"] = "full") -> LogSection:
        """The settings of a user: "fleet", "view", "edge 0", "edge 1" or "stranger"."""
        return LogSection(
            url=self.server.url,
            credentials=self.folder / user,
            authority=self.folder / "authority.pem",
            access=access,
            size_gb=0.5,
            results_gb=0.5,
        )


@contextmanager
def secure_fleet(folder: Path) -> Iterator[SecureFleet]:
    """The fleet with a running server."""
    authority = trustme.CA()
    own = authority.issue_cert("127.0.0.1")
    authority.cert_pem.write_to_path(folder / "authority.pem")
    own.cert_chain_pems[0].write_to_path(folder / "server.pem")
    own.private_key_pem.write_to_path(folder / "server-key.pem")
    for name in (LEAF, "stranger.leaf"):
        site = authority.issue_cert(name)
        site.cert_chain_pems[0].write_to_path(folder / f"{name}.pem")
        site.private_key_pem.write_to_path(folder / f"{name}-key.pem")
    axes = fleet_axes(2)
    public = {name: write_credentials(folder / name) for name in ("fleet", "view", "edge 0", "edge 1", "stranger")}
    edges = {axis_path(key): [public[f"edge {number}"]] for number, key in enumerate(axes)}
    files = {"certificate": folder / "server.pem", "key": folder / "server-key.pem"}
    access = ServerAccess(
        ServerSection(**files, authority=folder / "authority.pem", leaf_port=free_port()),
        UsersSection(fleet=[public["fleet"]], view=[public["view"]], edges=edges, leaves={next(iter(edges)): [LEAF]}),
        list(axes),
    )
    with LogServer(folder / "log", PARTITIONS, access=access) as server:
        yield SecureFleet(folder, server, axes, access)


@contextmanager
def secure_fleet_with_streams(folder: Path) -> Iterator[SecureFleet]:
    """The fleet with a running server, whose log has its streams."""
    with secure_fleet(folder) as fleet:
        asyncio.run(_create_streams(fleet))
        yield fleet


async def _create_streams(fleet: SecureFleet) -> None:
    async with FleetLog(fleet.log("fleet"), "test") as log:
        await log.create_streams()
