"""`livebode fleet server`: the configuration of nats-server."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from livebode.cli import Json
from livebode_plant.cli.fleet.options import Fleet


def server_command(
    fleet: Fleet,
    store: Annotated[Path, typer.Option(metavar="DIR", help="Directory of the log.")] = Path("log"),
    host: Annotated[str, typer.Option(help="Address at which the server listens.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port at which the server listens.")] = 4222,
    member: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Which server of server.cluster it is, from 1 on.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Print the configuration of nats-server for a fleet: store, limits, users, and the partitions of axes.

    It has public keys and paths, no secrets. After a change of users or axes, write it again, and the server
    reads it at `nats-server --signal reload`.
    """
    from livebode.records import to_json
    from livebode_plant.fleet.fleet_settings import FleetSettings
    from livebode_plant.fleet.partition_count import check_store
    from livebode_plant.fleet.server_access import server_access
    from livebode_plant.fleet.server_cluster import cluster_member
    from livebode_plant.fleet.server_config import server_configuration

    settings = FleetSettings.read(fleet)
    check_store(store, settings.partitions)
    limit = round((settings.log.size_gb + settings.log.results_gb) * 1.1e9)
    text = server_configuration(
        store.absolute(), partitions=settings.partitions, port=port, host=host, file_bytes_max=limit,
        access=server_access(settings, host), member=cluster_member(settings, member),
    )  # fmt: skip
    print(to_json({"configuration": text}) + "\n" if as_json else text, end="")
