"""The simulated axis of the monitoring study: forward and return strokes of random speed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np

from livebode.core import Block, Lines
from livebode.estimation import Settings
from livebode.excitation import multisine
from livebode.simulation import BeltAxis, Friction, Sensor, SimulatedAxis, StrokeSequence

RATE_HZ, WINDOW = 4000.0, 400
LINES = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=WINDOW)
SETTINGS = Settings(lines=LINES, output="velocity", input="u", excitation="w", schedule="x")
CHANNELS = ["w", "u", "velocity", "x"]
LOW_M, HIGH_M, SPEED_M_PER_S = 0.25, 1.6, 0.38
RADIUS_M = 0.019


def strokes(count: int, generator: np.random.Generator) -> StrokeSequence:
    """Random speeds of 0.3 to 1 times 0.38 m/s, first in a random direction."""
    speeds = tuple(float(v) for v in SPEED_M_PER_S * generator.uniform(0.3, 1.0, count))
    ends = (LOW_M, HIGH_M) if generator.uniform() < 0.5 else (HIGH_M, LOW_M)
    return StrokeSequence(turning_points_m=between(ends, count), speeds_m_per_s=speeds)


def between(ends: tuple[float, float], count: int) -> tuple[float, ...]:
    """Turning points of so many strokes there and back."""
    return tuple(ends[i % 2] for i in range(count + 1))


def length_s(motion: StrokeSequence) -> float:
    return float(motion.edges_s(RATE_HZ)[-1])


def axis(motion: Any, seed: int, **options: Any) -> BeltAxis:
    """The axis of the targets: σ = 0.1 rad/s, friction of 15 N, 20-bit encoder."""
    whole_s = length_s(motion) + 2 * WINDOW / RATE_HZ if isinstance(motion, StrokeSequence) else 10.0
    seconds = options.pop("seconds", whole_s)
    given: dict[str, Any] = {
        "friction": Friction(load_coulomb_n=15.0),
        "sensor": Sensor(noise_rad_per_s=0.1, encoder_counts_per_turn=1 << 20),
    }
    return BeltAxis(motion=motion, excitation_n_m=multisine(LINES), seconds=seconds, seed=seed, **(given | options))


def run(machine: BeltAxis) -> Callable[[], Iterable[Block]]:
    return lambda: SimulatedAxis(machine).blocks(CHANNELS, block_samples=40000)


def healthy_runs(count: int = 4, each: int = 10, seed: int = 5000) -> list[Callable[[], Iterable[Block]]]:
    """Recordings to learn from, simulated once: learning goes through them many times."""
    generator = np.random.default_rng(seed)
    recorded = [list(run(axis(strokes(each, generator), seed + i))()) for i in range(count)]
    return [partial(iter, blocks) for blocks in recorded]
