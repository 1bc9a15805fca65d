"""`livebode design` for a machine with several motors."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from livebode.cli import can_draw, console, tell_how_to_draw

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from livebode.mimo import MatrixDesign

_LINES_SHOWN = 25


def design_several(
    experiment: Path,
    over: Mapping[str, Any],
    out: Path,
    to: list[str] | None,
    name: str,
    *,
    force: bool,
    as_json: bool,
) -> None:
    """Design, write and show."""
    from livebode.records import to_json
    from livebode_design.matrix.matrix_designing import design_matrix
    from livebode_design.matrix.matrix_experiment import MatrixExperiment

    asked = MatrixExperiment.read(experiment, {key: value for key, value in over.items() if value is not None})
    with console(stderr=True).status("choosing"):
        made = design_matrix(asked, out, name=name, suffixes=to, force=force, draw=_draw if can_draw() else None)
    if as_json:
        print(to_json({"directory": str(made.directory), "files": list(made.files)} | made.design.plain()))
        return
    show_matrix_design(made.design)
    print(f"{made.directory}/: {', '.join(made.files)}")
    tell_how_to_draw()


def _draw(design: MatrixDesign, path: Path) -> None:
    from livebode_design.matrix.matrix_picture import save_matrix_excitation_picture

    save_matrix_excitation_picture(design, path)


def show_matrix_design(design: MatrixDesign) -> None:
    """Print what was chosen, the alternatives beside it, and sigma of each entry and line."""
    terminal = console(markup=False)
    chosen = _table("chosen", "value", "why")
    for choice in design.choices:
        chosen.add_row(choice.what, choice.value, choice.why)
    terminal.print(chosen)
    terminal.print()
    _show_alternatives(terminal, design)
    terminal.print()
    _show_sigma(terminal, design)


def _show_alternatives(terminal: Console, design: MatrixDesign) -> None:
    worst = "largest sigma" if design.spec.requires else "largest 95 % bound"
    table = _table("experiments", "settle", "repetitions", "time", "amplitudes", worst, "limited by")
    for one in design.alternatives:
        share = f"{one.share:.3g} of the required" if design.spec.requires else f"{100 * one.share:.3g} %"
        sizes = ", ".join(f"{a:.3g}" for a in one.amplitude_n_m)
        table.add_row(
            one.kind,
            str(one.settle_periods),
            str(one.repetitions),
            f"{one.time_s:.4g} s",
            f"{sizes} N m",
            share,
            ", ".join(one.limited_by),
        )
    terminal.print(table)


def _show_sigma(terminal: Console, design: MatrixDesign) -> None:
    """Sigma of each entry; of many lines a selection that contains the weakest."""
    lines = len(design.sigma)
    each = -(-lines // _LINES_SHOWN)
    first = int(design.bound.max(axis=(1, 2)).argmax()) % each
    entries = [
        (o, i, f"{output}\nfrom {input}")
        for o, output in enumerate(design.outputs)
        for i, input in enumerate(design.inputs)
    ]
    table = _table("line", *(head for _, _, head in entries))
    for k in range(first, lines, each):
        f = design.excitation.lines.frequency_hz[k]
        table.add_row(f"{f:.6g} Hz", *(f"{design.sigma[k, o, i]:.3g}" for o, i, _ in entries))
    terminal.print("sigma of each entry after all repetitions:")
    terminal.print(table)
    if each > 1:
        terminal.print(f"(one line in {each}; all are in design.json)")


def _table(*heads: str) -> Table:
    from rich.table import Table

    table = Table(box=None, header_style="bold", pad_edge=False)
    for head in heads:
        table.add_column(head, overflow="fold")
    return table
