"""From a specification, a machine with several inputs and its limits to the experiments, with the reasons."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from livebode.core import DesignError, Lines, UsageError, counted
from livebode_design.matrix.candidate import (
    REPETITIONS_MAX,
    REPETITIONS_MIN,
    RESERVE,
    Candidate,
    candidate,
    repetitions,
)
from livebode_design.matrix.machine import MatrixLimits, MatrixMachine
from livebode_design.matrix.result import Alternative, MatrixDesign
from livebode_design.matrix.spec import ACCURACY, KINDS, MatrixSpec

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
        told = [f"{other.kind} {other.time_s:.3g} s" for other in others]
        if all(abs(other.time_s - best.time_s) < 1e-9 for other in others):
            return f"{own}; the smallest amplitudes of those that need {best.time_s:.3g} s"
        return f"{own}; the shortest for this accuracy: {', '.join(told)}"
    told = [f"{other.kind} {other.share / best.share:.3g} times" for other in others]
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


def choose_matrix(spec: MatrixSpec, machine: MatrixMachine, limits: MatrixLimits) -> MatrixDesign:
    """The kind of experiments that reaches the required sigma soonest, or the smallest sigma in the available time.

    Raises
    ------
    UsageError
        If numbers of values do not fit the machine, or there are no limits.
    GridError
        If the window has no such lines.
    DesignError
        If the required sigma cannot be reached in the time; the message has the best one and what limits it.

    Examples
    --------
    >>> from livebode_design import MechanismMachine
    >>> from livebode.simulation import GantryLoop
    >>> machine = MechanismMachine(loop=GantryLoop(), noise=(0.05, 0.05, 0.001))
    >>> spec = MatrixSpec(lines="10:60:10", window=400, kind="orthogonal")
    >>> design = choose_matrix(spec, machine, MatrixLimits(torque_n_m_max=3.0))
    >>> design.excitation.kind, design.sigma.shape
    ('orthogonal', (6, 3, 2))
    """
    machine.check(limits)
    lines = Lines.parse(spec.lines, machine.rate_hz, spec.window)
    if len(lines) < len(machine.inputs):
        raise UsageError(
            "out-of-range",
            f"there are {len(lines)} lines for {len(machine.inputs)} inputs",
            "take at least as many lines as inputs",
            argument="lines",
        )
    kinds = KINDS if spec.kind is None else (spec.kind,)
    candidates = [candidate(kind, spec, machine, limits, lines) for kind in kinds]
    _check_possible(spec, machine, candidates)
    order = sorted(range(len(candidates)), key=lambda i: _preference(candidates[i], spec))
    best, times = candidates[order[0]], repetitions(candidates[order[0]], spec)
    gentle = min(1.0, float(best.ratio.max()) / sqrt(times)) if spec.requires else 1.0
    excitation = best.excitation.scaled(gentle)
    f = lines.frequency_hz
    unit = excitation.predict(machine.response, 1.0, machine.described).sigma
    design = MatrixDesign(
        machine=machine,
        limits=limits,
        spec=spec,
        excitation=excitation,
        repetitions=times,
        time_s=times * best.repetition_s,
        response=machine.response(f),
        sigma=unit * machine.deviation(f)[:, :, None] / sqrt(times),
        peaks=tuple(replace(peak, size=peak.size * gentle) for peak in best.peaks),
        alternatives=tuple(_alternative(candidates[i], spec, gentle if i == order[0] else 1.0) for i in order),
        choices=(),
    )
    return replace(design, choices=explained(design))


def _preference(candidate: Candidate, spec: MatrixSpec) -> tuple[float, ...]:
    """The shortest time, then the smallest sigma; with a time only the smallest sigma."""
    times = repetitions(candidate, spec)
    worst = float(candidate.ratio.max()) / sqrt(times)
    return (times * candidate.repetition_s, worst) if spec.requires else (worst,)


def _alternative(candidate: Candidate, spec: MatrixSpec, gentle: float) -> Alternative:
    times = repetitions(candidate, spec)
    return Alternative(
        kind=candidate.excitation.kind,
        settle_periods=candidate.excitation.settle,
        repetitions=times,
        time_s=times * candidate.repetition_s,
        amplitude_n_m=tuple((candidate.amplitude * gentle).tolist()),
        share=float(candidate.ratio.max()) / sqrt(times) / gentle,
        limited_by=candidate.limited_by,
    )


def _check_possible(spec: MatrixSpec, machine: MatrixMachine, candidates: list[Candidate]) -> None:
    shortest = min(candidate.repetition_s for candidate in candidates)
    if spec.time_s is not None and REPETITIONS_MIN * shortest > spec.time_s:
        quick = min(candidates, key=lambda candidate: candidate.repetition_s)
        raise DesignError(
            "not-enough-time",
            f"{spec.time_s:g} s are too short: {REPETITIONS_MIN} repetitions of {len(machine.inputs)} experiments of "
            f"{quick.excitation.dwell} periods, {quick.excitation.settle} of them until the slowest mode has decayed, "
            f"need {REPETITIONS_MIN * shortest:.3g} s",
            "allow that time, or take a shorter window",
            time_s=spec.time_s,
            time_s_min=REPETITIONS_MIN * shortest,
        )
    if not spec.requires:
        return
    soonest = min(candidates, key=lambda candidate: candidate.needed * candidate.repetition_s)
    needed_s = soonest.needed * soonest.repetition_s
    if soonest.needed <= REPETITIONS_MAX and (spec.time_s is None or needed_s <= spec.time_s):
        return
    in_time = [_most(candidate, spec) for candidate in candidates]
    best = min(zip(candidates, in_time), key=lambda pair: pair[0].ratio.max() / sqrt(pair[1]) if pair[1] else np.inf)
    line, o, i = np.unravel_index(int(best[0].ratio.argmax()), best[0].ratio.shape)
    frequency_hz = float(best[0].excitation.lines.frequency_hz[line])
    share = float(best[0].ratio.max()) / sqrt(best[1])
    entry = f"{machine.outputs[o][0]}/{machine.inputs[i]}"
    raise DesignError(
        "accuracy-not-reached",
        f"{_wanted(spec)} needs {needed_s:.3g} s; the best in {best[1] * best[0].repetition_s:.3g} s is "
        f"{_reached(spec, share)}, at {entry} and {frequency_hz:g} Hz, with {best[0].excitation.kind} experiments, "
        f"limited by the {', the '.join(best[0].limited_by)}",
        "allow more time or a larger limit, or require that",
        needed_s=needed_s,
        share=share,
        entry=entry,
        frequency_hz=frequency_hz,
        limited_by=list(best[0].limited_by),
    )


def _most(candidate: Candidate, spec: MatrixSpec) -> int:
    """Repetitions that are possible; 0 where there are too few."""
    in_time = REPETITIONS_MAX if spec.time_s is None else int(spec.time_s / candidate.repetition_s)
    return min(REPETITIONS_MAX, in_time) if in_time >= REPETITIONS_MIN else 0


def _wanted(spec: MatrixSpec) -> str:
    if spec.sigma_max is not None:
        return "the required sigma_max"
    return f"a 95 % bound of {100 * (spec.accuracy or ACCURACY):.3g} % at every entry"


def _reached(spec: MatrixSpec, share: float) -> str:
    if spec.sigma_max is not None:
        return f"{share:.3g} times that sigma"
    return f"{100 * share * (spec.accuracy or ACCURACY):.3g} %"
