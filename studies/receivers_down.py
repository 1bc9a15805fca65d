"""`python -m studies.receivers_down`: receivers of [[publish]] that are down for an hour, and what arrives afterwards.

An axis reports an alarm every second and sends results every ten. A webhook, an InfluxDB, a mail server, a syslog
server and an MQTT broker are down for the whole time; then each is started, and every event must arrive once, in its
order. Printed: the events of each receiver, how long after its start the last one arrived, and how the memory of the
process grew. Nothing is accelerated.
"""

from __future__ import annotations

import argparse
import email
import email.policy
import json
import re
import resource
import shutil
import socket
import socketserver
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import livebode
from livebode.configuration import Axis
from livebode.core import Event
from livebode.publishing import Publisher
from livebode.runtime import ClockSet, RunControl, RunStarted

KINDS = ("webhook", "influxdb", "email", "syslog", "mqtt")
BACK_S = 90.0
"""Longest time after the start of a receiver; livebode tries at least every 30 s."""
_NUMBER = re.compile(r"no\. (\d+)\b")


class Arrivals:
    """Numbers of the events that a receiver has, in their order."""

    def __init__(self) -> None:
        self.numbers: list[int] = []

    def take(self, text: str) -> None:
        """Take a message, which may have several events."""
        self.numbers += map(int, _NUMBER.findall(text))


class _HttpServer(ThreadingHTTPServer):
    daemon_threads, block_on_close = True, False


class _TcpServer(socketserver.ThreadingTCPServer):
    daemon_threads, block_on_close = True, False


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as one:
        return int(one.getsockname()[1])


@contextmanager
def http(port: int, arrivals: Arrivals) -> Iterator[None]:
    """A server that takes every request, and reads the events of a webhook or of the line protocol."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"])).decode()
            if body.startswith("{"):
                arrivals.take(json.loads(body).get("message", ""))
            else:
                arrivals.take("\n".join(line for line in body.splitlines() if line.startswith("livebode_event")))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    with serving(_HttpServer(("127.0.0.1", port), Handler)):
        yield


@contextmanager
def syslog(port: int, arrivals: Arrivals) -> Iterator[None]:
    """A syslog server by TCP, with counted octets (RFC 6587)."""

    class Handler(socketserver.StreamRequestHandler):
        def handle(self) -> None:
            while (digits := b"".join(iter(lambda: self.rfile.read(1).strip(), b""))).isdigit():
                arrivals.take(self.rfile.read(int(digits)).decode())

    with serving(_TcpServer(("127.0.0.1", port), Handler)):
        yield


@contextmanager
def serving(server: socketserver.BaseServer) -> Iterator[None]:
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@contextmanager
def mail(port: int, arrivals: Arrivals) -> Iterator[None]:
    """A mail server. A mail has the first and the newest events of a cause, so only these have an arrival."""
    from aiosmtpd.controller import Controller

    class Mailbox:
        async def handle_DATA(self, _server: Any, _session: Any, envelope: Any) -> str:  # noqa: N802 - aiosmtpd's name
            body = email.message_from_bytes(envelope.content, policy=email.policy.default).get_content()
            arrivals.take(body)  # the subject has one of the events again
            return "250 OK"

    controller = Controller(Mailbox(), hostname="127.0.0.1", port=port)
    controller.start()
    try:
        yield
    finally:
        controller.stop()


@contextmanager
def broker(port: int, arrivals: Arrivals) -> Iterator[None]:
    """Mosquitto with a subscriber."""
    from paho.mqtt import client as mqtt
    from paho.mqtt.enums import CallbackAPIVersion

    def connected(client: mqtt.Client, *_: Any) -> None:
        client.subscribe("#", qos=1)

    def take(_client: mqtt.Client, _data: Any, message: mqtt.MQTTMessage) -> None:
        if message.topic.endswith("/event"):
            arrivals.take(message.payload.decode())

    found = shutil.which("mosquitto") or "/usr/sbin/mosquitto"
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder) / "conf"
        settings.write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\nmax_queued_messages 0\nlog_type none\n")
        process = subprocess.Popen([found, "-c", str(settings)])
        client = mqtt.Client(CallbackAPIVersion.VERSION2)
        client.on_connect, client.on_message = connected, take
        client.connect_async("127.0.0.1", port)
        client.reconnect_delay_set(1, 1)
        client.loop_start()
        try:
            yield
        finally:
            client.loop_stop()
            process.terminate()
            process.wait()


SERVERS: dict[str, Callable[[int, Arrivals], Any]] = {
    "webhook": http, "influxdb": http, "email": mail, "syslog": syslog, "mqtt": broker,
}  # fmt: skip
_URLS = {
    "webhook": "http://127.0.0.1:{}/hook", "influxdb": "http://127.0.0.1:{}/write?db=axes",
    "email": "smtp://127.0.0.1:{}", "syslog": "tcp://127.0.0.1:{}", "mqtt": "mqtt://127.0.0.1:{}",
}  # fmt: skip


def sections(ports: dict[str, int]) -> list[dict[str, Any]]:
    """A section for each receiver, with events and, where it takes them, results."""
    found = []
    for kind, port in ports.items():
        section: dict[str, Any] = {"kind": kind, "name": kind, "url": _URLS[kind].format(port), "events": ["alarms"]}
        if kind == "email":
            section |= {"sender": "axis@plant.example", "recipients": ["a@plant.example"], "group_s": 1}
        elif kind != "syslog":
            section |= {"values": ["parameters", "responses", "status"], "interval_s": 10}
        found.append(section)
    return found


def resident_mb() -> float:
    """Memory of this process now, in megabytes."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


