"""What is printed about a design."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from livebode.arrays import Floats
from livebode.cli import console
from livebode.core import counted
from livebode_design.accuracy import COUNTS_MIN
from livebode_design.design import Design

_LINES_SHOWN = 25


def plain_table(*heads: str) -> Table:
    """A table without borders, whose columns are wide enough or folded."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    for head in heads:
        table.add_column(head, overflow="fold")
    return table


def lines_shown(bound: Floats) -> tuple[int, int]:
    """The first line to be shown, and the step to the next: of many lines a selection that contains the weakest."""
    each = -(-len(bound) // _LINES_SHOWN)
    return int(bound.argmax()) % each, each


def show_design(design: Design) -> None:
    """Print what was chosen, and the accuracy of each line."""
    terminal = console(markup=False)
    table = plain_table("chosen", "value", "why")
    for choice in design.choices:
        table.add_row(choice.what, choice.value, choice.why)
    terminal.print(table)
    if design.machine.noise > 0 or design.encoder_counts is not None:
        _show_lines(terminal, design)
    for note in design.machine.notes:
        terminal.print(f"note: {note}", soft_wrap=True)


def _show_lines(terminal: Console, design: Design) -> None:
    """A table of the lines; of many lines a selection that contains the weakest."""
    relative, windows = design.accuracy.relative, design.windows
    first, each = lines_shown(relative)
    table = plain_table()
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
