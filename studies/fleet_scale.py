"""A fleet of 100,000 axes on paper, from costs measured in the same run, and a simulation that checks the paper.

    python -m studies.fleet_scale [--seconds 20] [--axes 200]

It measures on the real path (nats-server, owners, generator) what an axis costs, and prints: the assumptions; bytes per
second, cores, servers and storage by tier; lag and takeover as the simulation of a worker predicts them, compared with
the measured ones at small scale, and predicted at 60 % of a core of its own.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from bench.fleet_loads import SAMPLES_500, SPECTRA, AxisLoad
from bench.fleet_path import LOAD, PathCosts, measured, state_every_s
from bench.fleet_sink import SinkCosts
from bench.fleet_sink import measured as measured_sink
from livebode_plant.fleet.axis_stream import AxisStream
from studies.fleet_queue import WorkerCosts, arrivals, caught_up_s, stored_times

DAY_S, YEAR_S = 86400.0, 365.25 * 86400.0
PARTITIONS, _OWNERS = 2, 2
"""Of the measurement: with 200 axes, as many axes a partition as 100,000 in 1,024."""
_SIMULATED_S, _JITTER_S = 120.0, 0.05
_SILENCE_S = 5.0
"""From a kill to the claim, as a fleet's coordinator needs."""
_TRACKED = 10


@dataclass(frozen=True)
class Assumptions:
    """What is not measured."""

    axes: int = 100_000
    axes_per_machine: int = 40
    machines_per_site: int = 10
    partitions: int = 1024
    load: float = LOAD
    cores_per_server: int = 32
    copies: int = 3
    full_rate_days: float = 7.0
    minute_years: float = 2.0
    alarms_per_axis_year: float = 2.0
    alarm_bytes: float = 1000.0
    raw_per_alarm_s: float = 120.0

    def rows(self) -> list[tuple[str, str]]:
        """Name and value of each."""
        return [
            ("axes", f"{self.axes:,}"),
            ("axes a machine, machines a site (one leaf node)", f"{self.axes_per_machine}, {self.machines_per_site}"),
            ("partitions", f"{self.partitions:,}"),
            ("load of a core", f"{self.load:.0%}"),
            ("cores a computer", f"{self.cores_per_server}"),
            ("copies of the log, and of its server's work", f"{self.copies}"),
            ("data and responses at full rate", f"{self.full_rate_days:g} days"),
            ("minute means", f"{self.minute_years:g} years"),
            ("alarms an axis and year, of 1 kB", f"{self.alarms_per_axis_year:g}"),
            ("raw data around an alarm", f"{self.raw_per_alarm_s:g} s"),
        ]


@dataclass(frozen=True)
class AxisCosts:
    """Of one axis: bytes and processor time per second, and sizes.

    Attributes
    ----------
    owner_cores, server_cores
        Processor time per second; what a partition costs without data is not included.
    responses_per_s, lake_bytes, mean_bytes
        Responses; bytes of one with its fit in the lake of the sink, and of their means over a period.
    state_bytes
        Of one state.
    partition_cores
        Of a partition without data.
    """

    messages_per_s: float
    input_bytes_per_s: float
    result_bytes_per_s: float
    owner_cores: float
    server_cores: float
    responses_per_s: float
    lake_bytes: float
    mean_bytes: float
    state_bytes: float
    partition_cores: float = 0.0

    @classmethod
    def of(cls, costs: PathCosts, sink: SinkCosts) -> AxisCosts:
        """From measurements."""
        seconds = costs.axis_seconds
        idle_s = costs.idle_s * PARTITIONS * seconds / costs.axes
        return cls(
            messages_per_s=costs.messages / seconds,
            input_bytes_per_s=costs.input_bytes / seconds,
            result_bytes_per_s=costs.result_bytes / seconds,
            owner_cores=(costs.owner_s - idle_s) / seconds,
            server_cores=costs.server_s / seconds,
            responses_per_s=costs.responses / seconds,
            lake_bytes=sink.bytes_of(),
            mean_bytes=sink.bytes_of("_minute"),
            state_bytes=costs.state_size,
            partition_cores=costs.idle_s,
        )

    @property
    def state_every_s(self) -> float:
        """From one state to the next."""
        return state_every_s(self.state_bytes, self.input_bytes_per_s)


