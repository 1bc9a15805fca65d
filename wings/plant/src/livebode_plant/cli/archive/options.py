"""Arguments that several subcommands of `livebode archive` share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Archive = Annotated[Path, typer.Argument(metavar="ARCHIVE", help="Description of the archive: archive.toml.")]
LakeOf = Annotated[str, typer.Argument(metavar="ARCHIVE", help="archive.toml, or the directory or URL of its lake.")]
