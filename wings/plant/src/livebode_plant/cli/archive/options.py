"""The argument of the subcommands of `livebode archive`."""

from __future__ import annotations

from typing import Annotated

import typer

LakeOf = Annotated[str, typer.Argument(metavar="ARCHIVE", help="archive.toml, or the directory or URL of its lake.")]