@dataclass(frozen=True)
class FleetSize:
    """The paper: what a fleet of the assumed size needs."""

    axis: AxisCosts
    given: Assumptions

    @property
    def sites(self) -> int:
        return ceil(self.given.axes / self.given.axes_per_machine / self.given.machines_per_site)

    @property
    def site_bytes_per_s(self) -> float:
        """From a site's leaf node."""
        return self.axis.input_bytes_per_s * self.given.axes_per_machine * self.given.machines_per_site

    @property
    def owner_cores(self) -> float:
        used = self.given.axes * self.axis.owner_cores + self.given.partitions * self.axis.partition_cores
        return used / self.given.load

    @property
    def server_cores(self) -> float:
        """Of all copies."""
        return self.given.copies * self.given.axes * self.axis.server_cores / self.given.load

    @property
    def computers(self) -> int:
        return ceil(self.owner_cores / self.given.cores_per_server) + ceil(
            self.server_cores / self.given.cores_per_server
        )

    @property
    def streams(self) -> int:
        """Streams among which the data are divided, if one server's core writes a stream."""
        return max(1, ceil(self.given.axes * self.axis.server_cores / self.given.load))

    def tiers_bytes(self) -> dict[str, float]:
        """Storage by tier; what is retained permanently, for a year. The log's copies are counted."""
        given, axis = self.given, self.axis
        full_s = given.full_rate_days * DAY_S
        alarms = given.axes * given.alarms_per_axis_year
        return {
            "log, full rate": given.axes * axis.input_bytes_per_s * full_s * given.copies,
            "responses, full rate": given.axes * axis.responses_per_s * axis.lake_bytes * full_s,
            "states": given.axes * axis.state_bytes * given.copies,
            "minute means": given.axes * axis.mean_bytes * given.minute_years * YEAR_S / 60,
            "hour means, a year": given.axes * axis.mean_bytes * YEAR_S / 3600,
            "alarms, a year": alarms * given.alarm_bytes,
            "raw around alarms, a year": alarms * given.raw_per_alarm_s * axis.input_bytes_per_s,
        }

    def rows(self) -> list[tuple[str, str]]:
        """The table of the paper."""
        found = [
            ("messages per second", f"{self.given.axes * self.axis.messages_per_s:,.0f}"),
            ("data, MB/s", f"{self.given.axes * self.axis.input_bytes_per_s / 1e6:,.0f}"),
            ("sites; from each, MB/s", f"{self.sites}; {self.site_bytes_per_s / 1e6:.2f}"),
            ("cores of owners", f"{self.owner_cores:,.0f}"),
            ("axes a core", f"{self.given.axes / self.owner_cores:,.0f}"),
            ("axes a partition", f"{self.given.axes / self.given.partitions:.0f}"),
            ("partitions a core", f"{self.given.partitions / self.owner_cores:.2f}"),
            ("cores of the log, all copies", f"{self.server_cores:,.0f}"),
            ("streams for the data", f"{self.streams}"),
            ("computers", f"{self.computers}"),
            ("a state every, s", f"{self.axis.state_every_s:.0f}"),
        ]
        return found + [(f"{name}, TB", _amount(size / 1e12)) for name, size in self.tiers_bytes().items()]


