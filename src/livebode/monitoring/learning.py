"""From healthy runs to a Machine: one model for all of them, by its own motion under their torque."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.monitoring.accuracy import Accuracy, accuracy
from livebode.monitoring.evidence import Evidence
from livebode.monitoring.machine import Machine, cells
from livebode.monitoring.model_evidence import ModelEvidence, held, missing, wave, way
from livebode.monitoring.offset import Offset
from livebode.monitoring.order_search import find_orders
from livebode.monitoring.ripple import Ripple, amplitudes, noise_power
from livebode.monitoring.sensitivity import DIRECTIONS
from livebode.monitoring.stretches import Stretches
from livebode.motion import Curve, MovingModel
from livebode.motion.fit import Fit, Rows
from livebode.motion.model import basis
from livebode.nouns import Block, InputError, Lines

Floats = NDArray[np.float64]
Run = Callable[[], Iterable[Block]]
"""Every call gives the samples of a run again, from the first."""

_PASSES = 5
_MATTERS = 0.1  # of the noise: a smaller ripple changes no window
_SEARCHES = 2  # for orders of a ripple: the second after a fit that allows for the first ones
_CONVERGED = 1e-5
_SPLINES = 12, 6  # of ln Keff(x), ln bs(x)
_FLAT_M = 1e-2  # a way shorter than that has no curves
_SLOWEST = 0.25  # of the fastest speed: slower, dry friction may hold the cart between the excitation's strokes
_ROWS_MIN, _ROWS_MAX = 60, 4000
_SMOOTH = 1e-4
# Of stiffness, load, damping, inertia; friction of a slow cart looks a little like the last two.
_SMALLEST = np.array([0.005, 0.005, 0.05, 0.01])
# While a change stands, another is seen from so much more on.
_FURTHER = np.array([2.0, 2.0, 4.0, 4.0])
_EXACT = Accuracy(np.ones(4), np.zeros(4), _SMALLEST)


def learn_machine(
    runs: Sequence[Run], lines: Lines, *, input: str, output: str, schedule: str, radius_m: float
) -> Machine:
    """The Machine that all runs share.

    Two masses are fitted to single windows first, as `MotionCorrection` does; then the model is driven through every
    run, and corrected by what it leaves unexplained, until nothing is left (Gauss–Newton on the output's error). The
    runs should hold every speed, both directions and the whole way: what they do not hold is not known.

    Raises
    ------
    InputError
        If the runs hold too little steady motion, or no two masses fit them.
    """
    names = input, output, schedule
    rows, speed = _first_look(runs, lines, names)
    low, high = float(rows.position_m.min()), float(rows.position_m.max())
    splines = _SPLINES if high - low > _FLAT_M else (1, 1)
    fit = Fit(lines.z, lines.rate_hz, radius_m, *splines)
    model = fit.refine(rows, fit.start(rows))
    slowest, fastest = float(np.abs(speed).min()), float(np.abs(speed).max())
    machine = Machine(
        model=model,
        noise_power=np.ones(len(lines)),
        quiet_power=np.full(len(lines.quiet), np.inf),
        held=_EXACT,
        free=_EXACT,
        slowest_m_per_s=slowest,
        fastest_m_per_s=fastest,
        windows=cells(rows.position_m, low, high),
    )
    machine = _fitted(runs, machine, lines, names, passes=2)
    for _ in range(_SEARCHES):
        orders = find_orders((run() for run in runs), machine, lines, names)
        if set(orders) == set(machine.ripple.cycles_per_m):
            break
        machine = replace(machine, ripple=Ripple.of(orders))
        machine = _with_noise(machine, _all_seen(runs, machine, lines, names))
        machine = _fitted(runs, machine, lines, names, passes=2)
    machine = _fitted(runs, machine, lines, names)
    return _judged(_all_seen(runs, machine, lines, names), machine)


def _fitted(
    runs: Sequence[Run], machine: Machine, lines: Lines, names: tuple[str, str, str], passes: int = _PASSES
) -> Machine:
    """The model, noise and ripple that all runs share (Gauss–Newton on the output's error)."""
    for _ in range(passes):
        seen = _all_seen(runs, machine, lines, names)
        machine = _with_noise(machine, seen)
        step = _step(seen, machine.model, lines.rate_hz)
        model, late_s = _moved(machine.model, step[:-1]), float(step[-1]) / lines.rate_hz
        machine = replace(machine, model=model, delay_s=machine.delay_s + late_s)
        if np.max(np.abs(step)) < _CONVERGED:
            break
    return machine


def _with_noise(machine: Machine, seen: Evidence) -> Machine:
    """With the noise that these windows show, and the size of the ripple."""
    if not len(machine.ripple):
        return replace(machine, noise_power=seen.power.mean(axis=0))
    ripple = Ripple(machine.ripple.cycles_per_m, amplitudes(seen.ripple_score, seen.ripple_information))
    noise = noise_power(seen.power, seen.ripple_gain, ripple)
    seen_most = np.einsum("woo->wo", seen.ripple_information).max(axis=0)
    matters = (ripple.spread**2 * seen_most).reshape(-1, 2).max(axis=1) > _MATTERS
    return replace(machine, ripple=ripple.only(matters), noise_power=noise)


def _first_look(runs: Sequence[Run], lines: Lines, names: tuple[str, str, str]) -> tuple[Rows, Floats]:
    """Responses of single steady windows that are fast enough, and their speeds."""
    u, y, centre, speed = (np.concatenate(part) for part in zip(*_spectra(runs, lines, names)))
    fastest = np.max(np.abs(speed), initial=0.0)
    use = np.flatnonzero((np.abs(speed) >= _SLOWEST * fastest) & np.all(np.abs(u) > 0, axis=1))
    if use.size < _ROWS_MIN or fastest == 0:
        raise InputError(
            f"the runs hold {use.size} windows of steady motion along {names[2]!r}, less than the {_ROWS_MIN} that a "
            "model of the moving machine needs; give longer runs, or a shorter window"
        )
    use = use[np.argsort(centre[use], kind="stable")]
    chosen = use[np.unique(np.linspace(0, use.size - 1, _ROWS_MAX).round().astype(int))]
    return Rows(y[chosen] / u[chosen], np.abs(u[chosen]), centre[chosen]), speed[use]


def _spectra(runs: Sequence[Run], lines: Lines, names: tuple[str, str, str]) -> Iterator[tuple[NDArray[Any], ...]]:
    transform, window = wave(lines.bins, lines.window), lines.window
    for run in runs:
        stretches = Stretches(names, window, lines.rate_hz)
        for stretch in (s for block in run() for s in stretches.process(block)):
            bad = missing(stretch.data)
            u, y, x = held(stretch.data, bad)
            begin = np.arange(stretch.first, stretch.last) * window - stretch.start
            centre, speed, even = way(x, begin, window, lines.rate_hz)
            cut = begin[:, np.newaxis] + np.arange(window)
            use = even & ~bad[cut].any(axis=1)
            yield u[cut[use]] @ transform, y[cut[use]] @ transform, centre[use], speed[use]


def _all_seen(runs: Sequence[Run], machine: Machine, lines: Lines, names: tuple[str, str, str]) -> Evidence:
    return Evidence.join([_seen(run, machine, lines, names) for run in runs])


def _seen(run: Run, machine: Machine, lines: Lines, names: tuple[str, str, str]) -> Evidence:
    """What the model leaves of a run, judged windows alone."""
    source, stretches, offset = ModelEvidence(machine, lines), Stretches(names, lines.window, lines.rate_hz), Offset()
    parts = [source.process(stretch, offset) for block in run() for stretch in stretches.process(block)]
    parts += [source.process(stretch, offset) for stretch in stretches.finish()]
    if not parts:
        raise InputError("a run is shorter than twelve windows; leave it out or give a longer one")
    seen = Evidence.join(parts)
    return seen.rows(seen.judged)


def _design(model: MovingModel, position_m: Floats) -> Floats:
    """From the model's unknowns to the logarithms of stiffness, load, damping, inertia, (rows, 4, unknowns)."""
    k, b = len(model.log_stiffness.weights), len(model.log_damping.weights)
    design = np.zeros((position_m.size, len(DIRECTIONS), 2 + k + b))
    design[:, 1, 0] = design[:, 3, 1] = 1.0
    design[:, 0, 2 : 2 + k] = basis(position_m, model.low_m, model.high_m, k)
    design[:, 2, 2 + k :] = basis(position_m, model.low_m, model.high_m, b)
    return design


def _step(seen: Evidence, model: MovingModel, rate_hz: float) -> Floats:
    """Of the model's unknowns, and of the delay in samples."""
    design = _design(model, seen.position_m)
    gradient = np.append(np.einsum("rju,rj->u", design, seen.score), seen.late_score.sum() / rate_hz)
    matrix = np.zeros((gradient.size, gradient.size))
    matrix[:-1, :-1] = np.einsum("rju,rjk,rkv->uv", design, seen.information, design, optimize=True)
    matrix[-1, :-1] = np.einsum("rju,rj->u", design, seen.late_information[:, :-1]) / rate_hz
    matrix[:-1, -1] = matrix[-1, :-1]
    matrix[-1, -1] = seen.late_information[:, -1].sum() / rate_hz**2
    k = len(model.log_stiffness.weights)
    unknowns = np.concatenate([np.zeros(2), model.log_stiffness.weights, model.log_damping.weights, np.zeros(1)])
    pull = np.zeros_like(matrix)
    for part in (slice(2, 2 + k), slice(2 + k, -1)):
        differences = np.diff(np.eye(unknowns[part].size), n=3, axis=0)
        pull[part, part] = _SMOOTH * np.trace(matrix[part, part]) / unknowns[part].size * differences.T @ differences
    step = np.linalg.solve(matrix + pull, gradient - pull @ unknowns)
    step[:-1] = step[:-1].clip(-0.2, 0.2)
    step[-1] = step[-1].clip(-1.0, 1.0)
    return np.asarray(step)


def _moved(model: MovingModel, step: Floats) -> MovingModel:
    k = len(model.log_stiffness.weights)
    low, high = model.low_m, model.high_m
    return replace(
        model,
        load_kg=float(model.load_kg * np.exp(step[0])),
        inertia_kg_m2=float(model.inertia_kg_m2 * np.exp(step[1])),
        log_stiffness=Curve(low, high, model.log_stiffness.weights + step[2 : 2 + k]),
        log_damping=Curve(low, high, model.log_damping.weights + step[2 + k :]),
    )


def _judged(seen: Evidence, machine: Machine) -> Machine:
    """The Machine with its noise, and with what neighbouring windows and whole stretches have in common."""
    held = seen.score, np.einsum("rjj->rj", seen.information)
    # With all others free: the score that is left of a direction, and its information.
    inverse = np.linalg.inv(seen.information)
    information = 1 / np.einsum("rjj->rj", inverse)
    free = information * np.einsum("rjk,rk->rj", inverse, seen.score), information
    low, high = machine.model.low_m, machine.model.high_m
    return replace(
        machine,
        quiet_power=seen.quiet_power.mean(axis=0),
        held=accuracy(*held, _SMALLEST),
        free=accuracy(*free, _FURTHER * _SMALLEST),
        windows=cells(seen.position_m, low, high),
    )
