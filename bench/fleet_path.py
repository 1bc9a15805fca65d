"""What an axis of a fleet costs on the real path, by processor times: nats-server, owners and generator apart.

    python -m bench.fleet_path [--seconds 20] [--only "100 ms"] [--share 0.5]

A nats-server on loopback, an owner of all partitions in a process of its own, and a generator of messages in another.
Each kind of message in turn: samples in blocks of 500 and 100 ms (4 kHz, three channels, 6 lines), the same with
[motion], and spectra of a drive at 2/s. Costs are processor times, in milliseconds per second and axis, which other
programs on the computer change little. The lag is from a message's newest sample until its result is stored. The last
column is the share of time that an owner with work waited for a processor: above some per cent the lag is not the
fleet's, but the computer's. The share of states follows from their size and from the rule when one is stored.

The row after the one of blocks of 100 ms has as many axes as load a core by about 60 %.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import multiprocessing
import tempfile
import time
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import psutil

from bench.fleet_generator import Generated, generate
from bench.fleet_loads import MOTION, SAMPLES_100, SAMPLES_500, SPECTRA, AxisLoad
from livebode.sources.live import read_header
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.partition import STATE_S_MIN, STATE_SHARE
from livebode_plant.fleet.reader import stored_messages
from livebode_plant.fleet.result_message import ResultMessage
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.status import status_of
from livebode_plant.fleet.subjects import LOG, LOG_STREAM, RESULT_STREAM, RESULTS, STATE_STREAM, key_of
from livebode_plant.fleet.worker import own_partitions

LOAD = 0.6
"""Of a core, for which axes are counted."""
AXES = {SAMPLES_500: 150, SAMPLES_100: 40, MOTION: 10, SPECTRA: 400}
"""Enough that what a partition costs without data is a small part."""
_LOADED = f"{SAMPLES_100.name}, {LOAD:.0%}"
_IDLE_S, _STEP_S, _REPORTED_S, _WARM_S = 2.0, 0.25, 1.2, 3.0
_TRACE = [("partition", "i8"), ("due_s", "f8"), ("arrived_s", "f8"), ("stored_s", "f8")]
_CONTEXT = multiprocessing.get_context("spawn")
T = TypeVar("T")


@dataclass(frozen=True)
class PathCosts:
    """What was measured.

    Attributes
    ----------
    axis_seconds
        Axes times seconds of machine time.
    stores
        Times that an owner stored results.
    owner_s, server_s, generator_s
        Processor time; of owner and server as if the time after the start were all.
    idle_s
        Processor time of an owner per second and partition without data.
    dilation
        Time that the owner computed or waited for a processor, over the time that it computed.
    trace
        Of each message whose result is stored, in the order of the log: partition; when its newest sample was sampled,
        when the log received it, when its result was stored, seconds since 1970.
    began_s, killed_s, claimed_s
        When sending began; with a takeover, when an owner was killed, and when all its partitions were claimed again.
    """

    load: AxisLoad
    axes: int
    axis_seconds: float
    messages: int
    lost: int
    responses: int
    stores: int
    owner_s: float
    server_s: float
    generator_s: float
    idle_s: float
    dilation: float
    input_bytes: int
    result_bytes: int
    state_size: float
    trace: np.ndarray
    began_s: float
    killed_s: float = 0.0
    claimed_s: float = 0.0

    @property
    def core_share(self) -> float:
        """Of a core that an axis takes from its owner."""
        return self.owner_s / self.axis_seconds

    @property
    def lags_s(self) -> np.ndarray:
        """From a message's newest sample until its result was stored, without those of the start."""
        found: np.ndarray = self.trace["stored_s"] - self.trace["due_s"]
        return found[self.trace["due_s"] > self.began_s + _WARM_S]

    @property
    def state_share(self) -> float:
        """Bytes of states per byte of data."""
        bytes_per_s = self.input_bytes / self.axis_seconds
        return self.state_size / state_every_s(self.state_size, bytes_per_s) / bytes_per_s

    @property
    def axes_per_core(self) -> float:
        """At a load of 60 %."""
        return LOAD / self.core_share


