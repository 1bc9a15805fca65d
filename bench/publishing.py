"""`python -m bench.publishing`: latency of live axes while receivers answer, are down, are slow, or refuse.

Axes as in `bench.live` (4 kHz, 21 lines, 20 responses per second) in one session. The receivers of their results
change in turn, so that all conditions are measured side by side in one run: nobody; two receivers that answer; two
whose port is closed; two that accept and never answer; two that refuse. Each axis reports an alarm per second and sends
all its results once a second to each receiver. Latency is from the arrival of a datagram until all results of its
block were published, for blocks that give a response.

At the end the receivers answer again, and every event must arrive.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import socket
import tempfile
import time
from collections import defaultdict
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from bench.live import Clock, Scenario, axis, free_ports, send
from livebode.configuration import Axis
from livebode.core import Event
from livebode.publishing import Publisher
from livebode.runtime import Destination, Session

ROUND_S, ROUNDS, AXES = 5.0, 4, 4
SETTLE_S, LAST_S = 3.0, 20.0
CONDITIONS = ("nobody", "answer", "down", "slow", "refuse")
RATIO_MAX = 1.1


def receive(port: int, refused: Any, results: Connection) -> None:
    """A receiver of HTTP, until something is sent to it; answers with the ids of events that it has."""
    found: set[str] = set()

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_POST(self) -> None:
            content = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            if not refused.is_set() and content.get("kind") == "change":
                found.add(content["id"])
            self.send_response(503 if refused.is_set() else 200)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
    server.daemon_threads = True
    server.timeout = 0.2
    while not results.poll():
        server.handle_request()
    results.send(found)


def with_receivers(axes: dict[str, Axis], ports: list[int]) -> dict[str, Axis]:
    """The axes with a section for each of these ports."""
    sections = [
        {
            "kind": "webhook", "name": f"receiver {number}", "url": f"http://127.0.0.1:{port}", "events": ["all"],
            "values": ["parameters", "responses", "status"], "interval_s": 1.0, "timeout_s": 2.0,
        }
        for number, port in enumerate(ports)
    ]  # fmt: skip
    plain = {name: one.model_dump(exclude_unset=True, by_alias=True) for name, one in axes.items()}
    return {name: Axis.of(one | {"publish": sections}, name) for name, one in plain.items()}


class Schedule:
    """Changes the receivers of a session in turn, reports alarms, and collects the latencies of each condition."""

    def __init__(self, axes: dict[str, Axis], ports: dict[str, list[int]], rounds: int, round_s: float) -> None:
        self.plan = list(CONDITIONS) * rounds
        self.clocks = {name: Clock() for name in axes}
        self.latency_s: dict[str, list[float]] = defaultdict(list)
        self.alarms = 0
        self._axes, self._ports, self._round_s = axes, ports, round_s
        self._begun_s: float | None = None
        self._part = -1

    def look(self, session: Session, publisher: Publisher, refused: Any) -> None:
        """What is due now; it ends the session after the last condition."""
        now_s = time.monotonic()
        if self._begun_s is None:
            if all(thread.status.responses for thread in session.all):
                self._begun_s = now_s + SETTLE_S
            return
        part, at_s = divmod(now_s - self._begun_s, self._round_s)
        if part >= len(self.plan):
            session.end()
        elif part >= 0:
            self._measure(self.plan[int(part)], settled=at_s > self._round_s / 5)
            if part != self._part:
                self._part = int(part)
                self._change(publisher, refused)
            self._report_alarm(session, now_s - self._begun_s)

    def _measure(self, condition: str, *, settled: bool) -> None:
        for clock in self.clocks.values():
            found, clock.latency_s = clock.latency_s, []
            if settled:
                self.latency_s[condition] += found

    def _change(self, publisher: Publisher, refused: Any) -> None:
        condition = self.plan[self._part]
        (refused.set if condition == "refuse" else refused.clear)()
        publisher.prepare(with_receivers(self._axes, self._ports[condition]))()

    def _report_alarm(self, session: Session, passed_s: float) -> None:
        if self.plan[self._part] == "nobody" or passed_s < self.alarms:
            return
        self.alarms += 1
        for thread in session.all:
            thread.control.record(Event("change", self.alarms, float(self.alarms), f"alarm {self.alarms}"))


def measure(rounds: int, round_s: float) -> tuple[dict[str, list[float]], int, int]:
    """Latencies in seconds by condition; events that were reported, and those that arrived at both receivers."""
    context = multiprocessing.get_context("spawn")
    tcp, udp, end, refused = free_ports(3, socket.SOCK_STREAM), free_ports(AXES), context.Event(), context.Event()
    pipes = [context.Pipe() for _ in range(2)]
    beside = [context.Process(target=send, args=(udp, end))]
    beside += [context.Process(target=receive, args=(port, refused, pipe[1])) for port, pipe in zip(tcp, pipes)]
    axes = {f"x{i}": axis(port, Scenario("publishing", AXES)) for i, port in enumerate(udp)}
    for process in beside:
        process.start()
    with tempfile.TemporaryDirectory() as folder, socket.create_server(("127.0.0.1", 0), backlog=4096) as silent:
        ports = {"nobody": [], "answer": tcp[:2], "down": [tcp[2]] * 2, "refuse": tcp[:2]}
        ports["slow"] = [silent.getsockname()[1]] * 2
        schedule = Schedule(axes, ports, rounds, round_s)
        # Events that wait when the receivers change are sent to those that follow: they have the same names.
        publisher = Publisher(with_receivers(axes, tcp[:2]), Path(folder) / "outbox.sqlite", print, alone="")

        def to(name: str, _: Axis) -> Destination:
            subscribers = (publisher.subscriber(name), schedule.clocks[name])
            return Destination(Path(folder) / name, lambda *_: None, subscribers=subscribers)

        session = Session(axes, to, report=lambda *_: None, leave=lambda *_: None)
        session.run(lambda: schedule.look(session, publisher, refused))
        refused.clear()
        publisher.prepare(with_receivers(axes, tcp[:2]))()
        publisher.close(LAST_S)
        for thread in session.all:
            thread.result()
    end.set()
    taken = []
    for inlet, _ in pipes:
        inlet.send("end")
        taken.append(inlet.recv())
    for process in beside:
        process.join()
    return schedule.latency_s, AXES * schedule.alarms, len(taken[0] & taken[1])


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.publishing", description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="rounds of all conditions")
    parser.add_argument("--seconds", type=float, default=ROUND_S, help="duration of a condition in a round")
    options = parser.parse_args()
    latency_s, sent, arrived = measure(options.rounds, options.seconds)
    alone = float(np.quantile(latency_s["nobody"], 0.99))
    print(f"{'receivers':12}{'responses':>10}{'p50, ms':>10}{'p99, ms':>10}{'p99 ratio':>10}")
    for condition in CONDITIONS:
        p50, p99 = np.quantile(latency_s[condition], [0.5, 0.99])
        print(f"{condition:12}{len(latency_s[condition]):10}{1e3 * p50:10.3f}{1e3 * p99:10.3f}{p99 / alone:10.2f}")
    worst = max(float(np.quantile(latency_s[condition], 0.99)) for condition in CONDITIONS) / alone
    print(f"target p99 ratio ≤ {RATIO_MAX}: {'met' if worst <= RATIO_MAX else 'missed'}")
    print(f"{arrived} of {sent} events arrived at both receivers: {'met' if arrived == sent else 'missed'}")


if __name__ == "__main__":
    main()
