"""Trends of simulated machines over a year: coverage of the bounds, power, and false discoveries of a fleet.

`python -m studies.archive_trends` simulates machines with 200 runs over a year: 0.3 % scatter from run to run, an
effect of the temperature of ±1 % over the year, 3 % outliers of up to 5 %, at random times. It prints how often the
95 % bound of the slope covers the truth, how often the trend, jump or bend is found, and the share of false discoveries
among 1,000 healthy and 50 bad machines.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from livebode_plant.trending import FALSE_DISCOVERIES, MONTH_S, NotAssessed, Trend, discoveries, trend_of
from livebode_plant.trending.machine_year import START_S, MachineYear


def trend(year: MachineYear, seed: int) -> Trend:
    """The trend of one machine."""
    found = trend_of(*year.measured(seed))
    if isinstance(found, NotAssessed):
        raise ValueError(found.reason)
    return found


@dataclass(frozen=True)
class Tally:
    """Of many machines of one kind.

    Attributes
    ----------
    covered, change_covered
        Share of the machines whose 95 % bound of the present slope, and of the change over all runs, covers the truth.
    found
        Share whose own probability is below 1 %.
    named
        Share with exactly the jump or bend that is there, dated within a month; without one, with none.
    bound
        Median bound of the slope, % per month.
    """

    covered: float
    change_covered: float
    found: float
    named: float
    bound: float

    @classmethod
    def of(cls, year: MachineYear, seeds: Iterable[int]) -> Tally:
        trends = [trend(year, seed) for seed in seeds]
        slope = year.per_month + year.bend
        kinds = ["jump"] * bool(year.jump) + ["bend"] * bool(year.bend)
        rows = [
            (
                abs(t.per_month - slope) <= t.per_month_bound_95,
                abs(t.change - true_change(year, t)) <= t.change_bound_95,
                t.p < 0.01,
                [c.kind for c in t.changes] == kinds
                and all(abs((c.time_s - START_S) / MONTH_S - year.change_month) < 1 for c in t.changes),
                t.per_month_bound_95,
            )
            for t in trends
        ]
        *shares, bounds = np.array(rows, dtype=float).T
        return cls(*(float(share.mean()) for share in shares), float(np.median(bounds)))


def true_change(year: MachineYear, trend: Trend) -> float:
    first, last = ((at - START_S) / MONTH_S for at in (trend.since_s, trend.until_s))
    return year.per_month * (last - first) + year.jump + year.bend * (last - year.change_month)


def false_share(seed: int, healthy: int, bad: int, year: MachineYear, **fault: float) -> tuple[float, float]:
    """Share of healthy machines among the discoveries, and share of the bad ones that are discovered."""
    machines = [year] * healthy + [MachineYear(**{**vars(year), **fault})] * bad
    found = np.array(discoveries([trend(one, seed * 100_000 + i).p for i, one in enumerate(machines)]))
    return float(found[:healthy].sum() / max(found.sum(), 1)), float(found[healthy:].mean())


KINDS: dict[str, MachineYear] = {
    "healthy": MachineYear(),
    "−0.1 % a month": MachineYear(per_month=-0.1),
    "−0.1 %, correlation 0.3": MachineYear(per_month=-0.1, correlation=0.3),
    "−0.1 %, correlation 0.6": MachineYear(per_month=-0.1, correlation=0.6),
    "−0.1 %, correlation 0.9": MachineYear(per_month=-0.1, correlation=0.9),
    "−0.1 %, 50 runs": MachineYear(per_month=-0.1, runs=50),
    "−0.1 %, 20 runs": MachineYear(per_month=-0.1, runs=20),
    "−0.1 %, 1,000 runs": MachineYear(per_month=-0.1, runs=1000),
    "−0.1 %, 10 % outliers": MachineYear(per_month=-0.1, outliers=0.1),
    "−0.1 %, 3 years": MachineYear(per_month=-0.1, months=36.0, runs=600),
    "jump of −1 %": MachineYear(jump=-1.0),
    "jump of −3 %": MachineYear(jump=-3.0),
    "−0.3 % a month from month 7": MachineYear(bend=-0.3),
    "−0.8 % a month from month 7": MachineYear(bend=-0.8),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=400)
    parser.add_argument("--fleets", type=int, default=20)
    options = parser.parse_args()
    print(f"{'':30}{'slope':>8}{'change':>8}{'p < 1 %':>9}{'named':>8}{'± % a month':>13}")
    for name, year in KINDS.items():
        of = Tally.of(year, range(options.machines))
        print(
            f"{name:30}{of.covered:8.1%}{of.change_covered:8.1%}{of.found:9.1%}{of.named:8.1%}{of.bound:13.3f}",
            flush=True,
        )
    print(
        f"\n1,000 healthy machines and 50 bad ones, {options.fleets} fleets: healthy among the discoveries, bad found"
    )
    for name, fault in (("−0.1 % a month", {"per_month": -0.1}), ("jump of −1 %", {"jump": -1.0})):
        for correlation in (0.0, 0.3, 0.6):
            year = MachineYear(correlation=correlation)
            rows = [false_share(seed, 1000, 50, year, **fault) for seed in range(options.fleets)]
            share, power = np.mean(rows, axis=0)
            print(f"{name:20} correlation {correlation:g}: {share:6.1%} {power:7.1%}", flush=True)
    print(f"target: at most {FALSE_DISCOVERIES:.0%} on average")


if __name__ == "__main__":
    main()
