"""What an axis of a fleet costs its owner with fits and monitoring, by part and by the number of axes together.

    python -m bench.fleet_fits [--axes 40]

The machine of `bench.axes` (tooth-belt axis in motion, three signals at 4 kHz, 7 lines, 20 responses and two fits a
second, a baseline with a model of the moving machine) as messages of 500 and 100 ms, taken together every 400 ms as an
owner does. Processor time of the thread, the least of three rounds in which the variants take turns; the log is not
part of it (`python -m bench.fleet_path`). A fault is found before the measured seconds: an active change is the most
expensive state of monitoring.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from bench.axes import TARGET_PERCENT, machine
from livebode.configuration import Axis
from livebode.core import Block
from livebode.sources.live import Batch
from livebode_plant.fleet.alike_axes import outputs_together
from livebode_plant.fleet.axis_stream import AxisStream
from livebode_plant.fleet.message import write_message
from livebode_plant.fleet.partition import RESULTS_S
from livebode_plant.fleet.result_message import PendingResults

MONITORING_TARGET_PERCENT = 0.2
BLOCKS_MS, ROUNDS, SECONDS, WARM_S = (500, 100), 3, 12.0, 9.0


def owner_cost(axis: Axis, messages: list[bytes], block_s: float, axes: int) -> tuple[float, float, float]:
    """Milliseconds a second and axis to compute and to encode results, and bytes of results a second and axis.

    The first 16 fits of an axis scan many starts, each alone: they are not counted, and one axis makes them for all.
    """
    warm = round(WARM_S / block_s)
    first = AxisStream(axis, 1)
    for number, message in enumerate(messages[:warm], 1):
        first.process(message, number, 1e9 + number * block_s)
    streams = [AxisStream(axis, 0) for _ in range(axes)]
    for stream in streams:
        stream.restore(first.snapshot())
    computed_s = encoded_s = size = 0.0
    due_s, each = WARM_S + RESULTS_S, (len(messages) - warm) * block_s
    for number, message in enumerate(messages[warm:], warm + 1):
        now_s = number * block_s
        begun = time.thread_time()
        for stream in streams:
            stream.add(message, number, 1e9 + now_s)
        middle = time.thread_time()
        done = 0
        if now_s >= due_s - 1e-9:
            due_s += RESULTS_S * np.ceil((now_s - due_s) / RESULTS_S + 1e-9)
            outputs, pending = outputs_together(streams), PendingResults()
            middle = time.thread_time()
            for i, (stream, output) in enumerate(zip(streams, outputs)):
                pending.add(f"hall._.{i}.x", stream, output)
            done = len(pending.message(number, "bench").to_bytes())
        computed_s, encoded_s = computed_s + middle - begun, encoded_s + time.thread_time() - middle
        size += done
    share = 1000 / (each * axes)
    return share * computed_s, share * encoded_s, size / (each * axes)


def variants(axis: Axis) -> dict[str, Axis]:
    """The same axis with more and more parts."""
    alone = {"fit": None, "monitoring": axis.monitoring.model_copy(update={"baseline": None})}
    return {
        "tracking": axis.model_copy(update=alone),
        "tracking, monitoring": axis.model_copy(update={"fit": None}),
        "tracking, monitoring, fits": axis,
    }


def messages_of(every: Block, block_s: float) -> list[bytes]:
    """The samples of the machine as messages."""
    samples = round(every.rate_hz * block_s)
    count = min(round(SECONDS / block_s), len(every) // samples)
    data = every.data.astype("f4").astype("f8")
    parts = (data[:, i * samples : (i + 1) * samples] for i in range(count))
    return [
        write_message(Batch(i * samples, part, every.channels, every.rate_hz, epoch=1)) for i, part in enumerate(parts)
    ]


def least(axis: Axis, messages: list[bytes], block_s: float, axes: int) -> dict[str, NDArray[np.float64]]:
    """Of several rounds: what `owner_cost` returns, of every variant."""
    rounds = [
        {name: owner_cost(one, messages, block_s, axes) for name, one in variants(axis).items()} for _ in range(ROUNDS)
    ]
    return {name: np.min([one[name] for one in rounds], axis=0) for name in rounds[0]}


def verdict(what: str, ms_per_s: float, target_percent: float) -> str:
    """A share of a core, compared with its target."""
    met = "met" if ms_per_s / 10 <= target_percent else "missed"
    return f"  {what}: {ms_per_s / 10:.2f} % of a core an axis, target ≤ {target_percent:g} %: {met}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.fleet_fits", description=__doc__)
    parser.add_argument("--axes", type=int, default=40)
    asked = parser.parse_args()
    print("| messages | axes together | parts | compute, ms/s | encode, ms/s | results, B/s |\n" + "|---" * 6 + "|")
    with TemporaryDirectory() as folder:
        axis, every = machine(Path(folder))
        for block_ms in BLOCKS_MS:
            messages = messages_of(every, block_ms / 1000)
            for axes in sorted({1, asked.axes}):
                found = least(axis, messages, block_ms / 1000, axes)
                for name, (compute, encode, size) in found.items():
                    print(f"| {block_ms} ms | {axes} | {name} | {compute:.2f} | {encode:.2f} | {size:.0f} |")
            tracking, monitored, whole = (compute + encode for compute, encode, _ in found.values())
            print(f"{block_ms} ms, {asked.axes} axes together")
            print(f"  tracking: {tracking / 10:.2f} %; fits: {(whole - monitored) / 10:.2f} %")
            print(verdict("monitoring", monitored - tracking, MONITORING_TARGET_PERCENT))
            print(verdict("whole", whole, TARGET_PERCENT))


if __name__ == "__main__":
    main()
