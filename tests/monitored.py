"""A learned machine that the tests of the monitoring share."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Any

import numpy as np

from livebode.monitoring import Machine, MachineMonitor, learn_machine, seconds_between
from livebode.nouns import Block, Event
from livebode.simulation import SimulatedAxis
from studies.monitoring_axis import CHANNELS, HIGH_M, LINES, LOW_M, RADIUS_M, RandomStrokes, axis, healthy_runs

NAMES = ("u", "velocity", "x")
THERE, BACK = (LOW_M, HIGH_M), (HIGH_M, LOW_M)


@cache
def machine() -> Machine:
    """From twelve strokes of random speed."""
    return learn_machine(healthy_runs(2, 6), LINES, input="u", output="velocity", schedule="x", radius_m=RADIUS_M)


def watcher(asked: str = "one in 30 days of motion") -> MachineMonitor:
    return MachineMonitor(machine(), LINES, NAMES, seconds_between(asked))


def strokes(speeds: Sequence[float], ends: tuple[float, float] = THERE) -> RandomStrokes:
    return RandomStrokes(tuple(speeds), *ends)


def recorded(
    speeds: Sequence[float], *faults: Any, seed: int = 1, ends: tuple[float, float] = THERE, **options: Any
) -> Block:
    """One block with all samples."""
    simulated = SimulatedAxis(axis(strokes(speeds, ends), seed, faults=faults, **options))
    block, _ = simulated.run()
    return Block(block.data[[block.index(n) for n in CHANNELS]], tuple(CHANNELS), block.rate_hz)


def pieces(block: Block, sizes: Iterable[int]) -> Iterable[Block]:
    """The block cut at these sizes, again and again."""
    sizes, at = list(sizes), 0
    for i in range(len(block)):
        step = sizes[i % len(sizes)]
        yield block.cut(at, at + step)
        at += step
        if at >= len(block):
            return


def told(events: Iterable[Event]) -> list[tuple[str, str]]:
    """Kind and what of each event."""
    return [(e.kind, str(e.details.get("what", e.details.get("reason")))) for e in events]


def changed(block: Block, edit: Callable[[np.ndarray], None]) -> Block:
    """A copy of the block whose data was edited."""
    data = block.data.copy()
    edit(data)
    return Block(data, block.channels, block.rate_hz, block.start)
