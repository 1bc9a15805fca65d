"""Orders of a ripple, and their amplitudes, in the residual of a Machine's model for healthy runs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from livebode.arrays import Floats
from livebode.core import Block, Lines
from livebode.monitoring.evidence import JUDGED
from livebode.monitoring.machine import LearnedMachine
from livebode.monitoring.model_evidence import ModelEvidence
from livebode.monitoring.offset import Offset
from livebode.monitoring.stretches import Stretches
from livebode.motion import OrderSpectrum


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
