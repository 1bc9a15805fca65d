"""False alarms of healthy machines that are not as the model takes them, and what is detected there.

`python -m studies.healthy` learns a baseline for each condition from 5 × 60 s of strokes, from any start, at random
30 … 100 % of 0.38 m/s, with friction of 15 N ± 20 %. The conditions are torque ripple, torque noise, an eccentric
pulley, friction that falls, a differenced encoder and a delay. Then it judges `--runs` healthy runs of 60 s, and
`--trials` of two strokes with 0.5 % less stiffness. It prints the alarms of each condition, and writes healthy.json.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import Block, Event
from livebode.monitoring import DEFAULT_INTERVAL_S, LearnedMachine, MachineMonitor, learn_machine
from livebode.simulation import Drive, Friction, FrictionChange, Mechanics, Sensor, StrokeSequence, TensionLoss
from studies.monitoring_axis import (
    CHANNELS,
    HIGH_M,
    LINES,
    LOW_M,
    RADIUS_M,
    RATE_HZ,
    SPEED_M_PER_S,
    axis,
    length_s,
    run,
)

NAMES = ("u", "velocity", "x")
SECONDS, LEARNED_RUNS, FRICTION_N = 60.0, 5, 15.0
_COUNTS = 1 << 20
_STEP_RAD_PER_S = 2 * np.pi / _COUNTS * RATE_HZ  # of the velocity, for one count


@dataclass(frozen=True)
class Condition:
    """What the machine has that the model of the monitor has not."""

    name: str
    drive: dict[str, float] = field(default_factory=dict)
    mechanics: dict[str, float] = field(default_factory=dict)
    sensor: Sensor = field(default_factory=lambda: Sensor(noise_rad_per_s=0.1, encoder_counts_per_turn=_COUNTS))
    friction_factor: float = 1.0
    """To which the friction falls between 15 and 45 s of a run that is judged."""
    delay_samples: int = 0
    """By which the velocity is recorded late; a differenced velocity has half a sample more."""


CONDITIONS = {
    c.name: c
    for c in (
        Condition("as the study of monitoring"),
        *(Condition(f"ripple {a} N m", drive={"torque_ripple_n_m": a}) for a in (0.01, 0.02, 0.05)),
        Condition("torque noise 0.1 N m", drive={"torque_noise_n_m": 0.1}),
        Condition("eccentric pulley 1 %", mechanics={"eccentricity": 0.01}),
        Condition("friction falls by 40 %", friction_factor=0.6),
        Condition(
            "20-bit encoder, differenced",
            sensor=Sensor(
                noise_rad_per_s=_STEP_RAD_PER_S / 2, encoder_counts_per_turn=_COUNTS, velocity_differenced=True
            ),
        ),
        Condition(
            "delay of 1.5 samples", sensor=Sensor(noise_rad_per_s=0.1, velocity_differenced=True), delay_samples=1
        ),
    )
}


def any_start(start_m: float, seed: int, seconds: float = SECONDS, strokes_max: int = 1000) -> StrokeSequence:
    """Strokes at random speeds between the ends of the way, from `start_m` on, for at least `seconds`."""
    generator = np.random.default_rng(seed)
    end = HIGH_M if generator.uniform() < 0.5 else LOW_M
    points, speeds, duration_s = [start_m], [], 0.0
    while duration_s < seconds and len(speeds) < strokes_max:
        speed = float(SPEED_M_PER_S * generator.uniform(0.3, 1.0))
        if abs(end - points[-1]) > 0.05:
            points.append(end)
            speeds.append(speed)
            duration_s += length_s(StrokeSequence(turning_points_m=tuple(points[-2:]), speeds_m_per_s=(speed,)))
        else:
            points[-1] = end
        end = LOW_M + HIGH_M - end
    return StrokeSequence(turning_points_m=tuple(points), speeds_m_per_s=tuple(speeds))


def simulated(
    condition: Condition, seed: int, *, faults: tuple[Any, ...] = (), strokes: int | None = None
) -> Callable[[], Iterable[Block]]:
    """A run of `SECONDS`, or of so many strokes."""
    generator = np.random.default_rng([seed, 7])
    motion = any_start(
        float(generator.uniform(LOW_M, HIGH_M)) if strokes is None else LOW_M, seed, strokes_max=strokes or 1000
    )
    friction = Friction(load_coulomb_n=FRICTION_N * float(generator.uniform(0.8, 1.2)))
    machine = axis(
        motion,
        seed,
        seconds=SECONDS if strokes is None else length_s(motion),
        faults=faults,
        friction=friction,
        mechanics=Mechanics(**condition.mechanics),
        drive=Drive(**condition.drive),
        sensor=condition.sensor,
    )
    return partial(_late, run(machine), condition.delay_samples)


def _late(blocks: Callable[[], Iterable[Block]], samples: int) -> Iterator[Block]:
    """The same with the velocity recorded late."""
    row, before = CHANNELS.index("velocity"), np.zeros(samples)
    for block in blocks():
        data = block.data.copy()
        whole = np.concatenate([before, data[row]])
        data[row], before = whole[: len(block)], whole[len(block) :]
        yield Block(data, block.channels, block.rate_hz, start=block.start)


def learned(condition: Condition) -> LearnedMachine:
    runs = [simulated(condition, 9000 + i) for i in range(LEARNED_RUNS)]
    return learn_machine(runs, LINES, input=NAMES[0], output=NAMES[1], schedule=NAMES[2], radius_m=RADIUS_M)


def judged(machine: LearnedMachine, blocks: Iterable[Block]) -> list[Event]:
    monitor = MachineMonitor(machine, LINES, NAMES, DEFAULT_INTERVAL_S)
    return [event for block in blocks for event in monitor.process(block)] + monitor.finish()


def healthy_run(condition: Condition, machine: LearnedMachine, seed: int) -> list[str]:
    """Sentences of the false alarms."""
    faults = (
        ()
        if condition.friction_factor == 1
        else (FrictionChange(start_s=15.0, ramp_s=30.0, factor=condition.friction_factor),)
    )
    return [e.message for e in judged(machine, simulated(condition, seed, faults=faults)()) if e.kind == "change"]


def trial(condition: Condition, machine: LearnedMachine, seed: int) -> str:
    """What two strokes with 0.5 % less stiffness are named; empty where nothing is detected."""
    events = judged(machine, simulated(condition, seed, faults=(TensionLoss(loss=0.005),), strokes=2)())
    return next((str(e.details["what"]) for e in events if e.kind == "change"), "")


def assessed(condition: Condition, runs: int, trials: int, processes: int) -> dict[str, Any]:
    begun = time.process_time()
    machine = learned(condition)
    with ProcessPoolExecutor(processes, mp_context=get_context("fork")) as pool:
        alarms = list(pool.map(partial(healthy_run, condition, machine), range(20_000, 20_000 + runs)))
        found = list(pool.map(partial(trial, condition, machine), range(40_000, 40_000 + trials)))
    return {
        "runs": runs,
        "runs_with_alarms": sum(map(bool, alarms)),
        "alarms": [message for each in alarms for message in each],
        "trials": trials,
        "detected": sum(map(bool, found)),
        "named_stiffness": found.count("stiffness"),
        "inflation": machine.held.inflation.tolist(),
        "scatter_percent": (100 * machine.held.scatter).tolist(),
        "smallest_percent": (100 * machine.held.smallest).tolist(),
        "learning_s": time.process_time() - begun,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("studies/out"))
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--only", default="", help="conditions whose name holds this text")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    numbers = {}
    for condition in (c for c in CONDITIONS.values() if options.only in c.name):
        begun = time.time()
        numbers[condition.name] = row = assessed(condition, options.runs, options.trials, options.processes)
        smallest = np.round(row["smallest_percent"], 2).tolist()
        print(
            f"{condition.name:28} healthy runs with alarms {row['runs_with_alarms']} of {row['runs']}; 0.5 % of "
            f"stiffness detected {row['detected']}, named {row['named_stiffness']} of {row['trials']}; "
            f"smallest {smallest} %; {time.time() - begun:.0f} s",
            flush=True,
        )
        for message in row["alarms"]:
            print(f"    {message}")
        (options.out / "healthy.json").write_text(json.dumps(numbers, indent=1) + "\n")


if __name__ == "__main__":
    main()
