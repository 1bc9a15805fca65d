"""`livebode fleet credentials`: the key of an edge, of the workers or of a viewer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from livebode.cli import Json


def credentials_command(
    path: Annotated[
        str, typer.Argument(metavar="[PATH]", help="Of an edge: path of its axes, such as Graz or Graz/2/press.")
    ] = "",
    user: Annotated[
        Literal["edge", "fleet", "view"], typer.Option(help="An edge, the workers and commands, or a viewer.")
    ] = "edge",
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory of the key.")] = Path(),
    as_json: Json = False,
) -> None:
    """Make the key of a user: the secret part as a new file, the public part as a line for [users] of fleet.toml.

    Only this user of the computer may read the file. The secret is not printed.
    """
    import json
    from urllib.parse import quote

    from livebode.core import UsageError
    from livebode.records import to_json
    from livebode_plant.fleet.credentials import write_credentials

    if (user == "edge") != bool(path):
        raise UsageError(
            "conflict",
            "an edge needs the path of its axes, and other users have none",
            "give a path, or --user fleet or --user view",
        )
    file = out / f"{user}{'-' if path else ''}{quote(path, safe=' ')}.nkey"
    public = write_credentials(file)
    if as_json:
        print(to_json({"user": user, "path": path, "file": str(file), "public": public}))
        return
    section, key = ("users.edges", json.dumps(path, ensure_ascii=False)) if path else ("users", user)
    print(f'{file}: the secret key, for log.credentials of this user\n\n[{section}]\n{key} = ["{public}"]')
