"""A learned machine that the tests of the monitoring share."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Any

import numpy as np

from livebode.core import Block, Event
from livebode.monitoring import Machine, MachineMonitor, learn_machine, seconds_between
from livebode.monitoring.accuracy import Accuracy
from livebode.motion import Curve, MovingModel
from livebode.motion.model import basis
from livebode.simulation import Mechanics, SimulatedAxis
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


def ideal() -> Machine:
    """The study's axis as it is, learned from nothing: two masses along the way, white noise, no scatter."""
    mechanics, splines = Mechanics(), 12
    at = np.linspace(LOW_M, HIGH_M, 200)
    spans = 1 / at + 1 / (2 * mechanics.pulley_distance_m - at)
    nominal = mechanics.nominal_position_m
    stiffness = spans / (1 / nominal + 1 / (2 * mechanics.pulley_distance_m - nominal))
    weights = np.linalg.lstsq(basis(at, LOW_M, HIGH_M, splines), np.log(stiffness))[0]
    # The motor's shaft feels them, as with `learn`: a radius of 1 m.
    arm = 2 * np.log(mechanics.radius_m)
    model = MovingModel(
        mechanics.inertia_kg_m2,
        mechanics.load_kg * mechanics.radius_m**2,
        1.0,
        Curve(LOW_M, HIGH_M, weights + np.log(mechanics.stiffness_n_per_m) + arm),
        Curve(LOW_M, HIGH_M, weights / 2 + np.log(mechanics.damping_n_s_per_m) + arm),
    )
    power = LINES.window * 0.1**2
    held, free = ([0.005, 0.005, 0.05, 0.01], [0.01, 0.01, 0.2, 0.04])
    return Machine(
        model,
        np.full(len(LINES), power),
        np.full(len(LINES.quiet), power),
        *(Accuracy(np.ones(4), np.zeros(4), np.array(smallest)) for smallest in (held, free)),
        0.1,
        0.4,
        np.full(28, 10),
    )
