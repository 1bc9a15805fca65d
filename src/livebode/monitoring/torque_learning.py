"""From healthy runs to a LearnedTorque: what friction and orders scatter from section to section and between runs."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import BaselineError, Block, SignalError, normal_quantile, t_quantile
from livebode.monitoring.accuracy import ChangeAccuracy, accuracy
from livebode.monitoring.learned_torque import (
    LearnedTorque,
    friction_names,
    friction_values,
    order_names,
)
from livebode.monitoring.stretches import SECTION_S, Sections
from livebode.monitoring.table import FRICTION, ORDERS, STILL, WAYS, WINDOWS_MIN, ScheduleTable
from livebode.monitoring.torque_model import (
    OrderWindows,
    StrokeFriction,
    TorqueModel,
    TorqueNoise,
    normal_values,
    powers,
    together,
)
from livebode.motion import OutputKind, Shaft

Run = Callable[[], Iterable[Block]]

_MODEL_S = 120.0  # of a run: more strokes do not make the model better than the axis is constant
_SLOW_AND_FAST = 1.5  # quotient of speeds, from which on slow and fast strokes are judged separately
_SMALLEST, _SCATTER = 0.1, 0.02  # of friction and of amplitudes: usual changes by temperature and lubrication
_SHOWN = 4.0  # standard deviations of a section: such a change is found within about three of them
_RARE = 1e-7  # probability beyond which the few learned sections do not know the scatter
_BETWEEN = 0.975
_SEEN = 3.0  # standard deviations of the noise's power, from which on a healthy axis has an order


def learn_torque(
    runs: Sequence[Run],
    *,
    input: str,
    output: str,
    kind: OutputKind,
    lines_hz: Floats,
    turn: float = 2 * np.pi,
    shafts: Sequence[Shaft] = (),
) -> LearnedTorque:
    """Friction and orders that are common to all runs, in sections of 10 s.

    Parameters
    ----------
    runs
        Samples of each, usual strokes with both directions.
    input, output, kind
        Channels, and whether the output is a position or a velocity.
    lines_hz
        Frequencies of the excitation, which are not orders.
    turn
        Units of the output, or of its integral if it is a velocity, in one turn of the motor.
    shafts
        Shafts and orders to monitor; none: friction only.

    Raises
    ------
    SignalError
        If no run shows inertia and friction.
    BaselineError
        If the runs have fewer than eight sections with motion.
    """
    model = _model(runs, (input, output), kind, turn, shafts, lines_hz)
    strokes: list[StrokeFriction] = []
    orders: list[list[OrderWindows]] = []
    ends: list[int] = []
    units: tuple[str, ...] = ("", "")
    for run in runs:
        for block in (sections := _Cut(run, (input, output))):
            friction, windows = model.section(block[0], block[1], sections.rate_hz)
            if friction.speed.size:
                strokes.append(friction)
                orders.append(windows)
        ends.append(len(strokes))
        units = sections.units
    if len(strokes) < WINDOWS_MIN:
        raise BaselineError(
            "too-few-windows",
            f"the runs contain {len(strokes)} sections of {SECTION_S:g} s with strokes, less than the "
            f"{WINDOWS_MIN} that friction and orders need",
            "give longer runs, or more of them",
            windows=len(strokes),
            windows_min=WINDOWS_MIN,
        )
    middle = _middle(strokes)
    values = np.array([friction_values(friction, middle) for friction in strokes])
    table = _table(FRICTION, friction_names(middle, model, _speed_unit(units[1], kind)), values, ends)
    learned = LearnedTorque(model, middle, None, np.zeros(0), np.zeros(0), table, None)
    return _with_orders(learned, orders, ends, units[0]) if shafts else learned


class _Cut:
    """Sections of a run as they come, with what their blocks tell."""

    def __init__(self, run: Run, names: tuple[str, str]) -> None:
        self._run, self._names = run, names
        self.rate_hz = 0.0
        self.units: tuple[str, ...] = ("", "")

    def __iter__(self) -> Iterator[Floats]:
        sections: Sections | None = None
        for block in self._run():
            if sections is None:
                self.rate_hz = block.rate_hz
                self.units = tuple(block.channels[block.index(name)].unit for name in self._names)
                sections = Sections(self._names, block.rate_hz)
            yield from (section.data for section in sections.process(block))


def _model(
    runs: Sequence[Run], names: tuple[str, str], kind: OutputKind, turn: float, shafts: Sequence[Shaft], lines: Floats
) -> TorqueModel:
    """From the first run that shows inertia and friction; SignalError of the last one if none does."""
    for run in runs:
        try:
            return TorqueModel.of(_beginning(run), names, kind, turn, shafts, lines)
        except SignalError as error:
            failed = error
    raise failed


def _beginning(run: Run) -> Block:
    """Samples up to the first gap, at most two minutes."""
    parts: list[Block] = []
    for block in run():
        bad = ~np.isfinite(block.data).all(axis=0)
        if bad.any() or (parts and (block.gap or block.start != parts[-1].stop)):
            break
        parts.append(block)
        if (block.stop - parts[0].start) / block.rate_hz >= _MODEL_S:
            break
    if not parts:
        raise SignalError("too-short", "the run begins with a gap", "leave it out, or give another one", samples=0)
    return replace(parts[0], data=np.concatenate([part.data for part in parts], axis=1))


def _speed_unit(output: str, kind: OutputKind) -> str:
    return output if kind == "velocity" or not output else f"{output}/s"


def _middle(strokes: Sequence[StrokeFriction]) -> float:
    """Speed between slow and fast strokes; 0 if they have about one speed."""
    speeds = np.abs(np.concatenate([friction.speed for friction in strokes]))
    low, middle, high = np.quantile(speeds, [0.1, 0.5, 0.9])
    return float(middle) if high >= _SLOW_AND_FAST * low else 0.0


def _with_orders(learned: LearnedTorque, orders: list[list[OrderWindows]], ends: list[int], unit: str) -> LearnedTorque:
    """With the orders, if any window shows some."""
    windows = [window for section in orders for window in section]
    if not any(np.isfinite(window.value).any() for window in windows):
        return learned
    noise = TorqueNoise.of(windows)
    each = [powers(section, noise) for section in orders]
    square, own = (np.array(part) for part in zip(*each))
    usual = np.median(own, axis=0)
    weight = np.where(np.isfinite(square), 1 / own, 0.0)
    total = np.maximum(weight.sum(axis=0), np.finfo(float).tiny)
    beyond = np.nansum(weight * square - (weight > 0), axis=0)  # noise alone: a variance of 1 for each section
    true = np.where(beyond > _SEEN * np.sqrt(np.count_nonzero(weight, axis=0)), beyond / total, 0.0)
    shafts = learned.model.shafts
    values = [np.concatenate([normal_values(s, o, true, usual), together(s, o, true, shafts)]) for s, o in each]
    table = replace(_table(ORDERS, order_names(shafts), np.array(values), ends), unit=unit)
    return replace(learned, noise=noise, true=true, usual=usual, orders=table)


def _table(quantity: str, names: tuple[str, ...], values: Floats, ends: Sequence[int]) -> ScheduleTable:
    """Mean, variance and accuracy of values in the order of time, (sections, components); NaN where not known."""
    count = np.isfinite(values).sum(axis=0)
    enough = count >= WINDOWS_MIN
    mean = np.where(enough, _mean(values), np.nan)
    relative = values / mean - 1
    within = np.concatenate([part - _mean(part) for part in _runs(relative, ends)])
    lost = np.sum([np.isfinite(part).any(axis=0) for part in _runs(relative, ends)], axis=0)
    variance = np.where(enough, _mean(within**2) * count / np.maximum(count - lost, 1), np.nan)
    size = len(names)
    table = ScheduleTable(
        quantity, names, 0.0, 0.0, 0.0,
        _in_cell(mean).astype(np.complex128), _in_cell(variance[:, np.newaxis, np.newaxis]), _in_cell(np.zeros(size)),
        np.array([[len(values) if way == STILL else 0 for way in range(WAYS)]]),
        ChangeAccuracy(np.ones(size), np.zeros(size), np.ones(size)),
    )  # fmt: skip
    return replace(table, accuracy=_accuracy(within, variance, count - lost, _between(relative, variance, ends)))


def _in_cell(values: Floats) -> Floats:
    """These values as those of the only cell, (1, ways, …)."""
    cells = np.full((1, WAYS, *values.shape), np.nan)
    cells[0, STILL] = values
    return cells


def _accuracy(within: Floats, variance: Floats, dof: NDArray[np.intp], between: Floats) -> ChangeAccuracy:
    """Accuracy of a change; `within` are the deviations from the mean of each run, and the variance has so many `dof`.

    Few sections know their scatter badly: Student's t beyond a probability of 1e-7 counts as more noise.
    """
    enough = np.isfinite(variance)
    known = np.where(enough, np.maximum(variance, np.finfo(float).tiny), 1.0)
    seen = np.isfinite(within) & enough
    information = np.where(seen, 1 / known, 0.0)
    score = np.where(seen, within, 0.0) * information
    own = accuracy(score, information, np.full(known.size, _SMALLEST), np.sqrt(known / np.maximum(dof, 1)))
    own = own.widened(np.hypot(_SCATTER, between))
    few = np.array([(t_quantile(1 - _RARE, max(int(n), 1)) / normal_quantile(1 - _RARE)) ** 2 for n in dof])
    inflation = np.where(enough, own.inflation * few, 1.0)
    smallest = np.maximum(own.smallest, _SHOWN * np.sqrt(inflation * known))
    return ChangeAccuracy(inflation, np.where(enough, own.scatter, 0.0), np.where(enough, smallest, 1.0))


def _between(relative: Floats, variance: Floats, ends: Sequence[int]) -> Floats:
    """Standard deviation of the difference of a run from the others beyond chance, (components,); 0 if it is not known.

    That of few runs is widened by Student's t.
    """
    runs = _runs(relative, ends)
    means = np.array([_mean(part) for part in runs])
    chance = _mean(np.array([variance / np.maximum(np.isfinite(part).sum(axis=0), 1) for part in runs]))
    many = np.isfinite(means).sum(axis=0)
    beyond = _mean((means - _mean(means)) ** 2) * many / np.maximum(many - 1, 1) - chance
    few = np.array([t_quantile(_BETWEEN, max(int(n) - 1, 1)) / normal_quantile(_BETWEEN) for n in many])
    return np.where((many > 1) & (beyond > 0), np.sqrt(np.maximum(beyond, 0.0)) * few, 0.0)


def _runs(values: Floats, ends: Sequence[int]) -> list[Floats]:
    """The values of each run that has some."""
    return [part for part in np.split(values, list(ends)[:-1]) if len(part)]


def _mean(values: Floats) -> Floats:
    """Mean of what is known, (columns,); NaN without any."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.asarray(np.nanmean(values, axis=0))
