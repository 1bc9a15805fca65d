"""`livebode plc`: excitation, sliding DFT and ring buffer of an axis as Structured Text."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from livebode.cli import Json, NextCommand
from livebode.core import OutputError, output_files


def plc_command(
    axis: Annotated[Path, typer.Argument(metavar="AXIS.toml", help="Configuration with lines, window and signals.")],
    limit: Annotated[float, typer.Option(metavar="SIZE", help="Limit that the excitation never exceeds.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory to write to.")],
    amplitude: Annotated[
        float | None,
        typer.Option(metavar="SIZE", help="Amplitude of each line of a multisine, in the excitation's unit."),
    ] = None,
    excitation: Annotated[
        Path | None,
        typer.Option(metavar="FILE.npz", help="Instead of --amplitude: a file of livebode design, with its ramp."),
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Rate of the PLC task. \\[default: from the design or \\[source]]"),
    ] = None,
    ring: Annotated[int, typer.Option(metavar="SAMPLES", help="Length of the ring buffer.")] = 8192,
    twincat: Annotated[bool, typer.Option("--twincat", help="Write .TcPOU and .TcDUT instead of .st.")] = False,
    force: Annotated[
        bool,
        typer.Option(
            "--force",
            help="Replace existing files; a MAIN that was completed stays, and the new one is MAIN.new beside it.",
        ),
    ] = False,
    as_json: Json = False,
) -> NextCommand | None:
    """Write function blocks for the PLC of an axis: excitation, sliding DFT and the ring buffer that livebode reads."""
    from livebode.configuration import Axis
    from livebode.records import to_json
    from livebode_drives.excitation_file import read_designed
    from livebode_drives.plc import plc_project
    from livebode_drives.structured_text.twincat import twincat as as_twincat

    project = plc_project(
        Axis.read(axis),
        limit=limit,
        ring_length=ring,
        rate_hz=rate,
        amplitude=amplitude,
        designed=None if excitation is None else read_designed(excitation),
    )
    files = project.files()
    if twincat:
        files = dict(as_twincat(text) for text in files.values())
    files = _with_own_main(out, files) if force else files
    _write(out, files, force)
    if as_json:
        source = {"symbol": "MAIN.livebode", "channels": list(project.columns)}
        print(to_json({"files": [str(out / name) for name in files], "source": source}))
        return None
    for name in files:
        print(out / name)
    columns = ", ".join(f'"{name}"' for name in project.columns)
    print(f'Settings of [source] that read it: symbol = "MAIN.livebode", channels = [{columns}]')
    return NextCommand("doctor", axis)


def _with_own_main(folder: Path, files: dict[str, str]) -> dict[str, str]:
    """Files to write; a MAIN that is there and differs was completed by hand: it stays, with the new one beside it."""
    return {
        name.replace("MAIN.", "MAIN.new.") if name.startswith("MAIN.") and _differs(folder / name, text) else name: text
        for name, text in files.items()
    }


def _differs(path: Path, text: str) -> bool:
    return path.is_file() and path.read_bytes() != text.encode("ascii")


def _write(folder: Path, files: dict[str, str], force: bool) -> None:
    """Write all files, or none if one cannot be written."""
    for name in files:
        path = folder / name
        if path.is_dir() or (not force and (path.exists() or path.is_symlink())):
            raise OutputError(
                "exists",
                f"{str(path)!r} exists already",
                "choose another --out, or replace it with --force",
                path=str(path),
            )
    with output_files(folder, "plc") as partial:
        for name, text in files.items():
            (partial / name).write_text(text, encoding="ascii")
