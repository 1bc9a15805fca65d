"""Friction and orders that change: false alarms of healthy axes, what is found and when, and the dates.

`python -m studies.torque_changes` learns friction and orders from `--learned` runs of 90 s of axes that
`tools.belt_axes` integrates by other equations than those of `livebode.simulation`, excited by seven lines of 1 N m,
judges `--healthy` healthy runs of 90 s, and `--runs` of each change, which begins at 30 s.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace

import numpy as np

from livebode.core import Block, Event, Lines
from livebode.excitation import multisine
from livebode.monitoring import DEFAULT_INTERVAL_S, LearnedTorque, TorqueMonitor, learn_torque
from livebode.motion import Shaft
from tools.belt_axes import AxisChange, recordings

SECONDS, START_S = 90.0, 30.0
SHAFTS = (Shaft("motor", 1.0, tuple(range(1, 49))),)
NAMES = ("u", "velocity")
_AT_ONCE = 64


@dataclass(frozen=True)
class Condition:
    """Rate, Stribeck friction and encoder of an axis, and by how much its motion is recorded late."""

    rate_hz: float
    stribeck_n: float = 0.0
    counts: int = 0
    late_samples: int = 0


CONDITIONS = {
    "4 kHz, noise of 0.1 rad/s, motion 2 samples late": Condition(4000.0, late_samples=2),
    "2 kHz, Stribeck, 17-bit encoder, 1.5 samples late": Condition(2000.0, 8.0, 1 << 17, late_samples=1),
}
CHANGES = {
    "friction +20 %": AxisChange(START_S, friction=1.2),
    "friction +50 %": AxisChange(START_S, friction=1.5),
    "friction +50 % in 40 s": AxisChange(START_S, 40.0, friction=1.5),
    **{f"ripple of {a:g} N m, 24 a turn": AxisChange(START_S, ripple_n_m=a) for a in (0.01, 0.02, 0.05)},
    **{f"worn tooth of {d:g} µm": AxisChange(START_S, tooth_m=1e-6 * d) for d in (30, 50, 100)},
}


def recorded(condition: Condition, changes: list[AxisChange], first_seed: int, seconds: float = SECONDS) -> list[Block]:
    """A run with each of these changes."""
    lines = Lines.parse("20:140:20", condition.rate_hz, round(condition.rate_hz / 10))
    seeds = range(first_seed, first_seed + len(changes))
    blocks = recordings(
        multisine(lines), seconds, seeds, changes, rate_hz=condition.rate_hz, stribeck_n=condition.stribeck_n,
        counts=condition.counts,
    )  # fmt: skip
    return [_late(block, condition.late_samples) for block in blocks]


def _late(block: Block, samples: int) -> Block:
    """The same with the motion recorded late."""
    data = block.data[:, samples:].copy()
    data[2:] = block.data[2:, : data.shape[1]]
    return replace(block, data=data)


def learned(blocks: list[Block]) -> LearnedTorque:
    runs = [(lambda block=block: iter([block])) for block in blocks]
    lines_hz = Lines.parse("20:140:20", blocks[0].rate_hz, round(blocks[0].rate_hz / 10)).frequency_hz
    return learn_torque(
        runs, input=NAMES[0], output=NAMES[1], kind="velocity", lines_hz=lines_hz, shafts=SHAFTS
    )  # fmt: skip


def judged(torque: LearnedTorque, block: Block) -> list[Event]:
    """Alarms with the rate that is specified by default: it is shared with the model of the machine."""
    monitor = TorqueMonitor(torque, NAMES, block.rate_hz, 3 * DEFAULT_INTERVAL_S)
    return [event for event in monitor.process(block) + monitor.finish() if event.kind == "change"]


def result(name: str, change: AxisChange, alarms: list[list[Event]]) -> str:
    """How often the changed quantity is found and another one named, how late, and how often the date is right."""
    what = "friction" if change.friction != 1 else "orders"
    found = [next((e for e in each if e.details["what"] == what), None) for each in alarms]
    others = sum(any(e.details["what"] != what for e in each) for each in alarms)
    seen = [event for event in found if event is not None]
    late = np.median([event.time_s - START_S for event in seen]) if seen else np.nan
    dated = sum(
        (e.details["since_earliest_s"] or 0.0) <= START_S <= e.details["since_latest_s"] for e in seen
    )  # fmt: skip
    return (
        f"{name:32} found {len(seen)} of {len(alarms)}, after {late:.0f} s; the other named too in {others}; "
        f"date contains the beginning in {dated} of {len(seen)}"
    )


def alarms_of(torque: LearnedTorque, condition: Condition, changes: list[AxisChange], seed: int) -> list[list[Event]]:
    """Alarms of a run with each of these changes; some at a time, because a run has 11 MB."""
    found: list[list[Event]] = []
    for first in range(0, len(changes), _AT_ONCE):
        blocks = recorded(condition, changes[first : first + _AT_ONCE], seed + first)
        found += [judged(torque, block) for block in blocks]
    return found


def assessed(condition: Condition, options: argparse.Namespace) -> None:
    torque = learned(recorded(condition, [AxisChange()] * options.learned, options.seed))
    smallest = torque.smallest
    sizes = list(smallest["friction_percent"].values()), list(smallest["orders"].values())
    print(f"friction from {min(sizes[0]):.3g} to {max(sizes[0]):.3g} %, ", end="")
    print(f"orders from {min(sizes[1]):.2g} to {max(sizes[1]):.2g} N m, median {np.median(sizes[1]):.2g}")
    changes = {name: change for name, change in CHANGES.items() if options.only in name}
    each = [change for change in changes.values() for _ in range(options.runs)]
    every = [AxisChange()] * options.healthy + each
    alarms = alarms_of(torque, condition, every, options.seed + options.learned)
    false = [event for each in alarms[: options.healthy] for event in each]
    print(f"false alarms in {options.healthy} healthy runs: {len(false)}")
    for event in false:
        print(f"    {event.message}")
    for i, (name, change) in enumerate(changes.items()):
        first = options.healthy + i * options.runs
        print(result(name, change, alarms[first : first + options.runs]), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--learned", type=int, default=5)
    parser.add_argument("--healthy", type=int, default=30)
    parser.add_argument("--runs", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="changes whose name contains this text")
    parser.add_argument("--condition", default="", help="conditions whose name contains this text")
    options = parser.parse_args()
    for name, condition in CONDITIONS.items():
        if options.condition not in name:
            continue
        print(f"{name}: ", end="")
        assessed(condition, options)


if __name__ == "__main__":
    main()
