"""`livebode fleet setup`: the configuration of nats-server, at the log or at a site, and the keys of users."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli import Json, check_use
from livebode.core import UsageError

if TYPE_CHECKING:
    from livebode_plant.fleet.fleet_settings import FleetSettings

_USERS = ("edge:PATH", "fleet", "view")


def setup_command(
    context: typer.Context,
    fleet: Annotated[
        Path | None, typer.Argument(metavar="FLEET.TOML", help="Configuration of the fleet; not for --user.")
    ] = None,
    store: Annotated[Path, typer.Option(metavar="DIR", help="Directory of the log.")] = Path("log"),
    host: Annotated[str, typer.Option(help="Address at which the server listens.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port at which the server listens.")] = 4222,
    member: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Which server of server.cluster it is, from 1 on.")
    ] = None,
    leaf: Annotated[
        bool, typer.Option("--leaf", help="Print that of a leaf node instead: the one way of a site to the log.")
    ] = False,
    user: Annotated[
        str | None,
        typer.Option(
            metavar="|".join(_USERS),
            help="Make the key of a user instead: of an edge with the path of its axes, such as edge:Graz/2/press, of "
            "the workers and commands, or of a viewer.",
        ),
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory of the key of --user.")] = Path(),
    as_json: Json = False,
) -> None:
    """Print the configuration of nats-server for a fleet, or of a leaf node at a site; or make the key of a user.

    It has store, limits, users and the partitions of axes, public keys and paths, no secrets. After a change of users
    or axes, write it again, and the server reads it at `nats-server --signal reload`. With --user, the secret part of
    the key is a new file that only this user of the computer may read, and the public part is printed as a line for
    [users] of fleet.toml.
    """
    from livebode.records import to_json

    if (fleet is None) == (user is None):
        raise UsageError(
            "options",
            "give either FLEET.toml, for the configuration of a server, or --user, for the key of a user",
            f"the users are {', '.join(_USERS)}",
            options=["--user"],
        )
    check_use(context, "--user USER", ("--out",))
    if fleet is None:
        _write_key(user or "", out, as_json=as_json)
        return
    from livebode_plant.fleet.fleet_settings import FleetSettings
    from livebode_plant.fleet.server_config import leaf_configuration

    settings = FleetSettings.read(fleet)
    text = (
        leaf_configuration(settings, host=host, port=port)
        if leaf
        else _server(settings, store, member, host=host, port=port)
    )
    print(to_json({"configuration": text}) + "\n" if as_json else text, end="")


def _server(settings: FleetSettings, store: Path, member: int | None, *, host: str, port: int) -> str:
    from livebode_plant.fleet.log import check_store
    from livebode_plant.fleet.server_config import cluster_member, server_access, server_configuration

    check_store(store, settings.partitions)
    limit = round((settings.log.size_gb + settings.log.results_gb) * 1.1e9)
    return server_configuration(
        store.absolute(), partitions=settings.partitions, port=port, host=host, file_bytes_max=limit,
        access=server_access(settings, host), member=cluster_member(settings, member),
    )  # fmt: skip


def _write_key(user: str, folder: Path, *, as_json: bool) -> None:
    import json
    from urllib.parse import quote

    from livebode.records import to_json
    from livebode_plant.fleet.connection import write_credentials

    name, _, path = user.partition(":")
    if name not in ("edge", "fleet", "view") or (name == "edge") != bool(path):
        raise UsageError(
            "not-one-of",
            f"--user={user!r} is not a user of a fleet",
            f"choose {', '.join(_USERS)}; an edge needs the path of its axes, such as edge:Graz",
            argument="--user",
            value=user,
            allowed=list(_USERS),
        )
    file = folder / f"{name}{'-' if path else ''}{quote(path, safe=' ')}.nkey"
    public = write_credentials(file)
    if as_json:
        print(to_json({"user": name, "path": path, "file": str(file), "public": public}))
        return
    section, key = ("users.edges", json.dumps(path, ensure_ascii=False)) if path else ("users", name)
    print(f'{file}: the secret key, for log.credentials of this user\n\n[{section}]\n{key} = ["{public}"]')
