"""A live run knows which time of day it is, by the samples that were delayed least, and says it everywhere the same."""

from __future__ import annotations

import json
import time
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.configuration import Axis
from livebode.core import ConfigError, Event, RunClock, UsageError, date_and_time, moment, moment_of_start, moments_by
from livebode.dashboard.run_feed import RunFeed
from livebode.dashboard.state import State
from livebode.records import RUN, RunRecord, query
from livebode.records.summary_file import to_document
from livebode.runtime import Destination, run
from livebode.runtime.clock_relation import STEP_S, ClockRelation
from livebode.sources import open_log
from livebode.sources.live import LiveBlock, SourceSettings, make_source
from tests.support.command import livebode, signals, write_csv
from tests.support.errors import refused
from tests.support.live_session import LiveSession
from tests.support.peers.peer import batches, until
from tests.support.peers.plain import TcpPeer

RATE_HZ, SIZE = 100.0, 10


def taken(delays_s: list[float], pauses_s: dict[int, float] | None = None, ppm: float = 0.0) -> ClockRelation:
    """What comes of Blocks that took so long on the way; before some the sender paused and does not say how long."""
    relation, paused_s, now_s = ClockRelation(), 0.0, time.monotonic()
    for number, delay_s in enumerate(delays_s):
        pause_s = (pauses_s or {}).get(number, 0.0)
        paused_s += pause_s
        at_s = (number + 1) * SIZE / RATE_HZ
        block = LiveBlock(
            np.zeros((1, SIZE)), ("y",), RATE_HZ, start=number * SIZE, gap=pause_s > 0,
            arrived_s=now_s + at_s * (1 + 1e-6 * ppm) + paused_s + delay_s,
        )  # fmt: skip
        relation.take(block)
    relation.began_s = time.time() - time.monotonic() + now_s  # type: ignore[attr-defined]
    return relation


@settings(max_examples=8, deadline=None)
@given(st.lists(st.floats(0.0, 0.9), min_size=3, max_size=90))
def test_the_clock_is_that_of_the_least_delayed_samples(delays_s: list[float]) -> None:
    """Also where a backlog of a minute, which a broker kept, comes first."""
    backlog_s = [60.0 - n * SIZE / RATE_HZ for n in range(600)]
    for given_s in (delays_s, backlog_s + delays_s):
        relation = taken(given_s)
        ((from_s, unix_s),) = relation.clock.pieces
        assert from_s == 0.0
        assert unix_s - relation.began_s == pytest.approx(min(given_s), abs=0.01)  # type: ignore[attr-defined]


def test_a_pause_of_unknown_length_and_a_rate_that_is_not_exact_are_followed() -> None:
    relation = taken([0.1] * 200, pauses_s={100: 3600.0})
    assert [from_s for from_s, _ in relation.clock.pieces] == [0.0, 10.0]
    assert np.diff([unix_s for _, unix_s in relation.clock.pieces]) == pytest.approx([3600.0], abs=0.01)
    relation = taken([0.1] * 10_000, ppm=5000.0)  # a thousand seconds, and 5 s
    true_s = relation.began_s + 1e3 * (1 + 5000e-6)  # type: ignore[attr-defined]
    assert relation.clock.unix_s(1e3) == pytest.approx(
        true_s, abs=STEP_S + 2 * 60 * 5000e-6
    )  # it is judged every minute


def test_a_queue_on_the_way_and_known_losses_do_not_redate_a_run() -> None:
    queue = taken([0.01] * 1000 + [3.0] * 1600 + [0.01] * 2000)  # of 160 s, within 460 s
    assert len(queue.clock.pieces) == 1
    relation, now_s = ClockRelation(), time.monotonic()
    for number in range(3000):
        start = 2 * SIZE * number  # every second batch is missing, by the sender's numbers
        at_s, delay_s = (start + SIZE) / RATE_HZ, 2.5 * (number % 3 == 0)
        arrived_s = now_s + at_s + delay_s
        relation.take(LiveBlock(np.zeros((1, SIZE)), ("y",), RATE_HZ, start=start, gap=True, arrived_s=arrived_s))
    assert len(relation.clock.pieces) == 1


def test_a_backlog_that_takes_longer_than_the_first_seconds_is_dated_in_the_end() -> None:
    now_s, relation = time.monotonic(), ClockRelation()
    for n in range(360):  # an hour of samples within 30 s
        arrived_s = now_s + 30.0 * n / 360
        data = np.zeros((1, 1000))
        relation.take(LiveBlock(data, ("y",), RATE_HZ, start=1000 * n, arrived_s=arrived_s))
    for n in range(360, 400):
        arrived_s = now_s + 30.0 + 10.0 * (n + 1 - 360)
        relation.take(LiveBlock(np.zeros((1, 1000)), ("y",), RATE_HZ, start=1000 * n, arrived_s=arrived_s))
    began_s = time.time() - time.monotonic() + now_s + 30.0 - 3600.0
    assert relation.clock.unix_s(60.0) - 60.0 == pytest.approx(began_s, abs=1.0)


