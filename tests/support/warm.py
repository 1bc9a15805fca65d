"""A belt whose stiffness falls with the temperature, and a sensor beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial

import numpy as np

from livebode.core import Block, Channel, Event
from livebode.monitoring import DEFAULT_INTERVAL_S, LearnedMachine, MachineMonitor
from livebode.simulation import Fault, Friction, Mechanics, StrokeSequence, TensionLoss
from tests.support.axes import LINES, RATE_HZ
from tests.support.monitored import HIGH_M, LOW_M, NAMES, SPEED_M_PER_S, axis, blocks

PER_KELVIN, MEAN_C, DRIFT_K, SENSOR_K = 0.002, 22.0, 0.3, 0.05
Run = Callable[[], Iterable[Block]]


def from_anywhere(start_m: float, seed: int, seconds: float) -> StrokeSequence:
    """Strokes at random speeds from a position on, in a random direction, for at least so long."""
    generator, duration_s = np.random.default_rng(seed), 0.0
    end = HIGH_M if generator.uniform() < 0.5 else LOW_M
    points, speeds = [start_m], []
    while duration_s < seconds:
        speed = float(SPEED_M_PER_S * generator.uniform(0.3, 1.0))
        if abs(end - points[-1]) > 0.05:
            points.append(end)
            speeds.append(speed)
            stroke = StrokeSequence(turning_points_m=tuple(points[-2:]), speeds_m_per_s=(speed,))
            duration_s += float(stroke.edges_s(RATE_HZ)[-1])
        else:
            points[-1] = end
        end = LOW_M + HIGH_M - end
    return StrokeSequence(turning_points_m=tuple(points), speeds_m_per_s=tuple(speeds))


def at_temperature(kelvin: float, seed: int, *faults: Fault, seconds: float, inertia: float = 1.0) -> Run:
    """A run that far off the mean temperature, in which it rises a little."""
    healthy, generator = Mechanics(), np.random.default_rng([seed, 7])
    machine = axis(
        from_anywhere(float(generator.uniform(LOW_M, HIGH_M)), seed, seconds),
        seed,
        seconds=seconds,
        faults=(TensionLoss(loss=PER_KELVIN * DRIFT_K, ramp_s=seconds), *faults),
        friction=Friction(load_coulomb_n=15.0 * float(generator.uniform(0.8, 1.2))),
        mechanics=Mechanics(
            stiffness_n_per_m=healthy.stiffness_n_per_m * (1 - PER_KELVIN * kelvin),
            inertia_kg_m2=healthy.inertia_kg_m2 * inertia,
        ),
    )
    return partial(_with_sensor, partial(blocks, machine), kelvin, seconds, seed)


def _with_sensor(run: Run, kelvin: float, seconds: float, seed: int) -> Iterator[Block]:
    generator = np.random.default_rng([seed, 8])
    for block in run():
        time_s = (block.start + np.arange(len(block))) / block.rate_hz
        sensor = MEAN_C + kelvin + DRIFT_K * time_s / seconds + SENSOR_K * generator.standard_normal(len(block))
        channels = (*block.channels, Channel("temperature", "°C"))
        yield Block(np.vstack([block.data, sensor]), channels, block.rate_hz, start=block.start)


def judged(machine: LearnedMachine, run: Iterable[Block]) -> list[Event]:
    monitor = MachineMonitor(machine, LINES, NAMES, DEFAULT_INTERVAL_S)
    return [event for block in run for event in monitor.process(block)] + monitor.finish()
