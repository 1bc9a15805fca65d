"""`livebode run` on a machine that sends: the same responses as from its recording, and a whole run directory."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import pytest

from livebode.core import Event
from livebode.dashboard.run_entry import entry
from livebode.records import RunRecord
from livebode.runtime import Document, RunStarted
from livebode.sources.live import encode_layout, encode_line, encode_samples
from tests.support.command import RATE_HZ, livebode, signals, write_parquet
from tests.support.live_runs import CHANNELS, assert_recorded, axis, sent, started, table
from tests.support.live_session import LiveSession
from tests.support.peers.peer import PATIENCE_S, batches, free_port, until
from tests.support.peers.plain import TcpPeer, wait_read
from tests.support.small_axis import SMALL_AXIS


def test_lines_on_standard_input_give_what_the_recording_gives(tmp_path):
    with started(axis(tmp_path, 'url = "stdin:"'), tmp_path / "live") as process:
        out, err = process.communicate(b"".join(map(encode_line, sent())), PATIENCE_S)
    assert (process.returncode, err) == (0, b"")
    log = write_parquet(tmp_path / "log.parquet", signals())
    livebode("run", axis(tmp_path, f'log = "{log}"'), "--out", tmp_path / "recorded")
    assert_recorded(table(tmp_path / "live"), table(tmp_path / "recorded"))
    summary = json.loads(out)
    assert summary["counts"]["samples"] == 2000
    assert summary["source"]["first_sample"] == 70_000
    assert summary["source"]["lost"] == 0
    assert summary["found"]["format"] == "ndjson"


def test_ctrl_c_leaves_a_whole_run_with_its_gaps(tmp_path):
    class Machine(TcpPeer):
        layout = encode_layout(CHANNELS, float(RATE_HZ), epoch=9)

    with (
        Machine(tmp_path) as peer,
        started(axis(tmp_path, f'url = "{peer.settings["url"]}"'), tmp_path / "live") as process,
    ):
        peer.wait_ready()
        for at, batch in enumerate(sent()):
            if at not in (20, 21):
                peer._link.sendall(encode_samples(batch, double=True))
        wait_read(peer.settings["url"])
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(2.0)  # it goes on, for the machine may send more
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, err) == (0, b"")
    summary = json.loads(out)
    assert summary["counts"]["samples"] == 1920
    assert summary["counts"]["missing"] == summary["source"]["lost"] == 80
    events = [json.loads(line) for line in (tmp_path / "live" / "events.jsonl").read_text().splitlines()]
    assert [event["kind"] for event in events] == ["connected", "loss", "gap"]
    assert (tmp_path / "live" / "bode.svg").is_file()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_run_that_a_person_ends_is_complete_and_a_killed_one_is_not(tmp_path: Path, number: signal.Signals) -> None:
    """In run.json, in the list of runs and in the report; the same command continues both."""
    port, run = free_port(socket.SOCK_DGRAM), tmp_path / "live"
    path = axis(tmp_path, f'url = "udp://127.0.0.1:{port}"')
    batches = iter(sent(20_000))

    def send(sender: socket.socket) -> bool:
        with contextlib.suppress(ConnectionError):
            sender.send(encode_samples(next(batches), double=True))
        return (run / "run.json").exists() and len(RunRecord.open(run).responses()) > 20

    with started(path, run) as process, socket.socket(type=socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", port))
        layout = encode_layout(CHANNELS, float(RATE_HZ), epoch=9)
        until(lambda: listens(sender, layout), "the port to be open")
        until(lambda: send(sender), "responses to be recorded")
        process.send_signal(number)
        process.communicate(timeout=PATIENCE_S)
    complete = number != signal.SIGKILL
    assert process.returncode == (0 if complete else -number)
    assert RunRecord.open(run).ended == complete
    aged(run)
    assert entry(run).state == ("finished" if complete else "stopped")
    assert livebode("report", run, "--out", tmp_path / "report.html").code == 0
    assert ("The run is not finished" in (tmp_path / "report.html").read_text()) != complete
    with started(path, run), socket.socket(type=socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", port))
        until(lambda: listens(sender, layout), "the port to be open again")
        until(lambda: send(sender) and not RunRecord.open(run).ended, "it to continue")


def aged(run: Path) -> None:
    """Files that did not change for a minute are not being recorded."""
    for file in (run, *run.rglob("*")):
        os.utime(file, (time.time() - 60, time.time() - 60))


def test_a_run_whose_wait_times_out_is_ended(tmp_path):
    with pytest.raises(subprocess.TimeoutExpired), started(axis(tmp_path, 'url = "stdin:"'), tmp_path) as process:
        process.communicate(timeout=0.01)
    assert process.poll() == -signal.SIGKILL


def test_a_live_source_without_specified_lines_is_refused(tmp_path):
    path = axis(tmp_path, 'url = "stdin:"', SMALL_AXIS.replace("window = 100", ""))
    with started(path, tmp_path / "live") as process:
        _, err = process.communicate(b"".join(map(encode_line, sent())), PATIENCE_S)
    assert process.returncode == 2
    assert b"set lines.frequencies and lines.window for a live source" in err
    assert not (tmp_path / "live").exists()


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("", "needs either a log, a url or a replay"),
        ('log = "a"\nurl = "udp://h:1"', "needs either a log, a url or a replay"),
        ('url = "udp://h"', "give udp://host:port"),
        ('url = "udp://h:1"\nsymbol = "x"', "source.symbol does not apply to udp"),
        ('url = "udp://h:1"\nreorder_batches = 1000', "source.reorder_batches = 1000 is not usable"),
        ('url = "mqtt://me:secret@h/t"', "source.url has a user or password"),
        ('url = "udp://h:1"\npasword_env = "X"', "did you mean 'password_env'"),
    ],
)
def test_impossible_sources_are_refused_without_repeating_secrets(tmp_path, source, message):
    result = livebode("run", axis(tmp_path, source), "--out", tmp_path / "live")
    assert result.code == 2
    assert message in result.err
    assert "secret" not in result.err


def test_the_terminal_shows_what_somebody_must_look_after(tmp_path):
    """A second sender and a restart of the first: each is said where livebode was started, and not with every batch."""
    given = sent(400)
    stranger = [replace(batch, epoch=77) for batch in given]
    again = [replace(batch, first_sample=batch.first_sample - 70_000, epoch=10) for batch in given]
    port = free_port(socket.SOCK_DGRAM)
    with started(axis(tmp_path, f'url = "udp://127.0.0.1:{port}"'), tmp_path / "live") as process:
        with socket.socket(type=socket.SOCK_DGRAM) as sender:
            sender.connect(("127.0.0.1", port))
            layout = encode_layout(CHANNELS, float(RATE_HZ))
            until(lambda: listens(sender, layout), "the port to be open")
            mixed = [batch for pair in zip(given, stranger) for batch in pair]
            for batch in mixed * 2 + again * 2:
                sender.send(encode_samples(batch, double=True))
                time.sleep(0.002)
        until(lambda: (tmp_path / "live" / "events.jsonl").exists(), "the run to begin")
        until(lambda: b"restart" in (tmp_path / "live" / "events.jsonl").read_bytes(), "the restart to be recorded")
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE_S)
    printed = err.decode().splitlines()
    assert sum("does not belong to the stream and was dropped" in line for line in printed) == 1
    assert sum("the sender restarted at its sample 0" in line for line in printed) == 1


def test_events_of_a_silent_machine_are_recorded_at_once(tmp_path):
    """A connection that is lost, and what a person acknowledges, wait for no sample."""

    started: list[RunStarted] = []

    def listen(document: Document) -> None:
        if isinstance(document, RunStarted):
            started.append(document)

    with TcpPeer(tmp_path) as peer, LiveSession(tmp_path, peer, listen) as session:
        peer.wait_ready()
        for batch in batches(40, first=0):
            peer.send(batch)
        until(session.events, "the record to begin")
        peer.interrupt()
        until(lambda: any(event.kind == "disconnected" for event in session.events()), "the connection to be lost")
        assert started[0].control.record(Event("acknowledged", 0, 0.0, "seen"))
        until(lambda: "acknowledged" in [event.kind for event in session.events()], "both to be recorded")


def test_a_continued_run_records_what_happens_before_the_machine_sends_new_samples(tmp_path):
    with TcpPeer(tmp_path) as peer:
        for sent_again in (40, 1):  # the second time what is recorded already
            with LiveSession(tmp_path, peer) as session:
                peer.wait_ready()
                before = len(session.events())
                for batch in batches(40, first=0)[:sent_again]:
                    peer.send(batch)
                until(lambda n=before: session.events()[n:], "the connection to be recorded")
                found = [event.kind for event in session.events()]
            peer.hang_up()
    assert found[1] == "record-continued"


def listens(sender: socket.socket, frame: bytes) -> bool:
    try:
        return bool(sender.send(frame) and sender.send(frame))
    except ConnectionRefusedError:
        return False
