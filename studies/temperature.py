"""A belt whose stiffness falls by 0.2 % per kelvin: false alarms and detected changes, with and without a sensor.

`python -m studies.temperature` learns from five runs of 60 s that are up to `--spread` kelvin off 22 °C, once with the
temperature as a covariate and once without. Then it judges healthy runs at other temperatures of that range, and runs
in which stiffness or inertia is less from the beginning or from 20 s on. It prints the alarms and their names.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np

from livebode.core import Block, Channel, Event
from livebode.monitoring import DEFAULT_INTERVAL_S, LearnedMachine, MachineMonitor, learn_machine
from livebode.simulation import Friction, Mechanics, TensionLoss
from studies.healthy import NAMES, any_start
from studies.monitoring_axis import HIGH_M, LINES, LOW_M, RADIUS_M, axis, run

PER_KELVIN, MEAN_C, DRIFT_K, SENSOR_K = 0.002, 22.0, 0.3, 0.05
LEARNED_RUNS, FAULT_S = 5, 20.0
Run = Callable[[], Iterable[Block]]


def at_temperature(
    kelvin: float, seed: int, *faults: Any, seconds: float = 60.0, inertia: float = 1.0, slope: float = PER_KELVIN
) -> Run:
    """A run that far off the mean temperature, with a sensor, in which it rises a little."""
    generator = np.random.default_rng([seed, 7])
    motion = any_start(float(generator.uniform(LOW_M, HIGH_M)), seed, seconds=seconds)
    healthy = Mechanics()
    mechanics = dataclasses.replace(
        healthy,
        stiffness_n_per_m=healthy.stiffness_n_per_m * (1 - slope * kelvin),
        inertia_kg_m2=healthy.inertia_kg_m2 * inertia,
    )
    rise = TensionLoss(loss=slope * DRIFT_K, ramp_s=seconds)
    friction = Friction(load_coulomb_n=15.0 * float(generator.uniform(0.8, 1.2)))
    machine = axis(motion, seed, seconds=seconds, faults=(rise, *faults), friction=friction, mechanics=mechanics)
    return partial(_with_sensor, run(machine), kelvin, seconds, seed)


def _with_sensor(blocks: Run, kelvin: float, seconds: float, seed: int) -> Iterable[Block]:
    generator = np.random.default_rng([seed, 8])
    for block in blocks():
        time_s = (block.start + np.arange(len(block))) / block.rate_hz
        sensor = MEAN_C + kelvin + DRIFT_K * time_s / seconds + SENSOR_K * generator.standard_normal(len(block))
        channels = (*block.channels, Channel("temperature", "°C"))
        yield Block(np.vstack([block.data, sensor]), channels, block.rate_hz, start=block.start)


def learned(kelvins: Sequence[float], covariates: Sequence[str], seconds: float = 60.0) -> LearnedMachine:
    runs = [at_temperature(kelvin, 9000 + i, seconds=seconds) for i, kelvin in enumerate(kelvins)]
    u, y, x = NAMES
    return learn_machine(runs, LINES, input=u, output=y, schedule=x, radius_m=RADIUS_M, covariates=covariates)


def judged(machine: LearnedMachine, blocks: Iterable[Block]) -> list[Event]:
    monitor = MachineMonitor(machine, LINES, NAMES, DEFAULT_INTERVAL_S)
    return [event for block in blocks for event in monitor.process(block)] + monitor.finish()


def named(events: Iterable[Event]) -> str:
    """The first change as a person reads it; empty where there is none."""
    return next((event.message for event in events if event.kind == "change"), "")


FAULTS: dict[str, tuple[tuple[Any, ...], float]] = {
    "healthy": ((), 1.0),
    "1 % less stiffness from the beginning": ((TensionLoss(loss=0.01),), 1.0),
    "1 % less stiffness from 20 s on": ((TensionLoss(loss=0.01, start_s=FAULT_S),), 1.0),
    "2 % less inertia from the beginning": ((), 0.98),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--spread", type=float, default=5.0, help="K")
    parser.add_argument("--runs", type=int, default=10, help="of each kind")
    options = parser.parse_args()
    for covariates in (("temperature",), ()):
        kelvins = np.linspace(-options.spread, options.spread, LEARNED_RUNS)
        machine = learned(kelvins.tolist(), covariates)
        print(f"covariates {list(covariates)}: changes from {(100 * machine.held.smallest).round(2)} %", flush=True)
        at = np.random.default_rng(3).uniform(-options.spread, options.spread, options.runs)
        for name, (faults, inertia) in FAULTS.items():
            found = [
                named(judged(machine, at_temperature(k, 20_000 + i, *faults, inertia=inertia)()))
                for i, k in enumerate(at)
            ]
            what = "inertia" if inertia != 1 else "stiffness"
            right = sum(what in message for message in found)
            print(f"  {name}: alarms in {sum(map(bool, found))} of {len(found)} runs, {right} of them name {what}")
            print("".join(f"    {message}\n" for message in found[:2] if message), end="", flush=True)


if __name__ == "__main__":
    main()
