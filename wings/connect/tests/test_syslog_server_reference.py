"""Debian's rsyslogd reads the messages: header, structured data and text, by UDP and by a connection."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from livebode.core import PublishError
from livebode.publishing import EventMessage
from livebode_connect.syslog import SyslogSink
from tests.support.peers.peer import free_port, program, until
from tests.support.receivers import configured

NASTY = ['a "b"', "c]d", "e\\f", "Ölüberdruck µ ∞", "%m %s", "end\\"]
SETTINGS = """global(workDirectory="{folder}" parser.escapeControlCharactersOnReceive="off")
module(load="imudp")
module(load="imtcp")
template(name="whole" type="list") {{
  property(name="pri") constant(value="\\t") property(name="app-name") constant(value="\\t")
  property(name="msgid") constant(value="\\t") property(name="timestamp" dateFormat="rfc3339") constant(value="\\t")
  property(name="structured-data") constant(value="\\t") property(name="msg") constant(value="\\n")
}}
ruleset(name="all") {{ action(type="omfile" file="{folder}/messages" template="whole") }}
input(type="imudp" address="127.0.0.1" port="{port}" ruleset="all")
input(type="imtcp" address="127.0.0.1" port="{port}" ruleset="all")
"""
_PAIR = re.compile(r' ([^ =]+)="((?:[^"\\\]]|\\["\\\]])*)"')


class SyslogServer:
    """rsyslogd with one port for UDP and TCP, and the messages that it wrote."""

    def __init__(self, folder: Path) -> None:
        self.port, self._messages = free_port(), folder / "messages"
        settings = folder / "rsyslog.conf"
        settings.write_text(SETTINGS.format(folder=folder, port=self.port))
        command = [program("rsyslogd"), "-n", "-f", settings, "-i", folder / "pid"]
        with (folder / "rsyslogd.log").open("wb") as log:
            self.process = subprocess.Popen(command, stdout=log, stderr=log)

    def close(self) -> None:
        self.process.kill()
        self.process.wait()

    def messages(self, count: int) -> list[list[str]]:
        """The fields of the messages as soon as there are so many."""
        return until(lambda: len(found := self._read()) >= count and found, "messages")

    def _read(self) -> list[list[str]]:
        return [line.split("\t") for line in self._messages.read_text().splitlines()] if self._messages.exists() else []


@pytest.fixture
def server(tmp_path: Path) -> Iterator[SyslogServer]:
    found = SyslogServer(tmp_path)
    yield found
    found.close()


@pytest.mark.parametrize("scheme", ["tcp", "udp"])
def test_header_values_and_text_are_read(server: SyslogServer, scheme: str) -> None:
    events = [
        EventMessage(f"{number:x}", "x", "", "r", "gap", "alarm", "high", text, text, 1.8e9, number)
        for number, text in enumerate(NASTY)
    ]
    sink = SyslogSink(configured({"kind": "syslog", "url": f"{scheme}://127.0.0.1:{server.port}"}).publish[0])
    until(lambda: _sent(sink, events[:1]) and server._read(), "the server to listen")
    before = len(server._read())
    sink.send_events(events)
    sink.close()
    found = server.messages(before + len(events))[-len(events) :]
    assert {(pri, name, kind) for pri, name, kind, *_ in found} == {("26", "livebode", "gap")}
    assert {time[:19] for _, _, _, time, *_ in found} == {"2027-01-15T08:00:00"}
    for (*_, data, text), event in zip(found, events):
        pairs = {name: re.sub(r'\\(["\\\]])', r"\1", value) for name, value in _PAIR.findall(data)}
        assert (pairs["cause"], pairs["sample"]) == (event.cause, str(event.sample))
        assert text.lstrip("\ufeff") == f"x: {event.message}"


def _sent(sink: SyslogSink, events: list[EventMessage]) -> bool:
    try:
        sink.send_events(events)
    except PublishError:
        return False
    return True
