"""Dates of alarms: how often the interval contains the true beginning of the change, and how wide it is.

`python -m studies.change_dates` judges steps and ramps of all sizes at random speeds, at a random time of runs of 45 s:
on the axis of `livebode.simulation`, and on axes that `tools.belt_axes` integrates by other equations, with friction of
the motor, other dampings and a loop of its own. It prints the share of intervals that contain the beginning, of each
kind and in all. `--runs 4` is a short form.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from livebode.core import Block
from livebode.excitation import multisine
from livebode.monitoring import DEFAULT_INTERVAL_S, LearnedMachine, MachineMonitor, learn_machine
from livebode.simulation import DampingGrowth, Friction, LoadChange, TensionLoss
from studies.healthy import any_start
from studies.monitoring_axis import LINES, RADIUS_M, axis, run
from tools.belt_axes import AxisChange, recordings

NAMES = ("u", "velocity", "x")
SECONDS, FIRST_S, LAST_S = 45.0, 12.0, 28.0

SIMULATED: dict[str, Callable[[float], tuple[object, ...]]] = {
    "stiffness −0.5 %": lambda s: (TensionLoss(start_s=s, loss=0.005),),
    "stiffness −1 %": lambda s: (TensionLoss(start_s=s, loss=0.01),),
    "stiffness −3 %": lambda s: (TensionLoss(start_s=s, loss=0.03),),
    "stiffness −10 %": lambda s: (TensionLoss(start_s=s, loss=0.1),),
    "stiffness −30 %": lambda s: (TensionLoss(start_s=s, loss=0.3),),
    "stiffness −1 % in 3 s": lambda s: (TensionLoss(start_s=s, ramp_s=3.0, loss=0.01),),
    "stiffness −2 % in 15 s": lambda s: (TensionLoss(start_s=s, ramp_s=15.0, loss=0.02),),
    "load +2 %": lambda s: (LoadChange(start_s=s, load_kg=0.134),),
    "load +20 %": lambda s: (LoadChange(start_s=s, load_kg=1.34),),
    "damping +20 %": lambda s: (DampingGrowth(start_s=s, factor=1.2),),
    "damping +100 %": lambda s: (DampingGrowth(start_s=s, factor=2.0),),
    "load +80 %, stiffness −30 %": lambda s: (LoadChange(start_s=s, load_kg=5.4), TensionLoss(start_s=s, loss=0.3)),
}
OTHER = {
    "stiffness −1 %": AxisChange(stiffness=0.99),
    "stiffness −5 %": AxisChange(stiffness=0.95),
    "stiffness −2 % in 10 s": AxisChange(stiffness=0.98, ramp_s=10.0),
    "load +3 %": AxisChange(load=1.03),
    "inertia +5 %": AxisChange(inertia=1.05),
    "damping +50 %": AxisChange(damping=1.5),
    "place −10 %": AxisChange(spot=0.1),
    "inertia +60 %, load +60 %": AxisChange(inertia=1.6, load=1.6),
}


class Dated(NamedTuple):
    """The first alarm after a change: its subject, and the beginning relative to the true one."""

    what: str
    since_s: float
    earliest_s: float
    latest_s: float

    @property
    def covers(self) -> bool:
        return self.earliest_s <= 0 <= self.latest_s


def machine_of(runs: Sequence[Callable[[], Iterable[Block]]]) -> LearnedMachine:
    return learn_machine(runs, LINES, input=NAMES[0], output=NAMES[1], schedule=NAMES[2], radius_m=RADIUS_M)


def dated(machine: LearnedMachine, blocks: Iterable[Block], start_s: float) -> Dated | None:
    """The first alarm after a change; one before it is false, and is printed."""
    monitor = MachineMonitor(machine, LINES, NAMES, DEFAULT_INTERVAL_S)
    events = [event for block in blocks for event in monitor.process(block)] + monitor.finish()
    alarms = [event for event in events if event.kind == "change"]
    for event in (e for e in alarms if e.time_s < start_s):
        print(f"      FALSE ALARM, change at {start_s:.1f} s: {event.message}")
    found = next((event.details for event in alarms if event.time_s >= start_s), None)
    if found is None:
        return None
    since_s, earliest_s, latest_s = (found[name] for name in ("since_s", "since_earliest_s", "since_latest_s"))
    earliest_s = -np.inf if earliest_s is None else earliest_s
    return Dated(found["what"], since_s - start_s, earliest_s - start_s, latest_s - start_s)


def simulated_run(seed: int, *faults: object, seconds: float = SECONDS) -> Callable[[], Iterable[Block]]:
    generator = np.random.default_rng([seed, 9])
    motion = any_start(float(generator.uniform(0.3, 1.5)), seed, seconds)
    friction = Friction(load_coulomb_n=15.0 * float(generator.uniform(0.8, 1.2)))
    return run(axis(motion, seed, seconds=seconds, faults=faults, friction=friction))


def simulated(runs: int) -> Iterator[tuple[str, list[Dated | None]]]:
    machine = machine_of([simulated_run(9000 + i, seconds=60.0) for i in range(5)])
    for number, (name, faults) in enumerate(SIMULATED.items()):
        found = []
        for i in range(runs):
            seed = 1000 * number + i
            start_s = float(np.random.default_rng([seed, 3]).uniform(FIRST_S, LAST_S))
            found.append(dated(machine, simulated_run(seed, *faults(start_s))(), start_s))
        yield name, found


def other(runs: int) -> Iterator[tuple[str, list[Dated | None]]]:
    """All axes at once."""
    generator, learned = np.random.default_rng(4), 6
    kinds = [name for name in OTHER for _ in range(runs)]
    starts = [float(s) for s in generator.uniform(FIRST_S, LAST_S, len(kinds))]
    changes = [AxisChange(**(vars(OTHER[name]) | {"start_s": s})) for name, s in zip(kinds, starts)]
    blocks = recordings(multisine(LINES), SECONDS, range(learned + len(kinds)), [AxisChange()] * learned + changes)
    machine = machine_of([partial(iter, [block]) for block in blocks[:learned]])
    found = [dated(machine, [block], start_s) for block, start_s in zip(blocks[learned:], starts)]
    for name in OTHER:
        yield name, [one for kind, one in zip(kinds, found) if kind == name]


def shown(name: str, runs: int, found: list[Dated]) -> str:
    covered = sum(one.covers for one in found)
    width = np.array([one.latest_s - one.earliest_s for one in found])
    open_ = int(np.isinf(width).sum())
    off = max((abs(one.since_s) for one in found), default=np.nan)
    closed = width[np.isfinite(width)]
    typical = f"{np.median(closed):.2f} s, at most {closed.max():.1f} s" if closed.size else "–"
    begin = f", {open_} without an earliest time" if open_ else ""
    dates = f"{covered:3} of {len(found):3} ({runs} runs); width {typical}{begin}"
    return f"{name:30} {dates}; date off by at most {off:.2f} s"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=12, help="of each kind")
    parser.add_argument("--only", default="", help="axes whose name contains this text")
    options = parser.parse_args()
    everything: list[Dated] = []
    for title, source in (("livebode.simulation", simulated), ("other equations", other)):
        if options.only not in title:
            continue
        print(title)
        for name, found in source(options.runs):
            alarms = [one for one in found if one is not None]
            everything += alarms
            print("  " + shown(name, len(found), alarms), flush=True)
            for one in alarms:
                if not one.covers:
                    print(f"      {one.what}: {one.earliest_s:+.2f} … {one.latest_s:+.2f} s about the beginning")
    covered = sum(one.covers for one in everything)
    print(f"{covered} of {len(everything)} intervals contain the beginning ({100 * covered / len(everything):.1f} %)")


if __name__ == "__main__":
    main()
