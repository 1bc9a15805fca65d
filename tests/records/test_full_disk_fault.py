"""A full disk pauses the record and not the tracking; a budget removes what is oldest, and never events."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import resource
import subprocess
import sys
import threading
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from livebode.core import Block, Channel, Event
from livebode.records import RunRecord, SegmentLimits, Store, as_rows, samples_of, to_frame
from livebode.records.segments import closing, journal
from livebode.records.segments.frames import COMMIT
from livebode.records.segments.shelf import Shelf
from tests.support.peers.peer import PATIENCE_S
from tests.support.starved import on_a_limited_file

ROOT = Path(__file__).parents[2]
RATE_HZ = 1000.0
Y = samples_of([Channel("y", "m")])
SUMMARY = {"found": {"bins": [1], "window": 10, "rate_hz": RATE_HZ, "quiet_bins": [], "quantity": "plant", "unit": ""}}


def _send(outlet: Connection, run: Path) -> None:
    outlet.send([event.kind for event in on_a_limited_file(run)])


def check_pause(kinds: list[str]) -> None:
    """One pause; segments that the disk refused to close meanwhile are closed behind it."""
    assert [kind for kind in kinds if kind in ("record-paused", "record-resumed")] == [
        "record-paused",
        "record-resumed",
    ]
    closing = [kind for kind in kinds if kind in ("record-unclosed", "record-closed")]
    assert not closing or closing[-1] == "record-closed"
    assert len(closing) + 2 == len(kinds)


def test_a_file_at_its_size_limit_pauses_the_record(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    results, outlet = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(outlet, tmp_path / "run"))
    process.start()
    process.join()
    assert process.exitcode == 0
    check_pause(results.recv())


def test_the_record_pauses_on_a_full_disk_and_continues(tmp_path: Path) -> None:
    mount = f"mount -t tmpfs -o size=2m none {tmp_path}"
    allowed = subprocess.run(["unshare", "-Urm", "sh", "-c", mount], capture_output=True, text=True, check=False)
    if allowed.returncode:
        pytest.skip(f"this system lets a user mount no small file system: {allowed.stderr.strip()}")
    command = f"{mount} && exec {sys.executable} -m tests.support.starved {tmp_path}"
    done = subprocess.run(
        ["unshare", "-Urm", "sh", "-c", command], cwd=ROOT, capture_output=True, text=True, check=False,
        env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    check_pause(done.stdout.split())


def test_the_lost_samples_are_reported_exactly(tmp_path: Path) -> None:
    # It is lost where memory holds no more; events are not.
    limits = SegmentLimits(interval_samples=1, segment_samples=10**9, interval_s=0.0, held_bytes=10_000)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    events: list[Event] = []
    with Store(tmp_path / "run", {"samples": Y}, limits, events.append) as store:
        store.begin(SUMMARY, 0, 0.0, {"state": b""})
        try:
            # Not a byte more, however much of what was written before is safe by then.
            taken = [_second(store, k, {5: 1, 27: soft}.get(k), hard) for k in range(40)]
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        paused, resumed = events
        store.finish(SUMMARY, {}, finished=True)
    assert taken == [True] * 5 + [False] * 22 + [True] * 13
    run = RunRecord.open(tmp_path / "run")
    number = np.concatenate([table["sample"].to_numpy() for table in map(pa.table, run.tables("samples"))])
    missing = np.setdiff1d(np.arange(4000), number)
    lost = resumed.details["lost"]["samples"]
    assert lost == {"rows": missing.size, "first_sample": missing[0], "last_sample": missing[-1]}
    # 22 seconds less what memory holds; and what was not synced yet at the pause waits with them: at most the 6 before.
    assert 0 < missing.size < 2800
    assert paused.sample == 600
    assert [e.sample for e in run.events() if e.kind == "mark"] == list(range(0, 4000, 100))


def test_no_commit_waits_for_the_conversion_of_the_journal_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    released = threading.Event()

    def slow(shelf: Shelf) -> None:
        assert released.wait(PATIENCE_S)
        close_journals(shelf)

    close_journals = Shelf.close_journals
    monkeypatch.setattr(Shelf, "close_journals", slow)
    monkeypatch.setattr(closing, "_USUAL_S", 0.0)
    limits = SegmentLimits(interval_samples=1, segment_samples=300, interval_s=0.0)
    with Store(tmp_path / "run", {"samples": Y}, limits) as store:
        store.begin(SUMMARY, 0, 0.0, {"state": b""})
        assert all(_second(store, k, None, 0) for k in range(20))  # would wait here: nothing releases it
        assert len(list((tmp_path / "run/open").glob("*.journal"))) == 2
        released.set()
        store._closing.wait()
        assert _second(store, 20, None, 0)
        store.finish(SUMMARY, {}, finished=True)
    assert sum(table.num_rows for table in map(pa.table, RunRecord.open(tmp_path / "run").tables("samples"))) == 2100


def test_a_journal_that_no_other_can_follow_grows_and_is_closed_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journal, "_SPARSE_BYTES_MAX", 10_000)
    limits = SegmentLimits(interval_samples=1, segment_samples=300, interval_s=0.0)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    events: list[Event] = []
    with Store(tmp_path / "run", {"samples": Y}, limits, events.append) as store:
        store.begin(SUMMARY, 0, 0.0, {"state": b""})
        resource.setrlimit(resource.RLIMIT_NOFILE, (0, hard))  # no file can be opened
        try:
            taken = [_second(store, k, None, hard) for k in range(20)]
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        unclosed = [event.kind for event in events]
        assert (tmp_path / "run/open/000001.journal").stat().st_size > 30_000
        (table,) = map(pa.table, RunRecord.open(tmp_path / "run").tables("samples"))
        taken.append(_second(store, 20, None, hard))
    events: list[Event] = []
    with Store(tmp_path / "run", {"samples": Y}, limits, events.append) as store:
        assert store.last is not None
        assert store.last.sample == 2100
        store.finish(SUMMARY, {}, finished=True)
    assert all(taken)
    assert unclosed == ["record-unclosed"] * 5  # of 18 attempts the 1st, 2nd, 4th, 8th and 16th
    assert table.num_rows == 2000
    assert sum(table.num_rows for table in map(pa.table, RunRecord.open(tmp_path / "run").tables("samples"))) == 2100


def test_segments_are_closed_again_when_the_next_journal_could_be_opened(tmp_path: Path) -> None:
    limits = SegmentLimits(interval_samples=1, segment_samples=300, interval_s=0.0)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    events: list[Event] = []
    with Store(tmp_path / "run", {"samples": Y}, limits, events.append) as store:
        store.begin(SUMMARY, 0, 0.0, {"state": b""})
        for k in range(8):
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft if k > 3 else 0, hard))
            _second(store, k, None, hard)
        store.finish(SUMMARY, {}, finished=True)
    assert [event.kind for event in events] == ["record-unclosed", "record-unclosed", "record-closed"]
    assert events[-1].details["attempts"] == 2


def test_a_journal_that_holds_what_no_run_writes_ends_no_run(tmp_path: Path) -> None:
    limits = SegmentLimits(interval_samples=1, segment_samples=300, interval_s=0.0)
    events: list[Event] = []
    with Store(tmp_path / "run", {"samples": Y}, limits, events.append) as store:
        store.begin(SUMMARY, 0, 0.0, {"state": b""})
        with (tmp_path / "run/open/000001.journal").open("ab") as file:
            file.write(to_frame(COMMIT, b"no commit"))
        taken = [_second(store, k, None, 0) for k in range(8)]
        event = events[0]
    assert all(taken)
    assert event.kind == "record-unclosed"
    assert "has invalid content" in event.message


def _second(store: Store, k: int, limit: int | None, hard: int) -> bool:
    if limit is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    block = Block(np.arange(100.0)[np.newaxis], (Channel("y"),), RATE_HZ, start=100 * k)
    store.write("samples", as_rows([block], Y))
    store.write_event(Event("mark", block.start, block.start / RATE_HZ, ""))
    return store.commit(block.stop, block.stop / RATE_HZ, {"state": bytes(100)})


def size_of(run: Path) -> int:
    """Bytes in a directory whose oldest files are being removed meanwhile."""
    size = 0
    for path in run.rglob("*"):
        with contextlib.suppress(FileNotFoundError):
            size += path.stat().st_size * path.is_file()
    return size


def test_a_budget_removes_the_oldest_samples_and_no_events(tmp_path: Path) -> None:
    # Segments of 0.8 MB, as random numbers do not compress; 40 of samples and of responses each are 64 MB.
    budget, rng = 8 << 20, np.random.default_rng(0)
    limits = SegmentLimits(interval_samples=1, segment_samples=50_000, budget_bytes=budget)
    used: list[int] = []
    results: list[Event] = []
    with Store(tmp_path / "run", {"samples": Y, "responses": Y}, limits, results.append) as store:
        store.begin(SUMMARY, 0, 0.0, {"state": b""})
        for start in range(0, 40 * 50_000, 10_000):
            block = Block(rng.standard_normal((1, 10_000)), (Channel("y"),), RATE_HZ, start=start)
            for table in ("samples", "responses"):
                store.write(table, as_rows([block], Y))
            store.write_event(Event("mark", start, start / RATE_HZ, ""))
            store.commit(block.stop, block.stop / RATE_HZ, {"state": bytes(100)})
            used.append(size_of(tmp_path / "run"))
        store.finish(SUMMARY, {}, finished=True)
    run = RunRecord.open(tmp_path / "run")
    assert max(used) <= budget
    assert max(used) > budget / 2
    # Samples went first, all but those closed last, and of responses the newest stay.
    newest = run.segments[-1].name.removeprefix("responses/")
    assert [segment.name for segment in run.segments if segment.table == "samples"] == [f"samples/{newest}"]
    number = np.concatenate([table["sample"].to_numpy() for table in map(pa.table, run.tables("responses"))])
    assert np.array_equal(number, np.arange(number[0], 40 * 50_000))
    assert number[0] > 0
    marks = [event for event in run.events() if event.kind == "mark"]
    assert len(marks) == 200
    gone = [name for event in results for name in event.details.get("removed", [])]
    of_samples = gone.index("responses/000001.parquet")
    assert gone[:of_samples] == [f"samples/{k:06d}.parquet" for k in range(1, of_samples + 1)]
    assert not any((tmp_path / "run" / name).exists() for name in gone)