def test_a_clock_that_is_set_begins_a_piece_and_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    relation, now_s, real = ClockRelation(), time.monotonic(), time.time
    events: list[Event] = []
    for n in range(30):
        if n == 15:
            monkeypatch.setattr(time, "time", lambda: real() + 7200.0)
        arrived_s = now_s + 10.0 * (n + 1)
        block = LiveBlock(np.zeros((1, 1000)), ("y",), RATE_HZ, start=1000 * n, arrived_s=arrived_s)
        relation.take(block, events.append)
    (event,) = events
    assert event.kind == "computer-clock"
    assert "set by +7200 s" in event.message
    assert np.diff([unix_s for _, unix_s in relation.clock.pieces]) == pytest.approx([7200.0], abs=0.1)


def test_moments_are_clock_time_only_where_the_run_has_a_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    try:
        with moments_by(RunClock([(0.0, 1_790_000_000.0)])):
            assert moment(12.3) == "2026-09-21 16:13:32 CEST"
        assert moment(12.3) == "12.3 s"
    finally:
        monkeypatch.undo()
        time.tzset()


def test_a_live_run_whose_sender_numbers_from_0_is_dated_everywhere_the_same(tmp_path: Path) -> None:
    with TcpPeer(tmp_path) as peer, LiveSession(tmp_path, peer) as session:
        peer.wait_ready()
        before_s = time.time()
        for batch in [*batches(100, first=0), *batches(100, first=5050)]:
            peer.send(batch)
        until(lambda: any(event.kind == "gap" for event in session.events()), "the gap to be recorded")
        after_s = time.time()
    run = RunRecord.open(session.run)
    ((_, unix_s),) = RunClock.of(run.summary).pieces
    gap = next(event for event in run.events() if event.kind == "gap")
    assert before_s - 2.6 <= unix_s + gap.time_s <= after_s
    shown = f"{datetime.fromtimestamp(unix_s + gap.time_s).astimezone():%Y-%m-%d %H:%M:%S %Z}"
    assert query(run, "SELECT moment FROM events WHERE kind = 'gap'", 1).rows == [(shown,)]
    state = State("axis", 0)
    RunFeed(session.run).fill(state)
    assert state.span()["clock"] == [(0.0, unix_s)]
    assert livebode("report", session.run).code == 0
    assert shown in (session.run / "report.html").read_text()


def dated_run(folder: Path, first_s: float, **source: object) -> RunRecord:
    """A run on a recording whose time column begins at this second."""
    folder.mkdir()
    columns = signals(1000)
    log = write_csv(folder / "log.csv", {"t": first_s + np.arange(1000) / 1000, **{n: columns[n] for n in "wuy"}})
    data = {
        "source": {"log": str(log)} | source,
        "signals": {"output": "y", "input": "u", "excitation": "w"},
        "lines": {"frequencies": "50,100,200", "window": 100},
    }
    return RunRecord.open(run(Axis.of(data, "test"), Destination(folder / "run", lambda *_: None)).directory)


@pytest.mark.parametrize(
    ("first_s", "declared", "kind"),
    [
        (1_790_000_000.0, None, "utc"), (5.0, None, "relative"), (9e7, None, "relative"),
        (1_790_000_000.0, "relative", "relative"), (5.0, "utc", "utc"),
    ],
)  # fmt: skip
def test_a_recording_is_dated_by_its_declared_clock_or_else_by_its_first_time(
    tmp_path: Path, first_s: float, declared: str | None, kind: str
) -> None:
    found = dated_run(tmp_path / "a", first_s, **({} if declared is None else {"clock": declared}))
    newest_s = found.responses().time_s[-1]
    assert first_s < newest_s < first_s + 1.0
    assert (found.found["clock"], found.clock.utc) == (kind, kind == "utc")
    with moments_by(found.clock):
        assert moment(newest_s) == (date_and_time(newest_s) if kind == "utc" else f"{newest_s:.1f} s")
        assert moment_of_start() == ""
    assert "clock" not in found.summary


def test_a_run_without_a_recorded_kind_is_dated_by_its_first_response(tmp_path: Path) -> None:
    for name, first_s, utc in (("dated", 1_790_000_000.0, True), ("relative", 5.0, False)):
        path = dated_run(tmp_path / name, first_s).path
        older = json.loads((path / RUN).read_text())
        del older["found"]["clock"], older["crc32"]
        (path / RUN).write_bytes(to_document(older))
        assert RunRecord.open(path).clock.utc == utc


def test_a_kind_of_clock_without_a_time_column_or_for_a_live_source_is_rejected(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "log.csv", {name: values for name, values in signals(200).items() if name != "t"})
    with refused(UsageError, "conflict", argument="clock"):
        open_log(path, rate_hz=1000, clock="utc")
    assert open_log(path, rate_hz=1000, clock="relative").clock_kind == "relative"
    with refused(ConfigError, "key-unused", key="source.clock"):
        make_source(SourceSettings(url="udp://127.0.0.1:5000", clock="utc"))
    with pytest.raises(
        ConfigError, match=r"source\.clock = 'local' is not usable: input should be 'utc' or 'relative'"
    ):
        Axis.of({"source": {"log": "a", "clock": "local"}, "signals": {"output": "y"}}, "axis.toml")
