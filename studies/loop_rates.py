"""How often `livebode validate --loop` names the rate of a position loop, of drives whose velocity loop is slower too.

Run `python -m studies.loop_rates --runs 40`. The velocity loop runs at the rate of the recording, at half and at a
quarter of it; the position loop at the rate of the velocity loop divided by 1, 2, 4, 8 and 16. Of each drive the
position loop is left out of the description, or described at half of its rate, and the description is right. It prints
how often the right cause is named, alone or among changes that cannot be told apart, how often it is the first of them,
and how often a right description is not found to be as described.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace

from livebode.configuration import LoopSection
from studies.check_loop import AXES, Axis, checks, false_alarms
from studies.loop_words import Drive

VELOCITY_TICKS = (1, 2, 4)
DIVIDERS = (1, 2, 4, 8, 16)


@dataclass(frozen=True)
class WrongRate:
    """A description with a wrong position loop, and the change that mends it."""

    name: str
    described: LoopSection
    key: str
    value: int | None


def wrong_rates(drive: Drive) -> Iterator[WrongRate]:
    """The position loop left out, and described at half of its rate."""
    right = drive.described()
    assert right.position is not None
    ticks = drive.position_ticks
    left_out = right.model_copy(update={"position": None})
    yield WrongRate("left out", left_out, f"loop.position (rate_divider {ticks}).gain", None)
    half = right.position.model_copy(update={"rate_divider": 2 * ticks, "rate_hz": right.position.rate_hz / 2})
    at_half = right.model_copy(update={"position": half})
    yield WrongRate("at half of its rate", at_half, "loop.position.rate_divider", ticks)


def named(axis: Axis, wrong: WrongRate, runs: int, seed: int) -> tuple[float, float]:
    """Shares of the recordings in which the right cause is named, and is the first."""
    every = first = 0
    for found in checks(axis, axis.drive, wrong.described, runs, seed):
        right = [
            one.change.key == wrong.key and (wrong.value is None or one.value == wrong.value)
            for one in found.explanations
        ]
        every += any(right)
        first += bool(right) and right[0]
    return every / runs, first / runs


def drives(axis: Axis, velocity_ticks: int) -> Iterator[tuple[int, Axis]]:
    """The axis with each rate of the position loop."""
    for divider in DIVIDERS:
        drive = replace(axis.drive, velocity_ticks=velocity_ticks, position_ticks=velocity_ticks * divider)
        yield divider, replace(axis, drive=drive)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=40, help="recordings of each drive and description")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--axis", default="", help="part of the name of an axis; default: all")
    parser.add_argument("--ticks", type=int, nargs="*", default=VELOCITY_TICKS, help="of the velocity loop")
    given = parser.parse_args()
    for axis in (one for one in AXES if given.axis in one.name):
        for ticks in given.ticks:
            print(f"\n{axis.name}; velocity loop: every {ticks} ticks; {given.runs} recordings for each cell")
            print(f"  {'divider':>9}{'left out':>20}{'at half of its rate':>24}{'false alarms':>15}")
            for divider, one in drives(axis, ticks):
                cells = [named(one, wrong, given.runs, given.seed + 1 + divider) for wrong in wrong_rates(one.drive)]
                alarms = false_alarms(one, given.runs, given.seed + 100 + divider)
                shares = [f"{100 * every:.0f} % ({100 * first:.0f} % first)" for every, first in cells]
                print(f"  {divider:9}{shares[0]:>20}{shares[1]:>24}{100 * alarms:>13.1f} %", flush=True)


if __name__ == "__main__":
    main()
