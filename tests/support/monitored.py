"""A learned machine that the tests of the monitoring share."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from livebode.core import Block, Event, Lines
from livebode.monitoring import (
    DEFAULT_INTERVAL_S,
    Baseline,
    LearnedMachine,
    MachineMonitor,
    WindowRows,
    learn_machine,
    learn_table,
)
from livebode.monitoring.accuracy import ChangeAccuracy
from livebode.monitoring.amplitude import InputAmplitude
from livebode.monitoring.between_runs import BetweenRuns
from livebode.monitoring.covariates import Covariates
from livebode.motion import MovingModel, PositionCurve, basis
from livebode.simulation import (
    BeltAxis,
    Friction,
    Mechanics,
    Motion,
    Sensor,
    SimulatedAxis,
    StrokeSequence,
)
from tests.support.axes import LINES, MULTISINE, RATE_HZ
from tests.support.shared import shared

NAMES = ("u", "velocity", "x")
CHANNELS = ("w", *NAMES)
LOW_M, HIGH_M, SPEED_M_PER_S = 0.25, 1.6, 0.38
RADIUS_M = Mechanics().radius_m
THERE, BACK = (LOW_M, HIGH_M), (HIGH_M, LOW_M)


@shared
def machine() -> LearnedMachine:
    """From twelve strokes of random speed."""
    return learn_machine(healthy_runs(2, 6), LINES, input="u", output="velocity", schedule="x", radius_m=RADIUS_M)


def watcher(interval_s: float = DEFAULT_INTERVAL_S) -> MachineMonitor:
    return MachineMonitor(machine(), LINES, NAMES, interval_s)


def strokes(speeds: Sequence[float], ends: tuple[float, float] = THERE) -> StrokeSequence:
    """Forth and back between the ends, each at its speed."""
    points = tuple(ends[i % 2] for i in range(len(speeds) + 1))
    return StrokeSequence(turning_points_m=points, speeds_m_per_s=tuple(speeds))


def axis(motion: Motion, seed: int, **options: Any) -> BeltAxis:
    """σ = 0.1 rad/s, friction of 15 N, 20-bit encoder; a sequence of strokes in whole, with two windows after it."""
    if isinstance(motion, StrokeSequence):
        options.setdefault("seconds", float(motion.edges_s(RATE_HZ)[-1]) + 2 * LINES.window / RATE_HZ)
    given: dict[str, Any] = {
        "excitation_n_m": MULTISINE,
        "friction": Friction(load_coulomb_n=15.0),
        "sensor": Sensor(noise_rad_per_s=0.1, encoder_counts_per_turn=1 << 20),
        "seconds": 10.0,
    }
    return BeltAxis(motion=motion, seed=seed, **(given | options))


def blocks(machine: BeltAxis) -> Iterator[Block]:
    return iter(SimulatedAxis(machine).blocks(CHANNELS, block_samples=40000))


def healthy_runs(count: int, each: int, seed: int = 5000) -> list[Callable[[], Iterable[Block]]]:
    """Recordings to learn from, of strokes at 0.3 to 1 times 0.38 m/s, the first in a random direction."""
    generator, runs = np.random.default_rng(seed), []
    for i in range(count):
        speeds = SPEED_M_PER_S * generator.uniform(0.3, 1.0, each)
        motion = strokes(speeds.tolist(), THERE if generator.uniform() < 0.5 else BACK)
        runs.append(partial(iter, list(blocks(axis(motion, seed + i)))))
    return runs


def recorded(
    speeds: Sequence[float], *faults: Any, seed: int = 1, ends: tuple[float, float] = THERE, **options: Any
) -> Block:
    """One block with all samples."""
    simulated = SimulatedAxis(axis(strokes(speeds, ends), seed, faults=faults, **options))
    block, _ = simulated.run()
    return Block(block.data[[block.index(n) for n in CHANNELS]], CHANNELS, block.rate_hz)


def pieces(block: Block, sizes: Iterable[int]) -> Iterable[Block]:
    """The block cut at these sizes, again and again."""
    sizes, at = list(sizes), 0
    for i in range(len(block)):
        step = sizes[i % len(sizes)]
        yield block.cut(at, at + step)
        at += step
        if at >= len(block):
            return


def changes_of(events: Iterable[Event]) -> list[tuple[str, str]]:
    """Kind and what of each event."""
    return [(e.kind, str(e.details.get("what", e.details.get("reason")))) for e in events]


def changed(block: Block, edit: Callable[[np.ndarray], None]) -> Block:
    """A copy of the block whose data was edited."""
    data = block.data.copy()
    edit(data)
    return Block(data, block.channels, block.rate_hz, block.start)


def ideal() -> LearnedMachine:
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
        PositionCurve(LOW_M, HIGH_M, weights + np.log(mechanics.stiffness_n_per_m) + arm),
        PositionCurve(LOW_M, HIGH_M, weights / 2 + np.log(mechanics.damping_n_s_per_m) + arm),
    )
    power = LINES.window * 0.1**2
    held, free = ([0.005, 0.005, 0.05, 0.01], [0.01, 0.01, 0.2, 0.04])
    return LearnedMachine(
        model,
        np.full(len(LINES), power),
        np.full(len(LINES.quiet), power),
        *(ChangeAccuracy(np.ones(4), np.zeros(4), np.array(smallest)) for smallest in (held, free)),
        0.1,
        0.4,
        np.full(28, 10),
        np.array([1e6, 5e5, 1e3, 5e5]),
        InputAmplitude(*np.ones((3, len(LINES)))),
        0.5,
    )


def small_baseline() -> Baseline:
    lines = Lines.parse("20:140:20", rate_hz=4000, window=400)
    generator = np.random.default_rng(1)
    noise = generator.standard_normal((2, 40, len(lines)))
    rows = WindowRows(
        1 + 0.01 * (noise[0] + 1j * noise[1]), np.full(noise[0].shape, 2e-4), np.zeros(40), np.zeros(40),
        0.1 * np.arange(40), 400 * np.arange(40) + 399, np.ones(40, dtype=bool),
    )  # fmt: skip
    table = learn_table("lines", [f"{f:g} Hz" for f in lines.frequency_hz], [rows])
    curve, known = PositionCurve(0.2, 1.6, np.zeros(12)), ChangeAccuracy(np.ones(4), np.zeros(4), np.full(4, 0.01))
    machine = LearnedMachine(
        MovingModel(0.003, 7.0, 1.0, curve, curve), np.ones(len(lines)), np.ones(len(lines.quiet)), known, known,
        0.1, 0.4, np.full(28, 9), np.full(4, 1e5), InputAmplitude(*np.ones((3, len(lines)))),
        0.5,
        covariates=Covariates(
            ("temperature",), np.array([20.0]), np.array([15.0]), np.array([25.0]),
            np.array([[-0.002], [0.0], [0.0], [0.0]]), np.zeros((4, 1, 1)),
        ),
        between=BetweenRuns(np.array([0.005, 0.0, 0.0, 0.0]), 1.5),
    )  # fmt: skip
    signals = {"output": "velocity", "input": "u", "excitation": "w", "schedule": "x"}
    return Baseline(lines, 20, signals, "joint", "plant", (table,), machine)
