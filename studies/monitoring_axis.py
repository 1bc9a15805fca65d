"""The simulated axis of the monitoring study: forward and return strokes of random speed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from livebode.core import Block, Lines
from livebode.estimation import Settings
from livebode.excitation import multisine
from livebode.simulation import BeltAxis, Friction, Limits, Sensor, SimulatedAxis, Strokes

RATE_HZ, WINDOW = 4000.0, 400
LINES = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=WINDOW)
SETTINGS = Settings(lines=LINES, output="velocity", input="u", excitation="w", schedule="x")
CHANNELS = ["w", "u", "velocity", "x"]
LOW_M, HIGH_M, SPEED_M_PER_S = 0.25, 1.6, 0.38
RADIUS_M = 0.019


@dataclass(frozen=True)
class RandomStrokes:
    """Strokes one after the other, back and forth, each at its own speed; the first from `start_m`."""

    speeds_m_per_s: tuple[float, ...]
    start_m: float = LOW_M
    end_m: float = HIGH_M

    @cached_property
    def _cycle(self) -> tuple[np.ndarray, np.ndarray]:
        parts, ends = [], (self.start_m, self.end_m)
        for i, speed in enumerate(self.speeds_m_per_s):
            one = Strokes(start_m=ends[i % 2], end_m=ends[1 - i % 2], speed_m_per_s=speed).cycle(RATE_HZ)
            parts.append([row[: row.size // 2] for row in one])
        position, speed = (np.concatenate(rows) for rows in zip(*parts))
        return position, speed

    def cycle(self, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
        assert rate_hz == RATE_HZ
        return self._cycle

    def check(self, limits: Limits) -> None:
        for speed in self.speeds_m_per_s:
            Strokes(start_m=self.start_m, end_m=self.end_m, speed_m_per_s=speed).check(limits)

    @cached_property
    def edges_s(self) -> np.ndarray:
        """When each stroke begins (with its dwell), and when the last ends."""
        lengths = [
            Strokes(start_m=self.start_m, end_m=self.end_m, speed_m_per_s=v).cycle(RATE_HZ)[0].size // 2
            for v in self.speeds_m_per_s
        ]
        return np.concatenate([[0], np.cumsum(lengths)]) / RATE_HZ


def strokes(count: int, generator: np.random.Generator) -> RandomStrokes:
    """Random speeds of 0.3 to 1 times 0.38 m/s, first in a random direction."""
    speeds = tuple(float(v) for v in SPEED_M_PER_S * generator.uniform(0.3, 1.0, count))
    ends = (LOW_M, HIGH_M) if generator.uniform() < 0.5 else (HIGH_M, LOW_M)
    return RandomStrokes(speeds, *ends)


def axis(motion: Any, seed: int, **options: Any) -> BeltAxis:
    """The axis of the targets: σ = 0.1 rad/s, friction of 15 N, 20-bit encoder."""
    seconds = options.pop("seconds", motion.edges_s[-1] + 2 * WINDOW / RATE_HZ if hasattr(motion, "edges_s") else 10.0)
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
