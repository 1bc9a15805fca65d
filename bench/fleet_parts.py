"""Where the time of a message goes in the owner of a partition: each part alone.

    python -m bench.fleet_parts

For each kind of messages: read from the log in one read of many, decode, sequence, track alone and together with 4 or
16 messages of the axis, and its share of a message of results and of a state. Then the same for an owner of 400 axes in
four partitions, whose messages come in turn: take (recognise or decode, and sequence), track, results. Processor time
in µs a message, the least of some rounds.

The last lines are the bound of the design: what a message costs if tracking it costs nothing, with one reader of
nats-py and one message of results for each partition.
"""

from __future__ import annotations

import asyncio
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bench.fleet_loads import SAMPLES_100, SAMPLES_500, SPECTRA, AxisLoad
from bench.fleet_path import LOAD, state_every_s
from livebode.sources.live import Sequencer, SourceEvents
from livebode_plant.fleet.alike_axes import stacked_together
from livebode_plant.fleet.axis_stream import AxisStream
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.message import read_message
from livebode_plant.fleet.reader import Reader
from livebode_plant.fleet.result_message import PendingResults
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.subjects import EDGE, LOG, LOG_STREAM

_MESSAGES, _ROUNDS, _AXES, _WARM = 96, 5, 50, 16
_TOGETHER = (1, 4, 16)
_OWNED, _PARTITIONS, _BEGUN, _TURNS = 400, 4, 12, 6
HEADING = (
    "| messages | read | decode | sequence | track 1 | 4 | 16 | results | state "
    "| owner: take | track | results |\n" + "|---" * 12 + "|"
)


class MessageCosts:
    """What a message of a kind costs, µs."""

    def __init__(self, load: AxisLoad) -> None:
        self._load = load
        self._axes = load.axes(_AXES)
        self._axis = next(iter(self._axes.values()))
        self._messages = [load.message(0, number) for number in range(_MESSAGES)]
        self._batches = [read_message(message, 0.0) for message in self._messages]

    def measure(self) -> str:
        """A line of the table, as Markdown."""
        tracked = [min(self._track_s(together) for _ in range(_ROUNDS)) for together in _TOGETHER]
        spent_s = [
            asyncio.run(self._read_s()),
            least_s(lambda: [read_message(message, 0.0) for message in self._messages]) / _MESSAGES,
            least_s(self._sequence) / _MESSAGES,
            *tracked,
            self._results_s(),
            self._state_s(),
            *self._owned_s(),
        ]
        self._spent_s = spent_s
        return f"| {self._load.name} | " + " | ".join(f"{one * 1e6:.0f}" for one in spent_s) + " |"

    def bound(self) -> str:
        """What a message costs at least in this design, and the axes of a core; after `measure`."""
        read_s, state_s, take_s, track_s, results_s = (self._spent_s[i] for i in (0, 7, 8, 9, 10))
        least_s = read_s + take_s + results_s + state_s
        axes = [LOAD * self._load.period_s / cost_s for cost_s in (least_s, least_s + track_s)]
        return (
            f"{self._load.name}: {least_s * 1e6:.0f} us a message without tracking, so at most {axes[0]:,.0f} axes a "
            f"core at {LOAD:.0%}; {axes[1]:,.0f} with tracking, without what an owner costs besides"
        )

    async def _read_s(self) -> float:
        with tempfile.TemporaryDirectory() as folder, LogServer(Path(folder), 1) as server:
            async with FleetLog(LogSection(url=server.url, size_gb=1.0, results_gb=1.0), "bench") as log:
                await log.create_streams()
                for number, message in enumerate(self._messages * _ROUNDS):
                    await log.append(f"{EDGE}.hall._.machine.x", message, str(number))
                times_s = [await self._read_all_s(log) for _ in range(_ROUNDS)]
        return min(times_s) / (_MESSAGES * _ROUNDS)

    async def _read_all_s(self, log: FleetLog) -> float:
        reader, read = Reader(log, LOG_STREAM, f"{LOG}.0.>", 1), 0
        began_s = time.thread_time()
        while read < _MESSAGES * _ROUNDS:
            read += len(await reader.read(1.0))
        spent_s = time.thread_time() - began_s
        await reader.close()
        return spent_s

    def _sequence(self) -> None:
        sequencer = Sequencer(SourceEvents())
        for batch in self._batches:
            sequencer.push(batch)

    def _track_s(self, together: int) -> float:
        stream, spent_s = AxisStream(self._axis, 1), 0.0
        for number, message in enumerate(self._messages, 1):
            stream.add(message, number, 0.0)
            if number % together == 0:
                began_s = time.thread_time()
                stream.output()
                spent_s += (time.thread_time() - began_s) * (number > _WARM)
        return spent_s / (_MESSAGES - _WARM)

    def _results_s(self) -> float:
        outputs = []
        for key, axis in self._axes.items():
            stream = AxisStream(axis, 1)
            for number, message in enumerate(self._messages[:_WARM], 1):
                output = stream.process(message, number, 0.0)
            outputs.append((key, stream, output))

        def store() -> None:
            pending = PendingResults()
            for key, stream, output in outputs:
                pending.add(key, stream, output)
            pending.message(1, "owner").to_bytes()

        return least_s(store) / len(outputs)

    def _owned_s(self) -> list[float]:
        """Take, track and results of a message of an owner whose axes come in turn, so that they are in no cache."""
        axes = self._load.axes(_OWNED)
        streams = [AxisStream(axis, 1) for axis in axes.values()]
        keys, each = list(axes), _OWNED // _PARTITIONS
        rounds = []
        for number in range(_BEGUN + _TURNS):
            messages, spent_s = [self._load.message(axis, number) for axis in range(_OWNED)], np.zeros(3)
            for first in range(0, _OWNED, each):
                part, began = slice(first, first + each), time.thread_time()
                for stream, message in zip(streams[part], messages[part]):
                    stream.add(message, number + 1, number * self._load.period_s)
                taken = time.thread_time()
                stacks, outputs = stacked_together(streams[part])
                tracked, pending = time.thread_time(), PendingResults()
                for stack in stacks:
                    at = [first + i for i in stack.indices]
                    pending.add_rows([keys[i] for i in at], [streams[i] for i in at], stack)
                for i, output in outputs.items():
                    pending.add(keys[first + i], streams[first + i], output)
                pending.message(1, "owner").to_bytes()
                spent_s += np.diff([began, taken, tracked, time.thread_time()])
            rounds.append(spent_s / _OWNED)
        least: np.ndarray = np.min(rounds[_BEGUN:], axis=0)
        return least.tolist()

    def _state_s(self) -> float:
        stream = AxisStream(self._axis, 1)
        for number, message in enumerate(self._messages, 1):
            stream.process(message, number, 0.0)
        bytes_per_s = len(self._messages[0]) / self._load.period_s
        every_s = state_every_s(len(stream.snapshot()), bytes_per_s)
        return least_s(stream.snapshot) * self._load.period_s / every_s


def least_s(run: Callable[[], object]) -> float:
    """Processor time, the least of some rounds."""
    times_s = []
    for _ in range(_ROUNDS):
        began_s = time.thread_time()
        run()
        times_s.append(time.thread_time() - began_s)
    return min(times_s)


def main() -> None:
    """Print the table."""
    print(HEADING)
    costs = [MessageCosts(load) for load in (SAMPLES_500, SAMPLES_100, SPECTRA)]
    for one in costs:
        print(one.measure(), flush=True)
    print(*(one.bound() for one in costs), sep="\n")


if __name__ == "__main__":
    main()
