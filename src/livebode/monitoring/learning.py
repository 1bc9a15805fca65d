"""From healthy runs to a Machine: one model for all runs, driven by their torque, and the orders in its residual."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import BaselineError, Block, Lines
from livebode.monitoring.accuracy import ChangeAccuracy, accuracy, scatter_error
from livebode.monitoring.amplitude import InputAmplitude
from livebode.monitoring.between_runs import KNOWN, between_runs
from livebode.monitoring.covariates import Covariates, jackknife, parts_of, window_means, with_range
from livebode.monitoring.evidence import JUDGED, Evidence
from livebode.monitoring.machine import LearnedMachine, cells
from livebode.monitoring.machine_fit import joint_step, moved, normal, normal_of, step_of
from livebode.monitoring.model_evidence import SIGNALS, ModelEvidence, held, missing, wave, way
from livebode.monitoring.ripple import Ripple, amplitudes, noise_power
from livebode.monitoring.sensitivity import DIRECTIONS, Offset
from livebode.monitoring.stretches import Stretches
from livebode.motion import MotionFitOptions, OrderSpectrum, WeightedResponses


def find_orders(
    runs: Iterable[Iterable[Block]], machine: LearnedMachine, lines: Lines, names: tuple[str, ...]
) -> Floats:
    """Orders in cycles a metre, the strongest first."""
    if machine.way_m == 0:
        return np.zeros(0)
    spectrum = OrderSpectrum(lines, machine.way_m, machine.slowest_m_per_s)
    for run in runs:
        for rows in _strokes(run, machine, lines, names):
            spectrum.add(rows[0], rows[-1])
    return spectrum.found()


def peak_torques(
    runs: Iterable[Iterable[Block]], machine: LearnedMachine, lines: Lines, names: tuple[str, ...]
) -> Floats:
    """Amplitude of each order of the Machine's ripple, N m (orders,); 0 where it is not above the noise.

    From the strokes in which an order is away from the lines. At the lines, what the model omits of the excitation's
    motion, such as dry friction that it reverses, has the power of a ripple of several times the true size.
    """
    orders = machine.ripple.cycles_per_m
    spectrum, total = OrderSpectrum(lines, machine.way_m, machine.slowest_m_per_s), np.zeros((2, orders.size))
    for run in runs:
        for rows in _strokes(run, machine, lines, names):
            total += spectrum.explained(rows[0], rows[1:-1], rows[-1], orders)
    squared = total[0] / np.where(total[1] > 0, total[1], 1.0)
    return np.asarray(np.sqrt(np.maximum(squared, 0.0)))


def _strokes(run: Iterable[Block], machine: LearnedMachine, lines: Lines, names: tuple[str, ...]) -> Iterator[Floats]:
    """Rows of `ModelEvidence.residual` over windows in a row that are judged."""
    source, stretches = ModelEvidence(machine, lines), Stretches(names, lines.window, lines.rate_hz)
    parts: list[Floats] = []
    stop, sign = -1, 0.0
    for stretch in (s for block in run for s in stretches.process(block)):
        rows = source.residual(stretch, Offset())
        _, speed, status = source.way(stretch)
        for i, first in enumerate(range(stretch.first * lines.window, stretch.last * lines.window, lines.window)):
            forward, judged = float(np.sign(speed[i])), status[i] == JUDGED
            if parts and (first != stop or forward != sign or not judged):
                yield np.concatenate(parts, axis=1)
                parts = []
            if judged:
                begin = first - stretch.start
                parts.append(rows[:, begin : begin + lines.window])
                stop, sign = first + lines.window, forward
    if parts:
        yield np.concatenate(parts, axis=1)


Run = Callable[[], Iterable[Block]]
"""Each call gives the samples of a run from the first one."""

_PASSES = 5
_MATTERS = 0.1  # of the noise: a smaller ripple changes no window
_SEARCHES = 2  # for orders of a ripple: the second after a fit that allows for the first ones
_CONVERGED = 1e-5
_SPLINES = 12, 6  # of ln Keff(x), ln bs(x)
_FLAT_M = 1e-2  # a shorter travel gives no curves
_SLOWEST = 0.25  # of the fastest speed: below it, dry friction may stop the cart between the excitation's strokes
_ROWS_MIN, _ROWS_MAX = 60, 4000
# Of stiffness, load, damping, inertia; friction of a slow cart looks a little like the last two.
_SMALLEST = np.array([0.005, 0.005, 0.05, 0.01])
# While a change is active, another one must be larger by this factor.
_FURTHER = np.array([2.0, 2.0, 4.0, 4.0])
_EXACT = ChangeAccuracy(np.ones(4), np.zeros(4), _SMALLEST)


def learn_machine(
    runs: Sequence[Run],
    lines: Lines,
    *,
    input: str,
    output: str,
    schedule: str,
    radius_m: float,
    covariates: Sequence[str] = (),
) -> LearnedMachine:
    """The Machine that is common to all runs.

    Two masses are fitted to single windows first, as `MotionCorrection` does; then the model is driven through every
    run and corrected by its residual until it converges (Gauss–Newton on the output's error). The runs should contain
    every speed, both directions and the whole travel: other motion is not monitored.
    `covariates` name channels, such as a temperature, that the four parameters may depend on linearly.

    Raises
    ------
    BaselineError
        If the runs contain too little steady motion, or a covariate is constant.
    FitError
        If no two-mass model fits them.
    """
    names = input, output, schedule, *covariates
    rows, speed, covariate = _first_look(runs, lines, names)
    low, high = float(rows.position_m.min()), float(rows.position_m.max())
    splines = _SPLINES if high - low > _FLAT_M else (1, 1)
    fit = MotionFitOptions(lines.z, lines.rate_hz, radius_m, *splines)
    model = fit.refine(rows, fit.start(rows))
    slowest, fastest = float(np.abs(speed).min()), float(np.abs(speed).max())
    machine = LearnedMachine(
        model=model,
        noise_power=np.ones(len(lines)),
        quiet_power=np.full(len(lines.quiet), np.inf),
        held=_EXACT,
        free=_EXACT,
        slowest_m_per_s=slowest,
        fastest_m_per_s=fastest,
        windows=cells(rows.position_m, low, high),
        information=np.zeros(len(DIRECTIONS)),
        amplitude=InputAmplitude.unlimited(len(lines)),
        swing=np.inf,
        covariates=with_range(tuple(covariates), covariate) if covariates else Covariates(),
    )
    machine = _fitted(runs, machine, lines, names, passes=2)
    for _ in range(_SEARCHES):
        orders = find_orders((run() for run in runs), machine, lines, names)
        if set(orders) == set(machine.ripple.cycles_per_m):
            break
        machine = replace(machine, ripple=Ripple.of(orders))
        machine = _with_noise(machine, Evidence.join(_all_seen(runs, machine, lines, names)))
        machine = _fitted(runs, machine, lines, names, passes=2)
    machine = _fitted(runs, machine, lines, names)
    parts = _all_seen(runs, machine, lines, names)
    machine = _with_uncertainty(parts, machine, lines.rate_hz)
    if (between := between_runs(parts, _SMALLEST)) is not None:
        machine, parts = _fitted_separately(runs, replace(machine, between=between), lines, names)
    if len(machine.ripple):
        peak_n_m = peak_torques((run() for run in runs), machine, lines, names)
        machine = replace(machine, ripple=replace(machine.ripple, peak_n_m=peak_n_m))
    return _judged(Evidence.join(parts), machine)


def _fitted(
    runs: Sequence[Run], machine: LearnedMachine, lines: Lines, names: tuple[str, ...], passes: int = _PASSES
) -> LearnedMachine:
    """The model, noise and ripple that all runs share (Gauss–Newton on the output's error)."""
    for _ in range(passes):
        parts = _all_seen(runs, machine, lines, names)
        machine = _with_noise(machine, Evidence.join(parts))
        step = step_of(normal(parts, machine, lines.rate_hz), machine)
        machine = moved(machine, step, lines.rate_hz)
        if np.max(np.abs(step)) < _CONVERGED:
            break
    return machine


def _fitted_separately(
    runs: Sequence[Run], machine: LearnedMachine, lines: Lines, names: tuple[str, ...]
) -> tuple[LearnedMachine, list[Evidence]]:
    """The Machine whose runs have an offset each, and its residuals.

    Without the offsets, differences between runs would appear as differences between positions, because no two runs
    visit all positions equally often.
    """
    assert machine.between is not None
    own = np.zeros(len(runs))
    for _ in range(_PASSES):
        parts = _all_seen(runs, machine, lines, names, own)
        step, own = joint_step(parts, machine, own, lines.rate_hz)
        machine = moved(machine, step, lines.rate_hz)
        if np.max(np.abs(step)) < _CONVERGED:
            break
    return machine, _all_seen(runs, machine, lines, names, own)


def _with_noise(machine: LearnedMachine, seen: Evidence) -> LearnedMachine:
    """The Machine with the noise of these windows, and the size of the ripple."""
    if not len(machine.ripple):
        return replace(machine, noise_power=seen.power.mean(axis=0))
    ripple = Ripple(machine.ripple.cycles_per_m, amplitudes(seen.ripple_score, seen.ripple_information))
    noise = noise_power(seen.power, seen.ripple_gain, ripple)
    seen_most = np.einsum("woo->wo", seen.ripple_information).max(axis=0)
    matters = (ripple.spread**2 * seen_most).reshape(-1, 2).max(axis=1) > _MATTERS
    return replace(machine, ripple=ripple.only(matters), noise_power=noise)


def _first_look(runs: Sequence[Run], lines: Lines, names: tuple[str, ...]) -> tuple[WeightedResponses, Floats, Floats]:
    """Responses of single steady windows that are fast enough, their speeds, and covariates' known values by time."""
    u, y, centre, speed, covariate = (np.concatenate(part) for part in zip(*_spectra(runs, lines, names)))
    fastest = np.max(np.abs(speed), initial=0.0)
    use = np.flatnonzero((np.abs(speed) >= _SLOWEST * fastest) & np.all(np.abs(u) > 0, axis=1))
    if use.size < _ROWS_MIN or fastest == 0:
        raise BaselineError(
            "too-few-windows",
            f"the runs contain {use.size} windows of steady motion along {names[2]!r}, less than the {_ROWS_MIN} that "
            "a model of the moving machine needs",
            "give longer runs, or a shorter window",
            channel=names[2],
            windows=int(use.size),
            windows_min=_ROWS_MIN,
        )
    known = covariate[use][np.isfinite(covariate[use]).all(axis=1)]
    use = use[np.argsort(centre[use], kind="stable")]
    chosen = use[np.unique(np.linspace(0, use.size - 1, _ROWS_MAX).round().astype(int))]
    return WeightedResponses(y[chosen] / u[chosen], np.abs(u[chosen]), centre[chosen]), speed[use], known


def _spectra(runs: Sequence[Run], lines: Lines, names: tuple[str, ...]) -> Iterator[tuple[NDArray[Any], ...]]:
    transform, window = wave(lines.bins, lines.window), lines.window
    for run in runs:
        stretches = Stretches(names, window, lines.rate_hz)
        for stretch in (s for block in run() for s in stretches.process(block)):
            bad = missing(stretch.data[:SIGNALS])
            u, y, x = held(stretch.data[:SIGNALS], bad)
            begin = np.arange(stretch.first, stretch.last) * window - stretch.start
            centre, speed, even = way(x, begin, window, lines.rate_hz)
            cut = begin[:, np.newaxis] + np.arange(window)
            use = even & ~bad[cut].any(axis=1)
            covariate = window_means(stretch.data[SIGNALS:], begin, window)
            yield u[cut[use]] @ transform, y[cut[use]] @ transform, centre[use], speed[use], covariate[use]


def _all_seen(
    runs: Sequence[Run], machine: LearnedMachine, lines: Lines, names: tuple[str, ...], own: Floats | None = None
) -> list[Evidence]:
    """Residuals of each run, with its own offset along the direction between runs."""
    if machine.between is None or own is None:
        return [_seen(run, machine, lines, names, Offset()) for run in runs]
    offsets = [Offset(machine.between.direction * amount) for amount in own]
    return [_seen(run, machine, lines, names, offset) for run, offset in zip(runs, offsets)]


def _seen(run: Run, machine: LearnedMachine, lines: Lines, names: tuple[str, ...], offset: Offset) -> Evidence:
    """Residuals of the model for a run, judged windows only."""
    source, stretches = ModelEvidence(machine, lines), Stretches(names, lines.window, lines.rate_hz)
    parts = [source.process(stretch, offset) for block in run() for stretch in stretches.process(block)]
    parts += [source.process(stretch, offset) for stretch in stretches.finish()]
    if not parts:
        raise BaselineError(
            "too-few-windows",
            "a run is shorter than twelve windows",
            "leave it out, or give a longer one",
            windows_min=12,
            window=lines.window,
        )
    seen = Evidence.join(parts)
    return seen[seen.judged]


def _with_uncertainty(parts: Sequence[Evidence], machine: LearnedMachine, rate_hz: float) -> LearnedMachine:
    """The Machine with the covariance of the covariates' slopes, from fits with one run omitted each."""
    covariates, c = machine.covariates, len(machine.covariates)
    if not c:
        return machine
    seen = Evidence.join(parts)
    gradient, matrix = normal_of(seen, machine, rate_hz)
    slopes = []
    for part in parts_of([len(run) for run in parts]):
        without = normal_of(seen[part], machine, rate_hz)
        step = step_of((gradient - without[0], matrix - without[1]), machine)
        slopes.append(step[-1 - len(DIRECTIONS) * c : -1])
    scale = np.tile(1 / covariates.half_range, len(DIRECTIONS))
    own = (jackknife(np.array(slopes)) * np.outer(scale, scale)).reshape(len(DIRECTIONS), c, len(DIRECTIONS), c)
    return replace(machine, covariates=replace(covariates, covariance=np.einsum("jcjd->jcd", own)))


def _judged(seen: Evidence, machine: LearnedMachine) -> LearnedMachine:
    """The Machine with its noise, and with the correlation of neighbouring windows and whole stretches."""
    held = accuracy(seen.score, np.einsum("rjj->rj", seen.information), _SMALLEST)
    if (between := machine.between) is not None:
        score, information = between.projected(seen.score, seen.information, _SMALLEST)
        held = held.at_least(accuracy(score, np.einsum("rjj->rj", information), _SMALLEST))
        held = held.widened(KNOWN * np.abs(between.direction))
    # With all others free: the remaining score of a direction, and its information.
    inverse = np.linalg.inv(seen.information)
    information = 1 / np.einsum("rjj->rj", inverse)
    score = information * np.einsum("rjk,rk->rj", inverse, seen.score)
    unsure = machine.covariates.uncertainty() if len(machine.covariates) else 0.0
    return replace(
        machine,
        quiet_power=seen.quiet_power.mean(axis=0),
        held=held.widened(unsure),
        free=accuracy(score, information, _FURTHER * _SMALLEST).widened(np.hypot(unsure, scatter_error(information))),
        windows=cells(seen.position_m, machine.model.low_m, machine.model.high_m),
        information=np.einsum("rjj->j", seen.information) / len(seen),
        amplitude=InputAmplitude.of(seen.amplitude),
        swing=float(seen.swing.max()),
    )