def _amount(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def tracking_s(load: AxisLoad, axes: int) -> float:
    """Processor time of tracking a message, in this process."""
    streams = {number: AxisStream(axis, 1) for number, axis in enumerate(load.axes(axes).values())}
    messages = [[load.message(axis, number) for axis in streams] for number in range(2 * _TRACKED)]
    for number, row in enumerate(messages):
        if number == _TRACKED:  # the first ones create trackers
            began_s = time.process_time()
        for stream, message in zip(streams.values(), row):
            stream.process(message, number + 1, 0.0)
    return (time.process_time() - began_s) / (_TRACKED * axes)


def worker_costs(costs: PathCosts, message_s: float) -> WorkerCosts:
    """Service times from a measurement: what a partition costs without data is that of its reads.

    What is neither reading nor tracking is that of storing.
    """
    usual = WorkerCosts(message_s)
    seconds = costs.axis_seconds / costs.axes
    rest_s = costs.owner_s - costs.idle_s * PARTITIONS * seconds - costs.messages * message_s
    return replace(usual, batch_s=costs.idle_s * usual.results_s, store_s=max(0.0, rest_s) / costs.stores)


def predicted_lags_s(
    costs: WorkerCosts, *, axes: int, partitions: int, period_s: float, seconds: float, jitter_s: float = 0.0
) -> np.ndarray:
    """Of the messages of one worker, in the order of their arrival in each partition."""
    times = arrivals(axes, partitions, period_s, seconds, jitter_s=jitter_s)
    stored = stored_times(costs, times)
    return np.concatenate([after - before for after, before in zip(stored, times)])


def simulated_trace(costs: PathCosts, worker: WorkerCosts) -> np.ndarray:
    """When the simulated owners would have stored the results of the messages as the log received them.

    With a takeover only the messages of the owner that was killed, from the state that the next one restored.
    """
    worker = worker.slower(costs.dilation)
    trace, open_s = costs.trace, float(np.min(costs.trace["arrived_s"]))
    if costs.killed_s:
        open_s = costs.claimed_s
        state_s = costs.killed_s - _state_every_s(costs)
        trace = trace[(trace["partition"] % _OWNERS == 0) & (trace["arrived_s"] > state_s)]
    found = []
    for owner in range(_OWNERS):
        parts = [trace[trace["partition"] == number] for number in range(owner, PARTITIONS, _OWNERS)]
        for part, stored_s in zip(parts, stored_times(worker, [part["arrived_s"] for part in parts], open_s)):
            found.append(part.copy())
            found[-1]["stored_s"] = stored_s
    return np.concatenate(found)


def _state_every_s(costs: PathCosts) -> float:
    return state_every_s(costs.state_size, costs.input_bytes / costs.axis_seconds)


def caught_up_after_s(costs: PathCosts) -> float:
    """From the claim after a takeover until the results of what had arrived by then were stored."""
    trace = costs.trace[costs.trace["partition"] % _OWNERS == 0]
    return float(np.max(trace["stored_s"][trace["arrived_s"] < costs.claimed_s])) - costs.claimed_s


def _comparison(steady: PathCosts, taken: PathCosts, worker: WorkerCosts) -> Iterator[str]:
    """Measured and simulated, at small scale; the service times are those without a takeover."""
    found, again = (replace(one, trace=simulated_trace(one, worker)) for one in (steady, taken))
    yield (
        f"service times: {worker.message_s * 1e3:.2f} ms to track a message, {worker.batch_s * 1e3:.2f} ms for a read, "
        f"{worker.store_s * 1e3:.1f} ms to store results"
    )
    waited = [f"{1 - 1 / one.dilation:.0%}" for one in (steady, taken)]
    yield f"owners with work waited for a processor in {waited[0]} of the time, in {waited[1]} with the takeover"
    yield "| | measured | simulated |\n|---|---|---|"
    for name, share in (("p50", 0.5), ("p99", 0.99)):
        yield f"| lag {name}, s | {np.quantile(steady.lags_s, share):.2f} | {np.quantile(found.lags_s, share):.2f} |"
    yield f"| takeover: claimed after, s | {taken.claimed_s - taken.killed_s:.2f} | (given) |"
    yield (
        f"| takeover: caught up after the claim, s | {caught_up_after_s(taken):.2f} | {caught_up_after_s(again):.2f} |"
    )


def _at_load(costs: PathCosts, worker: WorkerCosts) -> str:
    """Simulated lag and takeover of a worker with a core of its own, of which it uses about 60 %."""
    own = costs.owner_s / (costs.axis_seconds / costs.axes) / PARTITIONS
    partitions = max(1, round(LOAD / own))
    axes = partitions * costs.axes // PARTITIONS
    about = {"axes": axes, "partitions": partitions, "period_s": costs.load.period_s}
    lags_s = predicted_lags_s(worker, seconds=_SIMULATED_S, jitter_s=_JITTER_S, **about)
    waiting_s = _SILENCE_S + _state_every_s(costs) / 2
    again_s = caught_up_s(own * partitions, waiting_s)
    return (
        f"| {costs.load.name} | {axes:,} | {partitions} | {own * partitions:.0%} | {np.quantile(lags_s, 0.99):.2f} "
        f"| {waiting_s:.0f} | {again_s:.0f} |"
    )


def main() -> None:
    """Measure, and print the tables."""
    parser = argparse.ArgumentParser(prog="python -m studies.fleet_scale", description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--axes", type=int, default=200, help="of spectra; half as many of samples")
    asked = parser.parse_args()
    size = {"owners": _OWNERS, "partitions": PARTITIONS}
    spectra = measured(SPECTRA, asked.axes, asked.seconds, **size)
    samples = measured(SAMPLES_500, asked.axes // 2, asked.seconds, **size)
    taken = measured(SPECTRA, asked.axes, asked.seconds, takeover=True, **size)
    given = Assumptions()
    print("| assumption | value |\n|---|---|")
    print(*(f"| {name} | {value} |" for name, value in given.rows()), sep="\n")
    print(f"\n| {given.axes:,} axes | {spectra.load.name} | {samples.load.name} |\n|---|---|---|")
    sink = measured_sink()
    both = zip(*(FleetSize(AxisCosts.of(one, sink), given).rows() for one in (spectra, samples)))
    print(*(f"| {name} | {first} | {second} |" for (name, first), (_, second) in both), sep="\n")
    print(f"\n{asked.axes} axes of spectra on {_OWNERS} owners and this computer:")
    workers = {one.load: worker_costs(one, tracking_s(one.load, one.axes)) for one in (spectra, samples)}
    print(*_comparison(spectra, taken, workers[SPECTRA]), sep="\n")
    print(f"\nsimulated: a worker with a core of its own, and a takeover {_SILENCE_S:g} s after a kill")
    print("| messages | axes | partitions | load | lag p99, s | to compute again, s | caught up after, s |")
    print("|---" * 7 + "|")
    print(*(_at_load(one, workers[one.load]) for one in (spectra, samples)), sep="\n")


if __name__ == "__main__":
    main()
