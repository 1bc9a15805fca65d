"""`livebode fleet` on a real log: send, status, check, replay, server, and what is refused."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from livebode.sources.live import encode_line
from livebode_plant.fleet import connection
from livebode_plant.fleet.fleet_settings import FleetSettings
from livebode_plant.fleet.server import LogServer
from tests.support.command import livebode
from tests.support.fleet_runs import PARTITIONS, SAMPLES, batch, owned_until_current
from tests.support.forked import Command
from tests.support.peers.peer import PATIENCE_S, until

AXIS = """[machine]
site = "Graz"
axis = "x"

[source]
url = "stdin:"

[signals]
output = "y"
input = "u"
excitation = "w"

[lines]
frequencies = "20:100:20"
window = 100

[tracking]
hop = 25
"""
BATCHES = 30


@pytest.fixture
def fleet(tmp_path: Path) -> Iterator[Path]:
    """The fleet.toml of one axis, and a server."""
    (tmp_path / "axis.toml").write_text(AXIS)
    with LogServer(tmp_path / "log", PARTITIONS) as server:
        path = tmp_path / "fleet.toml"
        path.write_text(
            f'axes = ["axis.toml"]\npartitions = {PARTITIONS}\n'
            f'[log]\nurl = "{server.url}"\nsize_gb = 0.5\nresults_gb = 0.5\n'
        )
        yield path


def test_what_a_source_sends_is_tracked_checked_listed_and_replayed(
    fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lines").write_bytes(
        b"".join(encode_line(batch(0, first)) for first in range(0, BATCHES * SAMPLES, SAMPLES))
    )
    with (tmp_path / "lines").open() as lines:
        monkeypatch.setattr(sys, "stdin", lines)
        sent = livebode("fleet", "send", tmp_path / "axis.toml", fleet)
    assert sent.code == 0, sent.err
    status_next = f"Next: livebode fleet status {fleet}\n"
    assert sent.out.endswith(f"the log has stored {BATCHES} messages\n{status_next}")
    settings = FleetSettings.read(fleet)
    owned_until_current(settings.log, settings.read_axes())

    checked = livebode("fleet", "replay", fleet)
    assert checked.out == (
        f"{2 * BATCHES} responses (axes: 1): 0 missing, 0 doubled, 0 different from one uninterrupted computation\n"
        + status_next
    )
    found = json.loads(livebode("fleet", "replay", fleet, "--json").out)
    assert found["axes"]["Graz/x"]["responses"] == 2 * BATCHES

    status = json.loads(livebode("fleet", "status", fleet, "--json").out)
    assert [axis["axis"] for axis in status["axes"]] == ["Graz/x"]
    assert status["alarms"] == []
    listed = livebode("fleet", "status", fleet).out
    assert "axes: 1 with data, 0 without" in listed
    assert listed.endswith(f"Next: livebode fleet status {fleet} --serve\n")

    replayed = livebode("fleet", "replay", fleet, "Graz/x", "--out", tmp_path / "x.parquet")
    assert replayed.code == 0, replayed.err
    assert pq.read_table(tmp_path / "x.parquet").num_rows == 2 * BATCHES * 5
    later = livebode("fleet", "replay", fleet, "Graz/x", "--from", "2100-01-01")
    assert (later.code, "no data of Graz/x" in later.err) == (2, True)
    assert "no axis 'Graz/y'" in livebode("fleet", "replay", fleet, "Graz/y").err


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_sink_and_a_sender_end_in_order_at_the_signal_of_a_service_manager(fleet: Path, number: int) -> None:
    with fleet.open("a") as file:
        file.write('[sink]\nlake = "lake"\n')
    axis = fleet.with_name("axis.toml")
    with Command("fleet", "sink", fleet) as sink, Command("fleet", "send", axis, fleet) as sender:
        sender.stdin.write(encode_line(batch(0, 0)))
        sender.stdin.flush()
        of_sink = f"0 events stored\nNext: livebode archive list {fleet.parent / 'lake'}\n"
        of_sender = f"the log has stored 1 messages\nNext: livebode fleet status {fleet}\n"
        for one, last in ((sink, of_sink.encode()), (sender, of_sender.encode())):
            until(lambda one=one: b"Ctrl-C ends" in one.printed, "its first line")
            one.send_signal(number)
            one.wait(PATIENCE_S)  # its standard input is open: nothing else ends it
            out, err = one.communicate()
            assert (one.returncode, out[-len(last) :], err) == (0, last, b"")
    assert livebode("archive", "list", fleet.parent / "lake").code == 0


def test_the_configuration_of_the_server_has_the_limits_and_the_partitions(tmp_path: Path) -> None:
    (tmp_path / "fleet.toml").write_text('axes = ["axis.toml"]\npartitions = 7\n[log]\nsize_gb = 20\nresults_gb = 10')
    text = livebode("fleet", "setup", tmp_path / "fleet.toml", "--store", "/var/lib/log", "--port", "4333").out
    assert '"127.0.0.1:4333"' in text
    assert "max_file_store: 33000000000" in text
    assert "partition(7,1,2,3,4)" in text


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["run"], "give either FLEET.toml or --demo"),
        (["run", "fleet.toml", "--demo"], "give either FLEET.toml or --demo"),
        (["status"], "give either FLEET.toml or --demo AXES"),
        (["status", "--demo", "6", "--trends", "javascript:x"], "is not an address; begin it with https://"),
        (["setup"], "give either FLEET.toml, for the configuration of a server, or --user"),
        (["setup", "fleet.toml", "--user", "view"], "give either FLEET.toml"),
        (["setup", "--user", "view", "--leaf"], "--leaf and --user exclude each other"),
        (["setup", "fleet.toml", "--out", "keys"], "--out belongs to --user; give --user USER too"),
        (["setup", "--user", "edge"], "an edge needs the path of its axes, such as edge:Graz"),
        (["setup", "--user", "view:Graz"], "choose edge:PATH, fleet, view"),
    ],
)
def test_a_fleet_or_what_needs_none_is_given(words: list[str], says: str) -> None:
    refused = livebode("fleet", *words)
    assert (refused.code, says in refused.err) == (2, True), refused.err


def test_without_a_server_a_command_says_so_in_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "_START_S", 0.3)
    (tmp_path / "axis.toml").write_text(AXIS)
    (tmp_path / "fleet.toml").write_text('axes = ["axis.toml"]\n[log]\nurl = "nats://127.0.0.1:1"')
    refused = livebode("fleet", "status", tmp_path / "fleet.toml")
    assert refused.code == 75
    assert "the log at nats://127.0.0.1:1 cannot be reached" in refused.err
    assert len(refused.err.splitlines()) == 1
