"""`livebode design`: an excitation for a machine, within its limits, and the configuration to track it with."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from livebode.cli import Json, can_draw, console, parsed_band, tell_how_to_draw
from livebode.core import UsageError, counted

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from livebode_design.design import Design

_LINES_SHOWN = 25


def design_command(
    experiment: Annotated[
        Path, typer.Argument(metavar="EXPERIMENT.toml", help="Machine, limits and required accuracy.")
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory for the excitation and axis.toml.")] = Path(
        "design"
    ),
    to: Annotated[
        list[str] | None, typer.Option(metavar="FORMAT", help="csv, npz, mat, h or st. \\[default: all]")
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
) -> None:
    """Choose lines, window, amplitude and hop for a machine, with reasons; write the excitation and axis.toml."""
    from livebode.records import to_json
    from livebode_design.designing import design_experiment
    from livebode_design.experiment import Experiment
    from livebode_design.matrix.matrix_experiment import describes_several_motors

    if describes_several_motors(experiment):
        from livebode_design.matrix.matrix_terminal import design_several

        _refuse_for_several(band=band, resolution=resolution, amplitude=amplitude)
        above = {"lines": lines, "window": window, "accuracy": accuracy, "seed": seed}
        design_several(experiment, above, out, to, name, force=force, as_json=as_json)
        return
    over: dict[str, Any] = {
        "resolution_hz": resolution, "amplitude_n_m": amplitude, "accuracy": accuracy, "seed": seed,
        "lines": lines, "window": window,
        "band_hz": None if band is None else parsed_band(band),
    }  # fmt: skip
    asked = Experiment.read(experiment, {key: value for key, value in over.items() if value is not None})
    with working():
        made = design_experiment(asked, out, name=name, suffixes=to, force=force, draw=_draw if can_draw() else None)
    if as_json:
        print(to_json({"directory": str(made.directory), "files": list(made.files)} | made.design.plain()))
        return
    show_design(made.design)
    if made.left_out:
        print(made.left_out)
    print(f"{made.directory}/: {', '.join(made.files)}")
    tell_how_to_draw()


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


def _draw(design: Design, path: Path) -> None:
    from livebode_design.excitation_picture import save_excitation_picture

    save_excitation_picture(design, path)


def show_design(design: Design) -> None:
    """Print what was chosen, and the accuracy of each line."""
    terminal = console(markup=False)
    table = _table()
    table.add_column("chosen", overflow="fold")
    table.add_column("value", overflow="fold")
    table.add_column("why", overflow="fold")
    for choice in design.choices:
        table.add_row(choice.what, choice.value, choice.why)
    terminal.print(table)
    if design.machine.noise > 0 or design.encoder_counts is not None:
        _show_lines(terminal, design)
    for note in design.machine.notes:
        terminal.print(f"note: {note}", soft_wrap=True)


def _table() -> Table:
    from rich.table import Table

    return Table(box=None, header_style="bold", pad_edge=False)


def _show_lines(terminal: Console, design: Design) -> None:
    """A table of the lines; of many lines a selection that contains the weakest."""
    from livebode_design.encoder import COUNTS_MIN

    relative, windows = design.accuracy.relative, design.windows
    each = -(-len(relative) // _LINES_SHOWN)
    first = int(relative.argmax()) % each
    table = _table()
    for head in ("line", "in the spectrum", "σ of a window", f"95 % bound, {counted(windows, 'window')}"):
        table.add_column(head, justify="right", overflow="fold")
    counts, reached = design.encoder_counts, design.accuracy.reached(windows)
    if counts is not None:
        table.add_column("at the encoder", justify="right")
    for i in range(first, len(relative), each):
        cells = [f"{design.waveform.lines.frequency_hz[i]:.6g} Hz", f"{design.waveform.amplitude[i]:.4g} N m"]
        cells += [f"{100 * share:.3g} % of |G|" for share in (relative[i], reached[i])]
        if counts is not None:
            cells.append(f"{counts[i]:.3g} counts{'' if counts[i] >= COUNTS_MIN else ': not measurable'}")
        table.add_row(*cells)
    terminal.print()
    terminal.print(table)
    if each > 1:
        terminal.print(f"(one line in {each}; all are in design.json)")
