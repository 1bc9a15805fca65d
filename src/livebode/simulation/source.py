"""SimulatedAxis: a BeltAxis as a source of Blocks, with its truth."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import ceil

import numpy as np

from livebode.arrays import Floats, Integers
from livebode.core import Block, Channel, UsageError
from livebode.dataclass import dataclass
from livebode.simulation._axis import Engine
from livebode.simulation.configuration import BeltAxis, engine_settings
from livebode.simulation.delivery import CHANNELS, checked_block_samples, delivered, diverged, excitation_at
from livebode.simulation.faults import Condition
from livebode.simulation.truth import Truth


@dataclass(frozen=True, eq=False)
class SimulatedAxis:
    """A simulated machine. Every iteration starts it again at the motion's start, at rest or run in (`run_in_s`).

    Channels: w and u (N m, as applied), velocity and position of the motor as the drive reads them, the cart's
    position x, and the references of the motor. They do not depend on how the samples are cut into Blocks.

    Examples
    --------
    >>> axis = SimulatedAxis(BeltAxis(excitation_n_m=np.sin(2 * np.pi * np.arange(100) / 100), seconds=0.5))
    >>> [len(block) for block in axis.blocks(["u", "velocity"], block_samples=1500)]
    [1500, 500]
    >>> block, truth = axis.run()
    >>> len(block), float(truth.stiffness_n_per_m[0])
    (2000, 500000.0)
    """

    axis: BeltAxis

    @property
    def channels(self) -> tuple[Channel, ...]:
        return CHANNELS

    @property
    def rate_hz(self) -> float:
        return self.axis.drive.rate_hz

    @property
    def samples(self) -> int | None:
        """Samples of the run; None without end."""
        return self.axis.samples

    def blocks(
        self,
        channels: Sequence[str] | None = None,
        block_samples: int = 4096,
        *,
        real_time: bool = False,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], object] = time.sleep,
    ) -> Iterator[Block]:
        """The samples from the first to the last, as fast as possible, or with `real_time` none before its time.

        Raises
        ------
        UsageError
            Immediately for a missing channel or a block size that is not an integer ≥ 1.
        SimulationError
            While iterating, when the state is not finite or the cart leaves its limits.
        """
        return delivered((block for block, _ in self.pairs(block_samples)), channels, real_time, clock, sleep)

    def pairs(
        self, block_samples: int = 4096, excitation: Callable[[Integers], Floats] | None = None
    ) -> Iterator[tuple[Block, Truth]]:
        """Blocks of all channels, each with the truth of its samples.

        `excitation` gives w at the numbers of the samples of a Block when its turn comes, instead of the axis's period.
        """
        checked_block_samples(block_samples)
        return self._pairs(block_samples, excitation or partial(excitation_at, self.axis.excitation_n_m))

    def run(self) -> tuple[Block, Truth]:
        """The whole run as one Block, with its truth; UsageError for one without end."""
        if self.samples is None:
            raise UsageError(
                "out-of-range",
                "seconds=inf: an infinite run does not fit into one block",
                "specify seconds, or use blocks",
                argument="seconds",
            )
        return next(self.pairs(max(1, self.samples)))

    def _pairs(self, block_samples: int, excitation: Callable[[Integers], Floats]) -> Iterator[tuple[Block, Truth]]:
        axis = self.axis
        position, speed = (row / axis.mechanics.radius_m for row in axis.motion.cycle(self.rate_hz))
        engine = Engine(engine_settings(axis), float(position[0]) * axis.mechanics.radius_m)
        noise, disturbance = np.random.default_rng(axis.seed), np.random.default_rng([axis.seed, 2])
        self._run_in(engine, float(position[0]))
        start = 0
        while self.samples is None or start < self.samples:
            ticks = block_samples if self.samples is None else min(block_samples, self.samples - start)
            number = np.arange(start, start + ticks)
            condition = axis.condition(number / self.rate_hz)
            w = excitation(number)
            references = [row[number % row.size] for row in (position, speed)]
            torque = self._torque_noise(disturbance, ticks)
            inputs = np.array([*references, w, self._noise(noise, ticks), *_rows(condition), torque])
            output = self._advanced(engine, inputs, start)
            data = np.vstack([w, output[:3], output[-2], inputs[:2]])
            yield Block(data, CHANNELS, self.rate_hz, start=start), Truth(axis, start, output[3:], condition)
            start += ticks

    def _run_in(self, engine: Engine, position_reference: float) -> None:
        axis = self.axis
        # Whole repetitions of the slowest controller, so that sample 0 is one of its ticks, as without a run-in.
        every = axis.drive.position_ticks
        ticks = every * ceil(axis.run_in_s * self.rate_hz / every)
        if not ticks:
            return
        number = np.arange(-ticks, 0)
        w = excitation_at(axis.excitation_n_m, number)
        references = [np.full(ticks, position_reference), np.zeros(ticks)]
        noise = self._noise(np.random.default_rng([axis.seed, 1]), ticks)
        torque = self._torque_noise(np.random.default_rng([axis.seed, 3]), ticks)
        condition = axis.condition(np.zeros(ticks))
        self._advanced(engine, np.array([*references, w, noise, *_rows(condition), torque]), -ticks)

    def _noise(self, generator: np.random.Generator, ticks: int) -> Floats:
        sigma = self.axis.sensor.noise_rad_per_s
        return sigma * generator.standard_normal(ticks) if sigma else np.zeros(ticks)

    def _torque_noise(self, generator: np.random.Generator, ticks: int) -> Floats:
        sigma = self.axis.drive.torque_noise_n_m
        return sigma * generator.standard_normal(ticks) if sigma else np.zeros(ticks)

    def _advanced(self, engine: Engine, inputs: Floats, start: int) -> Floats:
        ticks = inputs.shape[1]
        output = np.empty((3 + len(engine.plant), ticks))
        done = engine.advance(inputs, output)
        if done < ticks:
            low, high = self.axis.limits.stops_m
            why = f"the state is not finite, or the cart is outside {low:g} … {high:g} m"
            raise diverged((start + done) / self.rate_hz, engine.plant, why)
        return output


def _rows(condition: Condition) -> list[Floats]:
    return [condition.stiffness, condition.damping, condition.load_kg, condition.gap_m, condition.friction]
