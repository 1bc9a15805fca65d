"""run.json says of which machine, recording and configuration a run is, and when its samples were taken."""

from __future__ import annotations

import hashlib
import json
import os
import time
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode import Run
from livebode.configuration import Axis, recipe_id
from livebode.core import ENCODING, RecordError
from livebode.records import RUN, RunRecord
from livebode.records.summary_file import COPY, to_document
from livebode.runtime import Destination, run
from livebode.version import __version__
from tests.support.command import signals, write_csv, write_parquet
from tests.support.errors import refused
from tests.support.live_session import LiveSession
from tests.support.peers.peer import batches, until
from tests.support.peers.plain import TcpPeer
from tests.support.ringing import RATE_HZ as RINGING_HZ
from tests.support.ringing import two_modes

SECTIONS: dict[str, Any] = {
    "signals": {"output": "y", "input": "u", "excitation": "w"},
    "lines": {"frequencies": "50,100,200", "window": 100},
    "machine": {"site": "Graz", "machine": "press 4", "axis": "X"},
}
UTC_S = 1_790_000_000.0
MODIFIED_S = 1_700_000_000.0


def log_at(path: Path, first_s: float, samples: int = 1000, seed: int = 0) -> Path:
    """A recording at 1 kHz whose time column begins there; it was written last at MODIFIED_S."""
    columns = signals(samples, seed=seed)
    write_csv(path, columns | {"t": first_s + np.arange(samples) / 1000})
    os.utime(path, (MODIFIED_S, MODIFIED_S))
    return path


def axis_of(source: dict[str, Any], **sections: Any) -> Axis:
    return Axis.of({"source": source} | SECTIONS | sections, "test")


def summary_of(axis: Axis, folder: Path) -> dict[str, Any]:
    return RunRecord.open(run(axis, Destination(folder, lambda *_: None)).directory).summary


def seconds(text: str) -> float:
    """Of an ISO time, which has to be UTC."""
    assert text.endswith("Z")
    return datetime.fromisoformat(text).timestamp()


def span_of(summary: dict[str, Any]) -> tuple[str, float, float]:
    date = summary["recorded"]
    return date["clock"], seconds(date["from"]), seconds(date["to"])


def test_a_run_names_its_machine_its_recipe_its_content_and_its_versions(tmp_path: Path) -> None:
    path = log_at(tmp_path / "log.csv", 0.0)
    axis = axis_of({"log": str(path)})
    summary = summary_of(axis, tmp_path / "run")
    assert summary["machine"] == {"site": "Graz", "machine": "press 4", "axis": "X"}
    assert Run(tmp_path / "run").machine == "Graz/press 4/X"
    assert summary["recipe"] == recipe_id(axis)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    assert summary["content"] == {"sha256": digest, "files": [{"file": "log.csv", "sha256": digest}]}
    assert (summary["versions"]["livebode"], summary["versions"]["states"]) == (__version__, ENCODING)


@pytest.mark.parametrize(
    ("first_s", "source", "expected"),
    [
        (UTC_S, {}, ("time of day", UTC_S, UTC_S + 1)),
        (UTC_S, {"from": "200 samples", "to": "700 samples"}, ("time of day", UTC_S + 0.2, UTC_S + 0.7)),
        (5.0, {}, ("file", MODIFIED_S - 1, MODIFIED_S)),
        (UTC_S, {"clock": "relative"}, ("file", MODIFIED_S - 1, MODIFIED_S)),
    ],
)  # fmt: skip
def test_a_recording_is_dated_by_its_clock_or_else_by_its_file(
    tmp_path: Path, first_s: float, source: dict[str, Any], expected: tuple[str, float, float]
) -> None:
    path = log_at(tmp_path / "log.csv", first_s)
    clock, begin_s, end_s = span_of(summary_of(axis_of({"log": str(path)} | source), tmp_path / "run"))
    assert (clock, begin_s, end_s) == (expected[0], *map(pytest.approx, expected[1:]))


@pytest.mark.parametrize(
    ("firsts_s", "expected"),
    [
        ((UTC_S + 3600, UTC_S), ("time of day", UTC_S, UTC_S + 3601)),
        ((UTC_S, 5.0), ("file", MODIFIED_S - 1, MODIFIED_S)),
    ],
)  # fmt: skip
def test_several_recordings_have_one_content_and_the_span_of_all(
    tmp_path: Path, firsts_s: tuple[float, float], expected: tuple[str, float, float]
) -> None:
    paths = [log_at(tmp_path / f"{i}.csv", first_s, seed=i) for i, first_s in enumerate(firsts_s)]
    summary = summary_of(axis_of({"log": [str(path) for path in paths]}), tmp_path / "run")
    digests = [hashlib.sha256(path.read_bytes()).hexdigest() for path in paths]
    assert [file["sha256"] for file in summary["content"]["files"]] == digests
    assert summary["content"]["sha256"] == hashlib.sha256("".join(f"{d}\n" for d in digests).encode()).hexdigest()
    clock, begin_s, end_s = span_of(summary)
    assert (clock, begin_s, end_s) == (expected[0], *map(pytest.approx, expected[1:]))


