"""Thousands of drives that send spectra, on this computer: messages sent, stored, lost, lag, cores of each process.

    python -m bench.fleet_load [--axes 2000] [--seconds 20] [--owners 2]

Each axis sends a spectrum of 6 lines and three channels twice a second to a nats-server on loopback; owners in
processes of their own track them. Cores are processor times over the time of sending: as many are needed
so that nothing waits.
"""

from __future__ import annotations

import argparse

import numpy as np

from bench.fleet_loads import SPECTRA
from bench.fleet_path import PathCosts, measured

PARTITIONS = 16


def report(costs: PathCosts, owners: int, seconds: float) -> str:
    """What was measured, in lines."""
    p50_s, p99_s = np.quantile(costs.lags_s, (0.5, 0.99))
    cores = {
        "nats-server": costs.server_s / seconds,
        f"owners ({owners})": costs.owner_s / seconds,
        "generator": costs.generator_s / seconds,
    }
    return "\n".join(
        [
            f"messages sent {costs.messages:,}, stored {costs.messages - costs.lost:,}, lost {costs.lost}",
            f"messages whose result is stored {len(costs.trace):,}; responses {costs.responses:,}",
            f"lag from spectrum to stored result: p50 {p50_s:.2f} s, p99 {p99_s:.2f} s",
            *(f"{name:<14}{used:6.2f} cores needed" for name, used in cores.items()),
            f"owners waited for a processor in {1 - 1 / costs.dilation:.0%} of the time in which they had work",
        ]
    )


def main() -> None:
    """Print what the load costs."""
    parser = argparse.ArgumentParser(prog="python -m bench.fleet_load", description=__doc__)
    parser.add_argument("--axes", type=int, default=2000)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--owners", type=int, default=2)
    asked = parser.parse_args()
    costs = measured(SPECTRA, asked.axes, asked.seconds, owners=asked.owners, partitions=PARTITIONS)
    print(f"{asked.axes:,} axes of spectra at 2/s for {asked.seconds:g} s, {PARTITIONS} partitions")
    print(report(costs, asked.owners, asked.seconds))


if __name__ == "__main__":
    main()
