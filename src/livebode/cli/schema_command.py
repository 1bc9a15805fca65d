"""`livebode schema`: JSON Schema of the files that livebode reads, for editors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.options import Json
from livebode.core import UsageError


def schema_command(
    file: Annotated[
        str,
        typer.Argument(
            metavar="axis|experiment|matrix-experiment|archive",
            help="The file: axis.toml, experiment.toml, that of a machine with several motors, or archive.toml.",
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File to write. \\[default: standard output]")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    as_json: Json = False,
) -> None:
    """Print the JSON Schema of axis.toml, experiment.toml or archive.toml: an editor uses it to complete and check
    the keys.

    The first line of the TOML file names the schema for the editor: `#:schema ./axis.schema.json`.
    """
    from livebode import export
    from livebode.plugins import loaded, named
    from livebode.records import to_json

    files = named("files")
    if file not in files:
        raise UsageError(
            "not-one-of",
            f"there is no schema of {file!r}",
            f"choose {' or '.join(files)}",
            argument="file",
            value=file,
            allowed=list(files),
        )
    text = to_json(loaded(files[file].schema)(), indent=2)
    if out is None:
        print(text)
        return
    export.save(out, lambda path: path.write_text(text + "\n", encoding="utf-8"), force=force)
    print(to_json({"file": str(out)}) if as_json else out)
