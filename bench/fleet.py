"""How many axes of a fleet a core tracks, and what a message of the log costs.

    python -m bench.fleet [--seconds 20]

One process computes the messages of 20 simulated axes (4 kHz, three channels, 6 lines, 20 responses per second) from
bytes to rows of results, and takes snapshots as an owner does. It prints processor time per second of machine time, and
the axes that use 60 % of a core, for blocks of 100 and of 500 ms; and the bytes of results and states per byte of data.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from livebode.fleet.axis_stream import AxisStream
from livebode.fleet.message import write_message
from livebode.fleet.partition import RESULTS_S, STATE_SHARE
from livebode.fleet.result_message import PendingResults
from livebode.fleet.settings import FleetSettings
from livebode.fleet.simulated import BLOCK_S, SimulatedMachines, write_simulated_fleet
from livebode.sources.live import Batch

LOAD = 0.6
AXES = 20
"""Of the partition."""


def joined(batches: list[Batch]) -> Batch:
    """One batch from several that follow each other."""
    return replace(batches[0], data=np.hstack([batch.data for batch in batches]))


def measured(machines: SimulatedMachines, settings: FleetSettings, blocks: int, messages: int) -> dict[str, float]:
    """Costs of axes of one partition whose messages have this number of blocks."""
    axes, block_s = settings.read_axes(), blocks * BLOCK_S
    streams = {key: AxisStream(axes[key], 1) for key in machines.keys}
    data = [
        [write_message(joined([machines.batch(axis, blocks * number + part) for part in range(blocks)]))
         for axis in range(len(streams))]
        for number in range(messages)
    ]  # fmt: skip
    pending, since, size, results, states = PendingResults(), 0, 0, 0, 0
    began = time.process_time()
    for number, row in enumerate(data, 1):
        for (key, stream), message in zip(streams.items(), row):
            pending.add(key, stream, stream.process(message, number, number * block_s))
        if number * block_s // RESULTS_S > (number - 1) * block_s // RESULTS_S:
            results += len(pending.message(number, "bench").to_bytes())
            pending = PendingResults()
        since += sum(map(len, row))
        if since * STATE_SHARE >= size:
            size, since = sum(len(stream.snapshot()) for stream in streams.values()), 0
            states += size
    spent, sent = time.process_time() - began, sum(len(message) for row in data for message in row)
    seconds = messages * block_s * len(streams)
    return {
        "load": spent / seconds,
        "results": results / sent,
        "states": states / sent,
        "bytes_per_s": sent / seconds,
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.fleet", description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = write_simulated_fleet(Path(folder), "nats://127.0.0.1:4222", axes=AXES, partitions=1, workers=1)
        settings = FleetSettings.read(path)
        machines = SimulatedMachines(settings)
        for blocks in (1, 5):
            found = measured(machines, settings, blocks, round(asked.seconds / (blocks * BLOCK_S)))
            print(
                f"blocks of {blocks * BLOCK_S * 1e3:.0f} ms: {found['load']:.2%} of a core an axis, "
                f"{LOAD / found['load']:.0f} axes at {LOAD:.0%} of a core; {found['bytes_per_s'] / 1e3:.0f} kB/s, "
                f"results {found['results']:.1%} and states {found['states']:.1%} of it"
            )


if __name__ == "__main__":
    main()
