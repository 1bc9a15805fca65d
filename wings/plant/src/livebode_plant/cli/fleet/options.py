"""Options that the subcommands of `livebode fleet` share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Fleet = Annotated[Path, typer.Argument(metavar="FLEET.TOML", help="Configuration of the fleet.")]