def state_every_s(size_bytes: float, bytes_per_s: float) -> float:
    """From one state of an axis to the next, by the rule of the owner, for its data per second."""
    return max(STATE_S_MIN, size_bytes / STATE_SHARE / bytes_per_s)


def measured(
    load: AxisLoad, axes: int, seconds: float, *, owners: int = 1, partitions: int = 4, takeover: bool = False
) -> PathCosts:
    """Send for some seconds, wait until all is stored, and count. With `takeover` an owner is killed in the middle."""
    with tempfile.TemporaryDirectory() as folder, LogServer(Path(folder), partitions) as server:
        settings = LogSection(url=server.url, size_gb=2.0, results_gb=1.0)
        return _Path(settings, load, axes, partitions).run(seconds, owners, takeover)


class _Path:
    """A log that is empty, and what runs on it."""

    def __init__(self, settings: LogSection, load: AxisLoad, axes: int, partitions: int) -> None:
        self._settings, self._load, self._count, self._partitions = settings, load, axes, partitions
        self._axes = load.axes(axes)
        self._keys = {key: number for number, key in enumerate(self._axes)}
        self._stop = _CONTEXT.Event()

    def run(self, seconds: float, owners: int, takeover: bool) -> PathCosts:
        self._asked(lambda log: log.create_streams())
        server = next(one for one in psutil.Process().children() if one.name() == "nats-server")
        with self._owners(owners) as processes, self._generator(seconds) as (go, answers):
            self._wait(processes, lambda: self._claims() >= self._partitions)
            assert answers.get(timeout=600) == "ready"
            idle_s = self._idle_s(processes)
            go.set()
            # The first message of an axis creates its tracker: the rest counts for all of the time.
            warm_s = min(_WARM_S, seconds / 3)
            time.sleep(warm_s)
            before = [_used(one.pid) for one in (*processes, server)]
            killed_s = 0.0
            if takeover:
                killed_s = self._take_over(processes, seconds)
                before[0] = np.zeros(2)
            sent: Generated = answers.get(timeout=10 * seconds + 600)
            ended_s = time.time()
            self._wait(processes, lambda: self._current(ended_s))
            after = [_used(one.pid) for one in (*processes, server)]
            spent = [(now - then) * seconds / (seconds - warm_s) for now, then in zip(after, before)]
            return self._asked(lambda log: self._costs(log, sent, spent, idle_s, killed_s))

    @contextlib.contextmanager
    def _owners(self, count: int) -> Iterator[list[Any]]:
        processes = [self._owner(range(number, self._partitions, count)) for number in range(count)]
        try:
            yield processes
        finally:
            self._stop.set()
            for process in processes:
                process.join()

    def _owner(self, numbers: range) -> Any:
        process = _CONTEXT.Process(target=own_partitions, args=(self._settings, self._axes, numbers, self._stop))
        process.start()
        return process

    @contextlib.contextmanager
    def _generator(self, seconds: float) -> Iterator[tuple[Any, Any]]:
        go, answers = _CONTEXT.Event(), _CONTEXT.Queue()
        about = (self._settings.url, self._load, list(self._axes), seconds, go, answers)
        process = _CONTEXT.Process(target=generate, args=about)
        process.start()
        try:
            yield go, answers
        finally:
            process.terminate()
            process.join()

    def _idle_s(self, processes: list[Any]) -> float:
        before = sum(_used(one.pid)[0] for one in processes)
        time.sleep(_IDLE_S)
        return float(sum(_used(one.pid)[0] for one in processes) - before) / _IDLE_S / self._partitions

    def _take_over(self, processes: list[Any], seconds: float) -> float:
        time.sleep(seconds / 6)
        processes[0].kill()
        processes[0].join()
        killed_s = time.time()
        processes[0] = self._owner(range(0, self._partitions, len(processes)))
        return killed_s

    def _asked(self, question: Callable[[FleetLog], Awaitable[T]]) -> T:
        async def ask() -> T:
            async with FleetLog(self._settings, "bench") as log:
                return await question(log)

        return asyncio.run(ask())

    def _wait(self, processes: list[Any], done: Callable[[], bool]) -> None:
        while not done():
            if not all(one.is_alive() for one in processes):
                raise RuntimeError("an owner has ended; its messages are above")
            time.sleep(_STEP_S)

    def _claims(self) -> int:
        return self._asked(lambda log: log.extent(RESULT_STREAM)).last

    def _current(self, since_s: float) -> bool:
        """Whether every owner has reported some time after a moment, and has stored the results of all messages."""

        async def done(log: FleetLog, number: int) -> bool:
            about = await status_of(log, number)
            if about is None or about["at_s"] <= since_s + _REPORTED_S or about["waiting"]:
                return False
            # What waits is known from the last read, which may be older than the last message.
            newest = await log.last(LOG_STREAM, f"{LOG}.{number}.>")
            taken = [one["position"] for one in about["axes"].values()]
            return newest is None or newest.number <= max(taken, default=0)

        async def all_done(log: FleetLog) -> bool:
            return all([await done(log, number) for number in range(self._partitions)])

        return self._asked(all_done)

    async def _costs(
        self, log: FleetLog, sent: Generated, spent: list[np.ndarray], idle_s: float, killed_s: float
    ) -> PathCosts:
        extent, states = await log.extent(LOG_STREAM), await log.extent(STATE_STREAM, ">")
        results = await self._results(log)
        owners = np.sum(spent[:-1], axis=0)
        claims_s = [one.stored_s for one in results if one.claim and one.stored_s > killed_s]
        return PathCosts(
            load=self._load,
            axes=self._count,
            axis_seconds=sent.messages * self._load.period_s,
            messages=sent.messages,
            lost=sent.messages - extent.last,
            responses=sum(one.responses for one in results),
            stores=sum(not one.claim for one in results),
            owner_s=float(owners[0]),
            server_s=float(spent[-1][0]),
            generator_s=sent.spent_s,
            idle_s=idle_s,
            dilation=float(1 + owners[1] / max(owners[0], 1e-9)),
            input_bytes=sent.data_bytes,
            result_bytes=sum(one.size_bytes for one in results),
            state_size=states.size_bytes / max(1, len(states.subjects)),
            trace=await self._trace(log, sent, results),
            began_s=sent.began_s,
            killed_s=killed_s,
            claimed_s=max(claims_s) if killed_s else 0.0,
        )

    async def _results(self, log: FleetLog) -> list[_Result]:
        found, last = [], (await log.extent(RESULT_STREAM)).last
        async for message in stored_messages(log, RESULT_STREAM, f"{RESULTS}.*", last):
            one = ResultMessage.from_bytes(message.data)
            size = 0 if one.claim else len(message.data)
            partition = int(message.subject.split(".")[1])
            found.append(_Result(partition, one.through, message.stored_s, one.claim, one.rows.num_rows, size))
        return found

    async def _trace(self, log: FleetLog, sent: Generated, results: list[_Result]) -> np.ndarray:
        found, last = [], (await log.extent(LOG_STREAM)).last
        through = {number: [one for one in results if one.partition == number] for number in range(self._partitions)}
        numbers = {number: [one.through for one in rows] for number, rows in through.items()}
        async for message in stored_messages(log, LOG_STREAM, f"{LOG}.>", last):
            partition = int(message.subject.split(".")[1])
            at = int(np.searchsorted(numbers[partition], message.number))
            if at < len(through[partition]):
                axis = self._keys[key_of(message.subject)]
                header = read_header(message.data[read_header(message.data).length :])
                due_s = sent.due_s(axis, header.sample // self._load.samples)
                found.append((partition, due_s, message.stored_s, through[partition][at].stored_s))
        return np.array(found, _TRACE)


@dataclass(frozen=True)
class _Result:
    """A message of results."""

    partition: int
    through: int
    stored_s: float
    claim: bool
    responses: int
    size_bytes: int


def _used(pid: int | None) -> np.ndarray:
    """Processor time of a process, and the time that its threads waited for a processor, in seconds."""
    process = psutil.Process(pid)
    waited_ns = 0
    for thread in process.threads():
        with contextlib.suppress(FileNotFoundError):  # a thread that has ended meanwhile
            waited_ns += int(Path(f"/proc/{process.pid}/task/{thread.id}/schedstat").read_text().split()[1])
    times = process.cpu_times()
    return np.array([times.user + times.system, waited_ns / 1e9])


def verdict(value: float, target: float, *, most: bool) -> str:
    """The target, and whether it is met."""
    met = value <= target if most else value >= target
    return f"target {'≤' if most else '≥'} {target:,g}: {'met' if met else 'missed'}"


def row(costs: PathCosts, name: str) -> str:
    """A line of the table, as Markdown."""
    part = 1 / costs.axis_seconds
    p50_s, p99_s = np.quantile(costs.lags_s, (0.5, 0.99)) if len(costs.lags_s) else (np.nan, np.nan)
    return (
        f"| {name} | {costs.core_share * 1e3:.2f} | {costs.server_s * part * 1e3:.2f} "
        f"| {costs.generator_s * part * 1e3:.2f} | {costs.axes_per_core:,.0f} "
        f"| {costs.input_bytes * part / 1e3:.1f} | {costs.result_bytes / max(1, costs.responses):.0f} "
        f"| {costs.state_size / 1e3:.1f} | {costs.state_share:.1%} | {costs.lost} | {p50_s:.2f} | {p99_s:.2f} "
        f"| {1 - 1 / costs.dilation:.0%} |"
    )


HEADING = (
    "| messages | owner, ms/s | server, ms/s | generator, ms/s | axes a core at 60 % | input, kB/s | B a response "
    "| state, kB | states / input | lost | lag p50, s | p99, s | waited |\n" + "|---" * 13 + "|"
)


def verdicts(found: dict[str, PathCosts]) -> Iterator[str]:
    """A sentence for each target."""
    blocks, loaded, spectra = found[SAMPLES_500.name], found[_LOADED], found[SPECTRA.name]
    for costs, target in ((blocks, 500), (spectra, 3000)):
        count = costs.axes_per_core
        yield f"axes a core at {LOAD:.0%}, {costs.load.name}: {count:,.0f}, {verdict(count, target, most=False)}"
    lag_s = float(np.quantile(loaded.lags_s, 0.99))
    yield (
        f"p99 from sample to stored result, {loaded.axes} axes with blocks of 100 ms: {lag_s:.2f} s at "
        f"{loaded.core_share * loaded.axes:.0%} of a core, {verdict(lag_s, 0.5, most=True)} "
        "(judge it on a quiet computer)"
    )
    for costs in (blocks, found[MOTION.name]):
        share = costs.state_share * 100
        yield f"bytes of states, {costs.load.name}: {share:.1f} % of the input, {verdict(share, 10, most=True)}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.fleet_path", description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--share", type=float, default=1.0, help="of the axes, for a computer that has other work")
    parser.add_argument("--only", default="", help="part of the name of the messages")
    asked = parser.parse_args()
    print(HEADING)
    found = {}
    for load, axes in AXES.items():
        if asked.only not in load.name:
            continue
        costs = found[load.name] = measured(load, round(asked.share * axes), asked.seconds)
        print(row(costs, load.name), flush=True)
        if load is SAMPLES_100:
            for _ in range(2):  # more axes cost less each: the first step falls short of the load
                costs = measured(load, round(costs.axes_per_core), asked.seconds)
            found[_LOADED] = costs
            print(row(costs, _LOADED), flush=True)
    if not asked.only:
        print(*verdicts(found), sep="\n")


if __name__ == "__main__":
    main()
