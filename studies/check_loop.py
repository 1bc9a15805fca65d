"""How often `livebode validate --loop` finds a wrong word of the description, and how often one in a right one.

Run `python -m studies.check_loop --runs 400`. The axes are a belt axis, one with an encoder of few counts, cogging and
friction, and one at another rate with correlated noise; on all of them the recorded torque has noise. Each word is
changed alone. It prints a table: noticed (not as described), named (the change of this word is among those that cannot
be told apart), and first (it is the first of them; some are the same thing, such as a tick of delay and an output that
is logged after the update).
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from livebode.configuration import LoopSection
from livebode.core import Block, Lines
from livebode.excitation import multisine
from livebode_control.loop_check.loop_check import LoopCheck, check_loop
from livebode_control.loop_check.loop_equation import LoopSignals
from studies.loop_words import Drive, Machine, record

PERIODS = 30


@dataclass(frozen=True)
class Axis:
    """A drive with its machine, its lines, and the size of a line in N m."""

    name: str
    drive: Drive
    machine: Machine
    lines: Lines
    line_n_m: float = 0.3


NOISE = {"torque_noise_n_m": 0.003}
AXES = (
    Axis(
        "belt axis, white noise",
        Drive(position_gain=20.0),
        Machine(load_noise_n_m=0.05, **NOISE),
        Lines.parse("10:140:10", 4000, 400),
    ),
    Axis(
        "encoder of 4096 counts, cogging, friction",
        Drive(position_gain=20.0),
        Machine(counts_per_turn=4096, cogging_n_m=0.1, friction_n_m=0.05, load_noise_n_m=0.05, **NOISE),
        Lines.parse("10:140:10", 4000, 400),
    ),
    Axis(
        "the same with a fifth of the noise: steps repeat",
        Drive(position_gain=20.0),
        Machine(counts_per_turn=4096, cogging_n_m=0.1, friction_n_m=0.05, load_noise_n_m=0.01, **NOISE),
        Lines.parse("10:140:10", 4000, 400),
    ),
    Axis(
        "1 kHz, correlated noise",
        Drive(rate_hz=1000.0, gain=0.1, integral_time_s=0.1, position_gain=10.0),
        Machine(load_noise_n_m=0.02, noise_pole=0.95, **NOISE),
        Lines.parse("5:120:5", 1000, 200),
    ),
)


@dataclass(frozen=True)
class Word:
    """One of the seven wrong words: the drive that has another one than its description, and keys that are right."""

    name: str
    drive: Drive
    described: LoopSection
    keys: tuple[str, ...]


def words(drive: Drive) -> Iterator[Word]:
    """Each word changed alone, in the drive or in its description."""
    right = drive.described()
    yield Word("gain, 2 %", replace(drive, gain=drive.gain * 1.02), right, ("loop.velocity.gain",))
    yield Word("integrator rule", replace(drive, integrator="forward"), right, ("loop.velocity.integrator",))
    yield Word("one tick of delay", replace(drive, delay_ticks=1), right, ("loop.velocity.delay_ticks",))
    assert right.position is not None
    hold = right.model_copy(update={"position": right.position.model_copy(update={"hold": "none"})})
    yield Word("hold of the position loop", drive, hold, ("loop.position.hold",))
    late = replace(drive, excitation_late=True)
    yield Word("time of logging", late, right, ("loop.excitation_logged",))
    without = right.model_copy(update={"position": None})
    yield Word("position loop left out", drive, without, tuple(_left_out(drive)))
    yield Word("filter left out", replace(drive, lowpass_s=1 / drive.rate_hz), right, ("loop.velocity.lowpass_s",))


def _left_out(drive: Drive) -> Iterator[str]:
    yield f"loop.position (rate_divider {drive.position_ticks}).gain"


def checks(axis: Axis, drive: Drive, described: LoopSection, runs: int, seed: int) -> Iterator[LoopCheck]:
    """The checks of so many recordings."""
    w, u, y = record(drive, axis.machine, axis.line_n_m * multisine(axis.lines), PERIODS, runs, seed)
    for one_u, one_y in zip(u, y):
        block = Block(np.stack([w, one_u, one_y]), ("w", "u", "y"), axis.lines.rate_hz)
        signals = LoopSignals.of(block, axis.lines, excitation="w", input="u", output="y")
        yield check_loop(signals, described)


def shares(axis: Axis, word: Word, runs: int, seed: int) -> dict[str, Any]:
    """Shares of the runs in which a wrong word is noticed, named first, and named; and how many are named with it."""
    noticed = first = named = 0
    alike = []
    for found in checks(axis, word.drive, word.described, runs, seed):
        keys = [one.change.key for one in found.explanations]
        noticed += found.verdict != "as described"
        first += bool(keys) and keys[0] in word.keys
        named += any(key in word.keys for key in keys)
        alike.append(len(keys))
    return {
        "noticed": noticed / runs,
        "first": first / runs,
        "named": named / runs,
        "alike": float(np.median(alike)),
    }


def false_alarms(axis: Axis, runs: int, seed: int) -> float:
    """Share of the runs in which a right description is not found to be as described."""
    described = axis.drive.described()
    return sum(found.verdict != "as described" for found in checks(axis, axis.drive, described, runs, seed)) / runs


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=400, help="recordings of each axis and word")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--word", default="", help="part of the name of a wrong word; default: all")
    given = parser.parse_args()
    print(f"{given.runs} recordings of {PERIODS} periods for each row; seed {given.seed}")
    for axis in AXES:
        print(f"\n{axis.name}")
        print(f"  false alarms: {100 * false_alarms(axis, given.runs, given.seed):.2f} %", flush=True)
        print(f"  {'wrong word':28}{'noticed':>9}{'named':>9}{'first':>9}   changes named (median)")
        for number, word in enumerate(words(axis.drive)):
            if given.word not in word.name:
                continue
            of = shares(axis, word, given.runs, given.seed + 1 + number)
            parts = "".join(f"{100 * of[key]:8.1f}%" for key in ("noticed", "named", "first"))
            print(f"  {word.name:28}{parts}   {of['alike']:g}", flush=True)


if __name__ == "__main__":
    main()