class PublishingAxis:
    """An axis without a machine: reports an alarm every second to all receivers."""

    def __init__(self, folder: Path, ports: dict[str, int]) -> None:
        plain = {"source": {"log": "log.parquet"}, "signals": {"output": "y"}, "publish": sections(ports)}
        self.publisher = Publisher({"x": Axis.of(plain, "axis.toml")}, folder / "run.outbox.sqlite", print, alone="x")
        self._feed = self.publisher.subscriber("x")
        self._feed(RunStarted(folder / "run", {}, RunControl(), None))  # type: ignore[arg-type]
        self._feed(ClockSet(((0.0, time.time()),)))
        self.reported = 0

    def report(self) -> None:
        details = {"what": "stiffness", "amount_percent": -2.0}
        self._feed(Event("change", self.reported, float(self.reported), f"stiffness (no. {self.reported})", details))
        self._feed(livebode.example_responses()[-2:])
        self.reported += 1

    def counts(self) -> dict[str, dict[str, int]]:
        found: dict[str, dict[str, int]] = self.publisher.findings("x")["published"]
        return found


def outage(axis: PublishingAxis, minutes: float) -> tuple[float, float]:
    """Report alarms for so long; the memory after the first tenth of the time and at its end, in megabytes."""
    begun_s, early = time.monotonic(), 0.0
    while (passed_s := time.monotonic() - begun_s) < 60 * minutes:
        axis.report()
        if not early and passed_s > 6 * minutes:
            early = resident_mb()
        time.sleep(max(0.0, begun_s + axis.reported - time.monotonic()))
    return early, resident_mb()


def returned(axis: PublishingAxis, kind: str, port: int, arrivals: Arrivals, stack: ExitStack) -> float:
    """Start a receiver; the time until all events have been delivered, in seconds, or NaN."""
    stack.enter_context(SERVERS[kind](port, arrivals))
    begun_s = time.monotonic()
    while time.monotonic() - begun_s < BACK_S:
        if axis.counts()[kind]["events_delivered"] == axis.reported:
            return time.monotonic() - begun_s
        time.sleep(0.1)
    return float("nan")


def whole(kind: str, numbers: list[int], reported: int) -> bool:
    """Whether every event arrived, in its order, and none twice; in mails the first and the newest of each."""
    return numbers == sorted(set(numbers)) and (
        len(numbers) == reported or (kind == "email" and {0, reported - 1} <= set(numbers))
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--minutes", type=float, default=60.0)
    minutes = parser.parse_args().minutes
    ports = {kind: free_port() for kind in KINDS}
    arrivals = {kind: Arrivals() for kind in KINDS}
    good = True
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        axis = PublishingAxis(Path(folder), ports)
        early, late = outage(axis, minutes)
        print(f"{minutes:g} min without a receiver, {axis.reported} events; memory {early:.0f}, then {late:.0f} MB\n")
        print("| receiver | events delivered | dropped | in order, each once | last one after its start, s |")
        print("|---|---:|---:|---|---:|")
        for kind in KINDS:
            back_s = returned(axis, kind, ports[kind], arrivals[kind], stack)
            time.sleep(1.0)  # a subscriber of the broker may get the last one after livebode has its acknowledgement
            counts, right = axis.counts()[kind], whole(kind, arrivals[kind].numbers, axis.reported)
            good = good and right and back_s < BACK_S
            shown = f"{counts['events_delivered']} | {counts['events_dropped']} | {'yes' if right else 'no'}"
            print(f"| {kind} | {shown} | {back_s:.1f} |", flush=True)
        axis.publisher.close()
    print("\neverything arrived" if good else "\nevents are missing, doubled or out of order")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
