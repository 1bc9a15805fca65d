"""`livebode design`: an excitation for a machine, within its limits, and the configuration to track it with."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Annotated, Any

import typer

from livebode.cli import Json, NextCommand, console, parsed_band
from livebode.core import UsageError


def design_command(
    experiment: Annotated[
        Path, typer.Argument(metavar="EXPERIMENT.toml", help="Machine, limits and required accuracy.")
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory for the excitation and axis.toml.")] = Path(
        "design"
    ),
    to: Annotated[
        list[str] | None, typer.Option(metavar="FORMAT", help="csv, wav, npz, mat, h or st. \\[default: all]")
    ] = None,
    name: Annotated[str, typer.Option(help="Name of the excitation; also of its files.")] = "excitation",
    band: Annotated[
        str | None, typer.Option(metavar="LOW:HIGH", help="Frequency band in Hz; replaces that of the file.")
    ] = None,
    resolution: Annotated[float | None, typer.Option(metavar="HZ", help="Distance between lines.")] = None,
    lines: Annotated[
        str | None, typer.Option(help="Lines in Hz, as 20:140:20, 150; replaces the band of the file.")
    ] = None,
    window: Annotated[int | None, typer.Option(metavar="SAMPLES", help="Period; needed for lines in bins.")] = None,
    amplitude: Annotated[
        float | None, typer.Option(metavar="N·m", help="Amplitude of each line. \\[default: chosen]")
    ] = None,
    accuracy: Annotated[float | None, typer.Option(help="Required 95 % bound, relative to |G|.")] = None,
    seed: Annotated[int | None, typer.Option(help="Random seed; the same seed gives the same excitation.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the files of a previous design.")] = False,
    as_json: Json = False,
) -> NextCommand | None:
    """Choose lines, window, amplitude and hop for a machine, with reasons; write the excitation and axis.toml."""
    from livebode.plugins import loaded
    from livebode.records import to_json
    from livebode_design.experiment import Experiment
    from livebode_design.experiment_design import described, design_experiment

    given: dict[str, Any] = {
        "resolution_hz": resolution, "amplitude_n_m": amplitude, "accuracy": accuracy, "seed": seed,
        "lines": lines, "window": window,
        "band_hz": None if band is None else parsed_band(band),
    }  # fmt: skip
    asked = described(experiment, {key: value for key, value in given.items() if value is not None})
    if not isinstance(asked, Experiment):
        _refuse_for_several(band=band, resolution=resolution, amplitude=amplitude)
    with working():
        made = design_experiment(asked, out, name=name, suffixes=to, force=force, draw=loaded(asked.picture))
    if as_json:
        print(to_json({"directory": str(made.directory), "files": list(made.files)} | made.design.plain()))
        return None
    loaded(asked.terminal)(made.design)
    if made.left_out:
        print(made.left_out)
    print(f"{made.directory}/: {', '.join(made.files)}")
    if isinstance(asked, Experiment) and asked.source is not None:
        return NextCommand("measure", experiment, "--dry-run")
    if isinstance(asked, Experiment) and asked.belt is not None:
        return NextCommand("measure", experiment, "--simulated")
    return None  # the recording comes from another program


def _refuse_for_several(**given: object) -> None:
    for option, value in given.items():
        if value is not None:
            raise UsageError(
                "conflict",
                f"{option} does not belong to a design for several motors",
                "give lines and window; amplitudes are chosen by the limits",
                argument=option,
            )


def working() -> AbstractContextManager[object]:
    """A spinner on a terminal: thousands of lines take time."""

    return console(stderr=True).status("choosing")
