"""Whole runs with receivers: what arrives, what the record says, and an edit of the file while an axis runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa

from livebode.records import RunRecord
from tests.support.command import livebode, signals
from tests.support.peers.machine import Machine
from tests.support.receivers import HttpReceiver, free_port, until
from tests.support.session_process import SHARED, Running, source, summary_of
from tests.support.small_axis import SMALL_AXIS

SECRET = "s3cret-of-the-plant"


def written(folder: Path) -> None:
    columns = signals()
    rows = zip(*(values.tolist() for values in columns.values()))
    (folder / "log.csv").write_text("\n".join([",".join(columns), *(",".join(map(repr, row)) for row in rows)]))


def test_a_recording_is_published_and_run_json_counts_it_without_secrets(tmp_path: Path) -> None:
    written(tmp_path)
    (tmp_path / "token").write_text(SECRET)
    with HttpReceiver() as receiver:
        (tmp_path / "axis.toml").write_text(
            f"""[source]\nlog = "log.csv"\n{SMALL_AXIS}
[fit]
model = "rigid"
[[publish]]
name = "hook"
kind = "webhook"
url = "http://127.0.0.1:{receiver.port}/{SECRET}"
token_file = "token"
events = ["all"]
values = ["parameters", "responses", "status"]
[[publish]]
name = "absent"
kind = "webhook"
url = "http://127.0.0.1:{free_port()}/{SECRET}"
"""
        )
        result = livebode("run", tmp_path / "axis.toml", "--out", tmp_path / "run")
    assert result.code == 0, result.err
    values = [content for content in receiver.contents if content["type"] == "values"]
    (last,) = values[-1]["axes"]
    run = RunRecord.open(tmp_path / "run")
    assert last["status"]["responses"] == len(run.responses())
    assert last["response"]["frequency_hz"] == [50.0, 100.0, 200.0]
    rows = [row for table in map(pa.table, run.tables("parameters")) for row in table.to_pylist() if row["name"] == "J"]
    assert np.isnan(rows[-1]["value"])  # no belt: a fit that is not valid has no value
    assert {one["name"]: one["value"] for one in last["measurements"]}["J"] is None
    assert len(receiver.texts) == len(run.events())
    assert run.summary["published"].keys() == {"hook", "absent"}
    for file in (tmp_path / "run").rglob("*"):
        assert not file.is_file() or SECRET.encode() not in file.read_bytes(), file
    assert not (tmp_path / "run.outbox.sqlite").exists()


def test_an_edit_adds_and_removes_a_receiver_in_place_and_a_wrong_one_is_refused(tmp_path: Path) -> None:
    with HttpReceiver() as receiver, Machine(tmp_path) as machine:
        text = f"{SHARED}[axes.x]\n{source(machine)}"
        hook = f'[[publish]]\nkind = "webhook"\nurl = "http://127.0.0.1:{receiver.port}/"\nvalues = ["status"]\n'
        hook += 'interval_s = 0.2\nevents = ["all"]\n'
        with Running(tmp_path, text) as running:
            running.tracked("x", 700)
            running.edit(hook.replace("webhook", "webhok") + text)
            assert "publish.kind" in running.reported_event("x", "configuration-refused").message
            running.edit(hook + text)
            applied = running.reported_event("x", "configuration-applied")
            assert applied.message == "[publish] changed: applied in place"
            until(lambda: any(one["type"] == "values" for one in receiver.contents), "results")
            running.edit(text)
            until(lambda: len(running_events(running)) == 2, "the second change")
            code, _, err = running.end()
        assert code == 0, err
        assert not (running.out / "x-2").exists()  # the same run, without another directory
    (found,) = [content for content in receiver.contents if content["type"] == "values"][-1]["axes"]
    assert (found["axis"], found["run"], found["status"]["state"]) == ("x", "x", "tracking")


def running_events(running: Running) -> list[object]:
    return [event for event in RunRecord.open(running.out / "x").events() if event.kind == "configuration-applied"]


def test_a_receiver_that_is_down_is_in_the_record_of_a_live_run(tmp_path: Path) -> None:
    with Machine(tmp_path) as machine:
        hook = f'[[publish]]\nkind = "webhook"\nurl = "http://127.0.0.1:{free_port()}/"\nvalues = ["status"]\n'
        with Running(tmp_path, f"{hook}{SHARED}[axes.x]\n{source(machine)}") as running:
            event = running.reported_event("x", "sink-down")
            code, _, err = running.end()
    assert code == 0, err
    assert event.details["sink"] == "webhook 127.0.0.1"
    assert "webhook 127.0.0.1 does not take messages: no connection: Connection refused" in err
    assert summary_of(running.out / "x")["published"]["webhook 127.0.0.1"]["rounds"] == 0
