"""What was chosen for several inputs, in a sentence each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from livebode.core import counted
from livebode_design.matrix.candidate import RESERVE

if TYPE_CHECKING:
    from livebode_design.matrix.result import MatrixChoice, MatrixDesign

_KIND = {
    "orthogonal": "all motors at all lines, with signs or phases that differ from experiment to experiment",
    "interleaved": "all motors, each at every {n}th line, and at the next line in the next experiment",
    "successive": "one motor after the other",
}


def explained(design: MatrixDesign) -> tuple[MatrixChoice, ...]:
    """The rows of the table."""
    from livebode_design.matrix.result import MatrixChoice

    used, lines = design.excitation, design.excitation.lines
    f, count = lines.frequency_hz, len(design.inputs)
    window_s = lines.window / lines.rate_hz
    sizes = zip(design.inputs, design.alternatives[0].amplitude_n_m)
    line, o, i = np.unravel_index(int(design.bound.argmax()), design.bound.shape)
    entry = f"{design.outputs[o]}/{design.inputs[i]}"
    rows = [
        (
            "lines",
            f"{f[0]:g} … {f[-1]:g} Hz, {counted(len(f), 'line')}",
            f"window of {lines.window} samples, {1000 * window_s:g} ms",
        ),
        ("experiments", f"{count}, {used.kind}", _kind_reason(design)),
        ("settle", f"{counted(used.settle, 'period')}, {used.settle * window_s:.3g} s", _settle_reason(design)),
        ("amplitude", ", ".join(f"{name} {a:.4g} N m" for name, a in sizes), _amplitude_reason(design)),
        ("repetitions", f"{design.repetitions}", _repetitions_reason(design)),
        (
            "recording",
            f"{design.time_s:.4g} s",
            f"{design.repetitions} × {count} experiments of {counted(used.dwell, 'period')}",
        ),
        (
            "95 % bound",
            f"{100 * design.bound.max():.3g} % or less",
            f"of the largest response of the output; the worst is {entry} at {f[line]:g} Hz",
        ),
    ]
    rows += [
        (f"peak {peak.name}", f"{peak.size:.3g} {peak.unit}", f"limit {peak.limit:.3g}; {design.machine.peaks_include}")
        for peak in design.peaks
    ]
    return tuple(MatrixChoice(*row) for row in rows)


def _kind_reason(design: MatrixDesign) -> str:
    own = _KIND[design.excitation.kind].format(n=len(design.inputs))
    others = design.alternatives[1:]
    if not others:
        return f"{own}; specified"
    best = design.alternatives[0]
    if design.spec.requires:
        told = [f"{one.kind} {one.time_s:.3g} s" for one in others]
        if all(abs(one.time_s - best.time_s) < 1e-9 for one in others):
            return f"{own}; the smallest amplitudes of those that need {best.time_s:.3g} s"
        return f"{own}; the shortest for this accuracy: {', '.join(told)}"
    told = [f"{one.kind} {one.share / best.share:.3g} times" for one in others]
    return f"{own}; the smallest sigma in the time: {', '.join(told)}"


def _settle_reason(design: MatrixDesign) -> str:
    if design.spec.settle_periods is not None:
        return "specified"
    return design.machine.settle_reason


def _amplitude_reason(design: MatrixDesign) -> str:
    limited = [peak.name for peak in design.peaks if peak.size >= (1 - RESERVE) * 0.99 * peak.limit]
    if not limited:
        return "the smallest that reaches the accuracy with these repetitions, of each line"
    return f"of each line; limited by the {', the '.join(limited)}, less {100 * RESERVE:g} % in reserve"


def _repetitions_reason(design: MatrixDesign) -> str:
    if not design.spec.requires:
        return f"as many as fit into {design.spec.time_s:g} s"
    return "the fewest that reach the accuracy, at least 2 for the scatter"