def test_channels_with_clocks_of_their_own_are_dated(tmp_path: Path) -> None:
    rng, columns = np.random.default_rng(0), signals(4000)
    time_s = UTC_S + (np.arange(4000) + rng.uniform(-0.3, 0.3, 4000)) / 1000
    path = write_parquet(tmp_path / "log.parquet", columns | {"t": time_s})
    axis = axis_of({"log": str(path)}, tracking={"accept_roles": True})
    clock, begin_s, end_s = span_of(summary_of(axis, tmp_path / "run"))
    assert (clock, begin_s, end_s) == (
        "time of day",
        pytest.approx(UTC_S, abs=0.01),
        pytest.approx(UTC_S + 4, abs=0.01),
    )


def test_an_output_only_run_is_dated_and_named(tmp_path: Path) -> None:
    (y,) = two_modes(0, 20_000)
    path = write_parquet(tmp_path / "log.parquet", {"t": UTC_S + np.arange(y.size) / RINGING_HZ, "y": y})
    data = {"source": {"log": str(path)}, "signals": {"output": "y"}, "output_only": {}}
    axis = Axis.of(data | {"machine": {"line": "2"}}, "test")
    run(axis, Destination(tmp_path / "run", lambda *_: None))
    summary = RunRecord.open(tmp_path / "run", output_only=True).summary
    assert (summary["machine"], summary["recipe"]) == ({"line": "2"}, recipe_id(axis))
    assert summary["content"]["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert span_of(summary) == ("time of day", UTC_S, pytest.approx(UTC_S + y.size / RINGING_HZ))


def test_a_live_run_is_dated_from_its_first_sample_also_before_its_end_and_has_no_content(tmp_path: Path) -> None:
    """A run that is killed has the beginning; continued by another process, it retains it."""
    machine = {"machine": "press 4"}
    with TcpPeer(tmp_path) as peer:
        with LiveSession(tmp_path, peer, machine=machine) as session:
            peer.wait_ready()
            before_s = time.time()
            for batch in batches(100, first=0):
                peer.send(batch)
            path = session.run / RUN
            until(lambda: path.exists() and "recorded" in json.loads(path.read_text()), "the date")
            assert json.loads(path.read_text())["recorded"]["to"] is None
            after_s = time.time()
        first = RunRecord.open(session.run).summary
        peer.hang_up()
        with LiveSession(tmp_path, peer, machine=machine) as session:
            peer.wait_ready()
            for batch in batches(100, first=100_000):
                peer.send(batch)
            until(lambda: any(event.kind == "record-continued" for event in session.events()), "the run to continue")
        again = RunRecord.open(session.run).summary
    assert "content" not in first
    assert first["machine"] == machine
    ((from_s, unix_s),) = first["clock"]
    clock, begin_s, end_s = span_of(first)
    assert clock == "time of day"
    assert before_s - 2.6 <= begin_s <= after_s
    assert begin_s == pytest.approx(from_s + unix_s, abs=0.1, rel=0)
    assert end_s - begin_s == pytest.approx(first["counts"]["samples"] / first["found"]["rate_hz"], abs=0.1)
    assert again["recorded"]["from"] == first["recorded"]["from"]
    assert again["recorded"]["to"] > first["recorded"]["to"]


@pytest.mark.parametrize(
    "changed",
    [
        {"machine": {"site": 4}}, {"machine": "press"}, {"recipe": 7}, {"content": {"sha256": "../a", "files": []}},
        {"recorded": {"from": 4, "to": None, "clock": "file"}}, {"recorded": {"from": None, "to": None, "clock": "x"}},
    ],
)  # fmt: skip
def test_entries_in_another_form_are_refused_and_missing_ones_are_not(tmp_path: Path, changed: dict[str, Any]) -> None:
    summary = {"found": {"rate_hz": 1.0, "window": 10, "bins": [1], "quiet_bins": [], "quantity": "plant", "unit": ""}}
    for name in (RUN, COPY):
        (tmp_path / name).write_bytes(to_document(summary))
    assert Run(tmp_path).machine == ""
    for name in (RUN, COPY):
        (tmp_path / name).write_bytes(to_document(summary | changed))
    with refused(RecordError, "unexpected-content"):
        RunRecord.open(tmp_path)
