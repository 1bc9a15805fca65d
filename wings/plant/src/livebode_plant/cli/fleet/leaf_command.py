"""`livebode fleet leaf`: the configuration of nats-server at a site."""

from __future__ import annotations

from typing import Annotated

import typer

from livebode.cli import Json
from livebode_plant.cli.fleet.options import Fleet


def leaf_command(
    fleet: Fleet,
    host: Annotated[str, typer.Option(help="Address at which the server listens.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port at which the server listens.")] = 4222,
    as_json: Json = False,
) -> None:
    """Write the configuration of nats-server as a leaf node: the one way of a site to the log.

    It has public keys and paths, no secrets.
    """
    from livebode.records import to_json
    from livebode_plant.fleet.fleet_settings import FleetSettings
    from livebode_plant.fleet.server_config import leaf_configuration

    text = leaf_configuration(FleetSettings.read(fleet), host=host, port=port)
    print(to_json({"configuration": text}) + "\n" if as_json else text, end="")
