"""Orders of a ripple in the residual of a Machine's model for healthy runs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Lines
from livebode.monitoring.evidence import JUDGED
from livebode.monitoring.machine import LearnedMachine
from livebode.monitoring.model_evidence import ModelEvidence
from livebode.monitoring.offset import Offset
from livebode.monitoring.stretches import Stretches
from livebode.motion.orders import OrderSpectrum

Floats = NDArray[np.float64]


def find_orders(
    runs: Iterable[Iterable[Block]], machine: LearnedMachine, lines: Lines, names: tuple[str, ...]
) -> Floats:
    """Orders in cycles a metre, the strongest first."""
    if machine.way_m == 0:
        return np.zeros(0)
    spectrum = OrderSpectrum(lines, machine.way_m, machine.slowest_m_per_s)
    for run in runs:
        for residual, position_m in _strokes(run, machine, lines, names):
            spectrum.add(residual, position_m)
    return spectrum.found()


def _strokes(
    run: Iterable[Block], machine: LearnedMachine, lines: Lines, names: tuple[str, ...]
) -> Iterator[tuple[Floats, Floats]]:
    """Residual and position of windows in a row that are judged."""
    source, stretches = ModelEvidence(machine, lines), Stretches(names, lines.window, lines.rate_hz)
    parts: list[tuple[Floats, Floats]] = []
    stop, sign = -1, 0.0
    for stretch in (s for block in run for s in stretches.process(block)):
        residual, position_m = source.residual(stretch, Offset())
        _, speed, status = source.way(stretch)
        for i, first in enumerate(range(stretch.first * lines.window, stretch.last * lines.window, lines.window)):
            forward, judged = float(np.sign(speed[i])), status[i] == JUDGED
            if parts and (first != stop or forward != sign or not judged):
                yield _joined(parts)
                parts = []
            if judged:
                cut = slice(first - stretch.start, first - stretch.start + lines.window)
                parts.append((residual[cut], position_m[cut]))
                stop, sign = first + lines.window, forward
    if parts:
        yield _joined(parts)


def _joined(parts: list[tuple[Floats, Floats]]) -> tuple[Floats, Floats]:
    residual, position_m = zip(*parts)
    return np.concatenate(residual), np.concatenate(position_m)
