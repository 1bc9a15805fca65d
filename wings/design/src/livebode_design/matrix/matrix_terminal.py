"""What is printed about a design for several motors."""

from __future__ import annotations

from rich.console import Console

from livebode.cli import console
from livebode_design.design_terminal import lines_shown, plain_table
from livebode_design.matrix.result import MatrixDesign


def show_matrix_design(design: MatrixDesign) -> None:
    """Print what was chosen, the alternatives beside it, and sigma of each entry and line."""
    terminal = console(markup=False)
    chosen = plain_table("chosen", "value", "why")
    for choice in design.choices:
        chosen.add_row(choice.what, choice.value, choice.why)
    terminal.print(chosen)
    terminal.print()
    _show_alternatives(terminal, design)
    terminal.print()
    _show_sigma(terminal, design)


def _show_alternatives(terminal: Console, design: MatrixDesign) -> None:
    worst = "largest sigma" if design.spec.requires else "largest 95 % bound"
    table = plain_table("experiments", "settle", "repetitions", "time", "amplitudes", worst, "limited by")
    for alternative in design.alternatives:
        share = (
            f"{alternative.share:.3g} of the required" if design.spec.requires else f"{100 * alternative.share:.3g} %"
        )
        sizes = ", ".join(f"{a:.3g}" for a in alternative.amplitude_n_m)
        table.add_row(
            alternative.kind,
            str(alternative.settle_periods),
            str(alternative.repetitions),
            f"{alternative.time_s:.4g} s",
            f"{sizes} N m",
            share,
            ", ".join(alternative.limited_by),
        )
    terminal.print(table)


def _show_sigma(terminal: Console, design: MatrixDesign) -> None:
    """Sigma of each entry; of many lines a selection that contains the weakest."""
    first, each = lines_shown(design.bound.max(axis=(1, 2)))
    entries = [
        (o, i, f"{output}\nfrom {input}")
        for o, output in enumerate(design.outputs)
        for i, input in enumerate(design.inputs)
    ]
    table = plain_table("line", *(head for _, _, head in entries))
    for k in range(first, len(design.sigma), each):
        f = design.excitation.lines.frequency_hz[k]
        table.add_row(f"{f:.6g} Hz", *(f"{design.sigma[k, o, i]:.3g}" for o, i, _ in entries))
    terminal.print("sigma of each entry after all repetitions:")
    terminal.print(table)
    if each > 1:
        terminal.print(f"(one line in {each}; all are in design.json)")
