"""From a specification, a machine with several inputs and its limits to the experiments, with the reasons."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np

from livebode.core import DesignError, Lines, UsageError
from livebode_design.matrix.candidate import REPETITIONS_MAX, REPETITIONS_MIN, Candidate, candidate, repetitions
from livebode_design.matrix.explain import explained
from livebode_design.matrix.machine import MatrixLimits, MatrixMachine
from livebode_design.matrix.result import Alternative, MatrixDesign
from livebode_design.matrix.spec import ACCURACY, KINDS, MatrixSpec


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
    >>> found = choose_matrix(spec, machine, MatrixLimits(torque_n_m_max=3.0))
    >>> found.excitation.kind, found.sigma.shape
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
    found = [candidate(kind, spec, machine, limits, lines) for kind in kinds]
    _check_possible(spec, machine, found)
    order = sorted(range(len(found)), key=lambda i: _preference(found[i], spec))
    best, times = found[order[0]], repetitions(found[order[0]], spec)
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
        alternatives=tuple(_alternative(found[i], spec, gentle if i == order[0] else 1.0) for i in order),
        choices=(),
    )
    return replace(design, choices=explained(design))


def _preference(found: Candidate, spec: MatrixSpec) -> tuple[float, ...]:
    """The shortest time, then the smallest sigma; with a time only the smallest sigma."""
    times = repetitions(found, spec)
    worst = float(found.ratio.max()) / sqrt(times)
    return (times * found.repetition_s, worst) if spec.requires else (worst,)


def _alternative(found: Candidate, spec: MatrixSpec, gentle: float) -> Alternative:
    times = repetitions(found, spec)
    return Alternative(
        kind=found.excitation.kind,
        settle_periods=found.excitation.settle,
        repetitions=times,
        time_s=times * found.repetition_s,
        amplitude_n_m=tuple((found.amplitude * gentle).tolist()),
        share=float(found.ratio.max()) / sqrt(times) / gentle,
        limited_by=found.limited_by,
    )


def _check_possible(spec: MatrixSpec, machine: MatrixMachine, found: list[Candidate]) -> None:
    shortest = min(one.repetition_s for one in found)
    if spec.time_s is not None and REPETITIONS_MIN * shortest > spec.time_s:
        quick = min(found, key=lambda one: one.repetition_s)
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
    soonest = min(found, key=lambda one: one.needed * one.repetition_s)
    needed_s = soonest.needed * soonest.repetition_s
    if soonest.needed <= REPETITIONS_MAX and (spec.time_s is None or needed_s <= spec.time_s):
        return
    in_time = [_most(one, spec) for one in found]
    best = min(zip(found, in_time), key=lambda pair: pair[0].ratio.max() / sqrt(pair[1]) if pair[1] else np.inf)
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


def _most(found: Candidate, spec: MatrixSpec) -> int:
    """Repetitions that are possible; 0 where there are too few."""
    in_time = REPETITIONS_MAX if spec.time_s is None else int(spec.time_s / found.repetition_s)
    return min(REPETITIONS_MAX, in_time) if in_time >= REPETITIONS_MIN else 0


def _wanted(spec: MatrixSpec) -> str:
    if spec.sigma_max is not None:
        return "the required sigma_max"
    return f"a 95 % bound of {100 * (spec.accuracy or ACCURACY):.3g} % at every entry"


def _reached(spec: MatrixSpec, share: float) -> str:
    if spec.sigma_max is not None:
        return f"{share:.3g} times that sigma"
    return f"{100 * share * (spec.accuracy or ACCURACY):.3g} %"
