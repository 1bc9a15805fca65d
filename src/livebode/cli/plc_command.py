"""`livebode plc`: an axis's excitation, sliding DFT and ring as Structured Text."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from livebode.nouns import InputError

_DISK = {errno.ENOSPC: "the disk is full", errno.EDQUOT: "the disk quota is used up"}


def plc_command(
    axis: Annotated[Path, typer.Argument(metavar="AXIS.toml", help="Configuration with lines, window and signals.")],
    amplitude: Annotated[float, typer.Option(metavar="SIZE", help="Of each line, in the excitation's unit.")],
    limit: Annotated[float, typer.Option(metavar="SIZE", help="What the excitation never exceeds.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory to write to.")],
    rate: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Cycles of the task per second; source.rate_hz unless said."),
    ] = None,
    ring: Annotated[int, typer.Option(metavar="SAMPLES", help="Samples that the ring keeps.")] = 8192,
    twincat: Annotated[bool, typer.Option("--twincat", help="As .TcPOU and .TcDUT instead of .st.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace files that stand there.")] = False,
) -> None:
    """Write function blocks for the axis's PLC: excitation, sliding DFT, and the ring that livebode reads."""
    from livebode import structured_text
    from livebode.session.axis import Axis
    from livebode.session.plc import plc_project

    project = plc_project(Axis.read(axis), rate, amplitude, limit, ring)
    files = project.files()
    if twincat:
        files = dict(structured_text.twincat(text) for text in files.values())
    _write(out, files, force)
    for name in files:
        print(out / name)
    columns = ", ".join(f'"{name}"' for name in project.columns)
    print(f'livebode reads it with, in [source]: symbol = "MAIN.livebode", channels = [{columns}]')


def _write(folder: Path, files: dict[str, str], force: bool) -> None:
    """All files, or none where one cannot be written."""
    for name in files:
        path = folder / name
        if path.is_dir() or (not force and (path.exists() or path.is_symlink())):
            raise InputError(f"{str(path)!r} exists already; take another --out, or --force to replace it")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(prefix=".partial-", dir=folder) as partial:
            for name, text in files.items():
                (Path(partial) / name).write_text(text, encoding="ascii")
            for name in files:
                (Path(partial) / name).replace(folder / name)
    except OSError as error:
        why = _DISK.get(error.errno or 0, os.strerror(error.errno) if error.errno else str(error))
        raise InputError(f"{str(folder)!r} could not be written: {why}; nothing was left there") from None
