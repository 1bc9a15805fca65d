"""Amounts that the tables report for steps of an axis at standstill, compared with the true amounts: coverage.

`python -m studies.table_amounts` learns the lines of an axis at 0.8 m (3 × 100 s), lets its belt lose 2, 5 and 10 % at
30 s, and compares each reported amount of a line's magnitude and phase, and the date, with the exact linear response.
"""

from __future__ import annotations

import argparse

import numpy as np

from livebode.core import Lines, Responses
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.monitoring import (
    DEFAULT_INTERVAL_S,
    NonOverlappingWindows,
    ScheduleTable,
    TableMonitor,
    WindowRows,
    learn_table,
    places,
)
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis, Standstill, TensionLoss

RATE_HZ, WINDOW, START_S = 4000.0, 1000, 30.0
LINES = Lines.parse("20:140:8", rate_hz=RATE_HZ, window=WINDOW)
SETTINGS = Settings(lines=LINES, output="velocity", input="u", excitation="w")


def rows(seed: int, seconds: float, *faults: TensionLoss) -> tuple[BeltAxis, list[WindowRows]]:
    """Of an axis that stands, at each place of the period."""
    axis = BeltAxis(
        motion=Standstill(position_m=0.8),
        excitation_n_m=0.5 * multisine(LINES),
        sensor=Sensor(noise_rad_per_s=0.1),
        seconds=seconds,
        seed=seed,
        faults=faults,
        run_in_s=5.0,
    )
    tracker = Tracker(SETTINGS)
    whole = Responses.join([tracker.process(b) for b in SimulatedAxis(axis).blocks(["w", "u", "velocity", "x"])])
    return axis, [NonOverlappingWindows(WINDOW, place).of_responses(whole) for place in places(WINDOW, SETTINGS.step)]


def learned() -> ScheduleTable:
    names = [f"{f:g} Hz" for f in LINES.frequency_hz]
    parts = [part for seed in (1, 2, 3) for part in rows(seed, 100.0)[1]]
    return learn_table("lines", names, parts, len(places(WINDOW, SETTINGS.step)))


def judged(table: ScheduleTable, loss: float, seed: int) -> tuple[list[bool], float, bool]:
    """Whether each reported amount covers the truth, how many windows off the date is, and whether it covers it."""
    axis, parts = rows(seed, START_S + 10.0, TensionLoss(loss=loss, start_s=START_S))
    before, after = (axis.linear(0.8, t).sampled(RATE_HZ).response(LINES.frequency_hz) for t in (0.0, START_S + 5.0))
    quotient = dict(zip(table.names, after / before))
    monitor = TableMonitor(table, DEFAULT_INTERVAL_S, WINDOW / RATE_HZ)
    event = next(e for e in monitor.process(parts[0]) + monitor.finish() if e.kind == "change")
    covered = []
    for change in event.details["changes"]:
        q = quotient[change["name"]]
        truth = 100 * (abs(q) - 1) if change["of"] == "magnitude" else float(np.degrees(np.angle(q)))
        covered.append(bool(abs(change["amount"] - truth) <= change["bound"]))
    off = abs(event.details["since_s"] - START_S) * RATE_HZ / WINDOW
    earliest_s = event.details["since_earliest_s"]
    dated = (earliest_s is None or earliest_s <= START_S) and event.details["since_latest_s"] >= START_S
    return covered, off, dated


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    options = parser.parse_args()
    table = learned()
    for loss in (0.02, 0.05, 0.1):
        done = [judged(table, loss, 100 + seed) for seed in range(options.seeds)]
        covered = [c for each, _, _ in done for c in each]
        print(
            f"belt −{100 * loss:g} %: {sum(covered)} of {len(covered)} amounts within their bound "
            f"({100 * np.mean(covered):.1f} %), dates off by at most {max(off for _, off, _ in done):.1f} windows, "
            f"{sum(dated for _, _, dated in done)} of {len(done)} within their interval",
            flush=True,
        )


if __name__ == "__main__":
    main()
