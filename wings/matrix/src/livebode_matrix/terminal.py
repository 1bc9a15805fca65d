"""Pictures and printed results of a matrix run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from livebode.cli import show_monitoring, tracked_amount
from livebode.core import MatrixResponses
from livebode.locations import original
from livebode.runtime import Outcome

if TYPE_CHECKING:
    from livebode_matrix.response_matrix import ResponseMatrix


def draw_matrix(estimate: ResponseMatrix, into: Path) -> None:
    """Draw bode.svg and singular-values.svg of a matrix run."""
    responses = estimate.drawn or estimate.newest
    if responses is None:
        return
    from livebode.pictures import save_matrix_pictures

    save_matrix_pictures(responses, into, title=estimate.axis.source.title)


def show_matrix(outcome: Outcome) -> None:
    """Print the entries of the newest matrix, its condition, and why columns are invalid."""
    newest = outcome.matrix
    assert newest is not None
    print(tracked_amount(outcome.summary))
    print(f"{original(str(outcome.directory))}/")
    for line in matrix_lines(newest):
        print(line)
    if (condition := outcome.summary.get("condition")) is not None:
        print(f"inputs: condition number at most {condition['worst']:.3g} (at {condition['frequency_hz']:g} Hz)")
    for sentence in newest.why():
        print(sentence)
    if not newest.valid.any():
        print("if the inputs move, compare [experiments] with the recording: dwell_periods, settle_periods, start")
    show_monitoring(outcome.summary["monitoring"])


def matrix_lines(newest: MatrixResponses) -> list[str]:
    """One line for each entry of the newest matrix: its valid lines, and its largest magnitude with the bound there."""
    lines, width = [], max(len(f"{o}/{i}") for o in newest.outputs for i in newest.inputs)
    for output in newest.outputs:
        for input in newest.inputs:
            entry = newest.entry(output, input)
            name, valid = f"{output}/{input}".ljust(width), entry.valid[-1]
            if not valid.any():
                lines.append(f"{name}  not valid at any line")
                continue
            size = abs(entry.value[-1, valid])
            peak_index = int(size.argmax())
            bound = entry.bound()[-1, valid][peak_index]
            around = f" ± {bound:.2g}" if bound == bound else ", bound not known yet"
            peak = f"largest {size[peak_index]:.4g}{around} at {entry.lines.frequency_hz[valid][peak_index]:g} Hz"
            lines.append(f"{name}  valid at {valid.sum()} of {valid.size} lines, {peak}")
    return lines
