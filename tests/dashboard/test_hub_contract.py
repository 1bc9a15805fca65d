"""What stands between the tracker and the browser: it waits for nobody, its memory is bounded, its frames are exact."""

from __future__ import annotations

import struct
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.analysis import Overview
from livebode.configuration import LoopSection
from livebode.core import CIRCLE_FACTOR, Block, Event, Lines, Responses, ServerError, widened
from livebode.dashboard import Hub, Past, Quantities
from livebode.dashboard.alarm_requests import acknowledgement
from livebode.dashboard.board import verdict
from livebode.dashboard.frames import KINDS, frame
from livebode.dashboard.hub import EVENTS_MAX, ITEMS_MAX, VALUES_MAX
from livebode.dashboard.notices import CAUSES_MAX, EventCauses, event_id
from livebode.dashboard.quantities import QUANTITIES
from livebode.dashboard.recent import POINTS_MAX, RECORDED_VALUES_MAX, ModelTrend, RecentResponses, TrendRows
from livebode.dashboard.state import State
from livebode.runtime import ClockSet, RunControl, RunEnded, RunStarted, RunStep, TrackerResults
from livebode.simulation.two_mass_loop import RATE_HZ
from livebode.sources.live import LiveBlock
from tests.support.dashboards import LINES, LOOP, Watched, begin
from tests.support.errors import refused
from tests.support.responses import any_responses, made


def decoded(data: bytes) -> list[dict[str, object]]:
    """Frames as frames.py describes them, read by NumPy."""
    found, at = [], 0
    while at < len(data):
        magic, version, kind, quantity, axis, rows, columns = struct.unpack_from("<4sBBBBII", data, at)
        assert (magic, version) == (b"LBCV", 3)
        next_at = at + 16
        one: dict[str, object] = {"kind": KINDS[kind], "quantity": QUANTITIES[quantity], "axis": axis}
        for name in ("time_s", "schedule", "dof"):
            one[name] = np.frombuffer(data, "<f8", rows, next_at)
            next_at += 8 * rows
        names = ["magnitude", "phase"] + ["reach", "coherence"] * (KINDS[kind] != "model")
        for name in names + ["noise", "distorted"] * (KINDS[kind] in ("newest", "moment")):
            one[name] = np.frombuffer(data, "<f4", rows * columns, next_at).reshape(rows, columns)
            next_at += 4 * rows * columns
        found.append(one)
        at = -(-next_at // 8) * 8
    assert at == len(data)
    return found


@settings(max_examples=60, deadline=None)
@given(any_responses())
def test_frames_hold_the_responses(responses: Responses) -> None:
    first, second = decoded(frame("rows", 3, responses) + frame("newest", 0, responses[-1:]))
    assert (first["kind"], first["axis"], second["kind"]) == ("rows", 3, "newest")
    use, size = responses.valid & np.isfinite(responses.value), np.abs(responses.value)
    with np.errstate(invalid="ignore"):
        others = np.nan_to_num(responses.distortion) ** 2 + np.nan_to_num(responses.variation) ** 2
        alone = np.sqrt(np.maximum(responses.sigma**2 - others, 0.0))
        steady = np.sqrt(alone**2 + np.nan_to_num(responses.distortion) ** 2)
        parts = {
            name: np.where(use, widened(part, responses.dof[:, np.newaxis], CIRCLE_FACTOR) / size, np.nan)
            for name, part in (("noise", alone), ("distorted", steady))
        }
        expected = {
            "magnitude": np.where(use, responses.magnitude_db, np.nan),
            "reach": np.where(use, responses.bound() / size, np.nan),
            "coherence": np.where(use, responses.coherence, np.nan),
        }
    for name, values in expected.items():
        assert np.allclose(first[name], values, rtol=1e-6, atol=1e-5, equal_nan=True), name
    for name, values in parts.items():  # of one response only: the others would have half as many bytes again
        assert name not in first
        assert np.allclose(second[name], values[-1:], rtol=1e-6, atol=1e-5, equal_nan=True), name
    turned = np.exp(1j * np.radians(np.asarray(first["phase"], dtype=float)))
    assert np.allclose(turned[use], responses.value[use] / np.abs(responses.value[use]), atol=1e-4)
    assert np.array_equal(first["time_s"], responses.time_s)
    assert np.array_equal(first["dof"], responses.dof)


@pytest.mark.parametrize("own", QUANTITIES)
@pytest.mark.parametrize("expected", QUANTITIES)
def test_every_quantity_from_every_other(own: str, expected: str) -> None:
    """There and back is the same, and sigma goes with the slope, which a small step shows."""
    rng = np.random.default_rng(3)
    loop = LoopSection.model_validate(LOOP).build(RATE_HZ)
    quantities = Quantities(own, "rad/s", LINES, loop)  # type: ignore[arg-type]
    value = rng.normal(size=(2, len(LINES))) + 1j * rng.normal(size=(2, len(LINES)))
    responses = made(2, LINES, hole=0.0)
    responses = Responses(**{**vars(responses), "value": value, "quantity": own})
    there = quantities.of_responses(responses, expected)  # type: ignore[arg-type]
    back = Quantities(expected, "", LINES, loop).of_responses(there, own)  # type: ignore[arg-type]
    assert np.allclose(back.value, value)
    assert np.allclose(back.sigma, responses.sigma)
    step = 1e-7
    moved = Responses(**{**vars(responses), "value": value + step})
    slope = np.abs(quantities.of_responses(moved, expected).value - there.value) / step  # type: ignore[arg-type]
    assert np.allclose(there.sigma, responses.sigma * slope, rtol=1e-4)


def test_responses_of_a_run_before_are_known() -> None:
    quantities = Quantities("plant", "rad/s", LINES, None)
    assert quantities.fit(made(1, LINES))
    assert not quantities.fit(made(1, Lines(LINES.bins[1:], LINES.window, RATE_HZ)))
    assert not Quantities("sensitivity", "", LINES, None).fit(made(1, LINES))


def test_a_quantity_that_is_not_available_has_a_reason() -> None:
    quantities = Quantities("plant", "rad/s", LINES, None)
    assert quantities.why_not("plant") == ""
    assert "describe its controllers" in quantities.why_not("open loop")
    with refused(ServerError, "quantity-unavailable", quantity="sensitivity"):
        quantities.of_responses(made(1, LINES), "sensitivity")


def test_memory_is_bounded_and_losses_are_counted_when_nobody_reads() -> None:
    """A dashboard that never takes anything: the newest is kept, the rest given up, and counted."""
    hub, many = Hub("axis"), made(64, LINES)
    batches = 3 * VALUES_MAX // many.value.size
    for _ in range(batches):
        hub(many)
        hub(Event("gap", 0, 0.0, "a gap"))
    assert hub._values <= VALUES_MAX
    items = hub.drain()
    assert sum(isinstance(item, Responses) for item in items) + hub.given_up == batches
    assert sum(isinstance(item, Event) for item in items) <= EVENTS_MAX
    assert hub.drain() == []
    control = RunControl()
    hub(RunStarted(Path("run"), {}, control, Overview()))
    assert all(hub.record(Event("acknowledged", 0, 0.0, "seen")) for _ in range(64))
    assert not hub.record(Event("acknowledged", 0, 0.0, "seen"))
    assert len(control.take_recorded()) == 64
    hub(RunEnded({}))
    assert not hub.record(Event("acknowledged", 0, 0.0, "seen")), "a record that is closed takes nothing"


def test_taking_and_publishing_at_once_loses_nothing() -> None:
    hub, one, seen = Hub("axis"), made(1, LINES), 0
    writing = threading.Thread(target=lambda: [hub(one) for _ in range(20_000)])
    writing.start()
    while writing.is_alive():
        seen += len(hub.drain())
    assert seen + len(hub.drain()) + hub.given_up == 20_000


def tracked(block: Block) -> TrackerResults:
    return TrackerResults(block, block.stop, None)


def test_delay_is_from_arrival_to_published() -> None:
    hub = Hub("axis")
    hub(tracked(LiveBlock(np.zeros((1, 40)), ("y",), 4000.0, arrived_s=time.monotonic() - 0.25)))
    hub(tracked(Block(np.zeros((1, 40)), ("y",), 4000.0, start=40, gap=True)))
    assert list(hub.delays_s) == [pytest.approx(0.25, abs=0.2)]
    assert (hub.samples, hub.gaps) == (80, 1)


def test_the_mailbox_is_bounded_for_batches_of_one_response() -> None:
    hub, one = Hub("axis"), made(1, LINES)
    for _ in range(ITEMS_MAX + 100):
        hub(one)
    assert len(hub.drain()) == ITEMS_MAX
    assert hub.given_up == 100


@pytest.mark.parametrize("size", [1, 7, 500])
def test_recent_responses_of_many_lines_are_fewer(size: int) -> None:
    lines = Lines(tuple(range(1, 102)), 300, 1000.0)
    recent, rows = RecentResponses(RECORDED_VALUES_MAX), made(500, lines, hop=50)
    for first in range(0, 500, size):
        recent.add(rows[first : first + size])
    kept = recent.all()
    assert kept is not None
    assert kept.equals(rows[-(RECORDED_VALUES_MAX // 101) :])
    held = sum(len(part) for part in recent._parts)
    assert held <= 1.25 * len(kept)


def test_recent_responses_are_the_newest_and_thinned() -> None:
    recent, hop = RecentResponses(), 20
    for start in range(0, 40_000, 500):
        rows = made(500, Lines((2, 3), 60, 1000.0), hop=hop, seed=start)
        shift = start * hop
        recent.add(Responses(**{**vars(rows), "time_s": rows.time_s + shift / 1000}))
    kept = recent.all()
    assert kept is not None
    assert len(kept) == 2400
    assert kept.time_s[-1] == pytest.approx(800, abs=0.1)
    assert np.all(np.diff(np.floor(kept.time_s / 0.05)) >= 1)
    assert recent.newest(5).time_s.tolist() == kept.time_s[-5:].tolist()  # type: ignore[union-attr]


@given(st.lists(st.integers(1, 700), min_size=1, max_size=12))
@settings(max_examples=25, deadline=None)
def test_a_trend_is_evenly_thinned_however_it_came(sizes: list[int]) -> None:
    trend, at = ModelTrend("two-mass", ["Js", "mL"], ["kg m²", "kg"]), 0
    for size in sizes:
        time_s = np.arange(at, at + size, dtype=float)
        value = np.stack([2 * time_s, 3 * time_s], axis=1)
        trend.add(TrendRows(time_s, time_s, value, value, np.full(size, "ok")))
        at += size
    assert len(trend._rows) <= 16
    kept = trend.rows()
    assert len(kept) <= POINTS_MAX
    assert len(set(np.diff(kept.time_s))) <= 1
    assert kept.time_s[0] == 0
    assert np.array_equal(kept.value[:, 1], 3 * kept.time_s)
    assert trend.newest is not None
    assert [(one["name"], one["value"]) for one in trend.plain(trend.newest)] == [
        ("Js", [2.0 * (at - 1)]), ("mL", [3.0 * (at - 1)]),
    ]  # fmt: skip


@pytest.mark.parametrize("by_person", [False, True])
def test_a_run_that_is_being_completed_is_not_silent(tmp_path: Path, by_person: bool) -> None:
    """While pictures are drawn at the end, no samples come, and nobody has to look."""
    hub = Hub("axis")
    state = State("axis", 0, hub)
    begin(hub, tmp_path, LINES)
    hub(TrackerResults(Block(np.zeros((1, 400)), ("u",), RATE_HZ, start=0), 400, None))
    hub.followed_s -= 60
    state.refresh()
    assert (state.silence()[1], verdict(state).word) == (True, "silent")
    if by_person:
        assert hub.control is not None
        hub.control.end()
    else:
        hub(RunStep("ending"))
    hub.followed_s -= 60
    assert (state.silence()[1], verdict(state).word, state.health()["ending"]) == (False, "no-baseline", True)


def test_notices_are_bounded_and_known_again() -> None:
    notices = EventCauses()
    for i in range(CAUSES_MAX + 500):
        notices.add(Event("change", i, float(i), "changed", {"what": f"part {i}"}))
    assert len(notices.since(0)) == CAUSES_MAX
    notices = EventCauses()
    event = Event("change", 7, 1.0, "changed")
    notices.add(event)
    notices.add(event)
    assert notices.counts["change"] == 1
    before = notices.version
    notices.add(Event("acknowledged", 9, 2.0, "seen", {"event": event_id(event), "count": 1}))
    assert [(n["id"], n["count"], n["seen"]) for n in notices.since(before)] == [(event_id(event), 1, 1)]
    notices.add(Event("acknowledged", 9, 2.0, "seen", {"event": "unknown"}))


def test_events_of_one_cause_are_one_notice_and_acknowledged_up_to_the_one_that_was_seen() -> None:
    notices = EventCauses()
    events = [Event("change", i, float(i), f"stiffness less, {i}", {"what": "stiffness"}) for i in range(1000)]
    for event in events:
        notices.add(event)
    notices.add(Event("change", 5, 5.0, "inertia more", {"what": "inertia"}))
    stiffness, inertia = notices.since(0)
    assert (stiffness["count"], stiffness["first_s"], stiffness["last_s"]) == (1000, 0.0, 999.0)
    assert stiffness["message"] == "stiffness less, 999"
    assert inertia["count"] == 1
    notice, count = notices.of(event_id(events[900]))  # type: ignore[misc]
    notices.add(acknowledgement(notice, event_id(events[900]), count, 1000, 10.0))
    assert [n["seen"] for n in notices.since(0)] == [901, 0]
    assert notices.changed == {"stiffness", "inertia"}
    notices.add(Event("change-cleared", 1001, 11.0, "stiffness as learned", {"what": "stiffness"}))
    assert notices.changed == {"inertia"}


def test_groups_that_the_run_made_are_counted_by_what_they_say() -> None:
    """Their repeats share lines; after a pause the same cause begins another group."""
    notices = EventCauses()
    for sample, name, count in ((0, "loss@0", 1), (10, "loss@0", 2), (40, "loss@0", 8), (900, "loss@900", 1)):
        notices.add(Event("gap", sample, sample / 10, "a gap", {"group": name, "count": count, "first_s": 0.0}))
    notices.add(Event("overflow", 950, 95.0, "dropped", {"group": "loss@900", "count": 2, "first_s": 90.0}))
    (notice,) = notices.since(0)
    assert (notice["cause"], notice["kind"], notice["count"], notice["last_s"]) == ("loss", "overflow", 10, 95.0)


def test_moments_have_a_clock_where_a_machine_sends(tmp_path: Path) -> None:
    found = {
        "bins": list(LINES.bins),
        "quiet_bins": [],
        "window": LINES.window,
        "rate_hz": RATE_HZ,
        "quantity": "plant",
    }
    summary = {"found": found | {"unit": ""}, "configuration": {}}
    hub = Hub("axis")
    state = State("axis", 0, hub)
    for pieces in ([], [(0.0, 1.79e9), (60.0, 1.79e9 + 5)]):
        hub(RunStarted(tmp_path, dict(summary), RunControl(), Overview()))
        hub(ClockSet(tuple(pieces)))
        state.refresh()
        assert state.span()["clock"] == pieces
    for clock, times in (({"clock": "utc"}, [(0.0, 0.0)]), ({"clock": "relative"}, []), ({}, [(0.0, 0.0)])):
        hub(RunStarted(tmp_path, summary | {"found": summary["found"] | clock}, RunControl(), Overview()))
        dated = made(5, LINES, hole=0.0)
        hub(Responses(**{**vars(dated), "time_s": dated.time_s + 1.79e9}))
        state.refresh()
        assert state.span()["clock"] == times  # without a stated kind: an older version wrote it


def test_a_continued_run_is_not_mixed_with_the_previous_one(tmp_path: Path) -> None:
    """In one piece a run appears when it is done; until then an older one in its place is not read."""
    old = tmp_path / "run"
    with Watched(old) as watched:
        watched.go(4000)
    hub = Hub("axis")
    state = State("axis", 0, hub)
    summary = dict(watched.record().summary)
    summary.pop("record")
    overview = Overview()
    hub(RunStarted(old, summary, RunControl(), overview))
    state.refresh()
    with refused(ServerError, "not-begun"):
        Past.of(state).between(0, 1, 10)
    rows = watched.record().responses()[:5]
    overview.add(rows)
    hub(rows)
    state.refresh()
    assert len(Past.of(state).between(-10, 10, 1000)) == 5
    hub(RunEnded(summary))
    state.refresh()
    assert len(next(Past.of(state).all_between(-10, 10))) > 50


def test_an_axis_that_begins_a_new_run_may_have_other_lines(tmp_path: Path) -> None:
    hub = Hub("axis")
    state = State("axis", 0, hub)
    for lines in (LINES, Lines((2, 5), 60, 1000.0)):
        found = {"bins": list(lines.bins), "quiet_bins": [], "window": lines.window, "rate_hz": lines.rate_hz}
        hub(
            RunStarted(
                tmp_path,
                {"found": found | {"quantity": "plant", "unit": ""}, "configuration": {}},
                RunControl(),
                Overview(),
            )
        )
        hub(made(30, lines, hole=0.0, unit=""))
        state.refresh()
        assert state.facts()["frequency_hz"] == lines.frequency_hz.tolist()
        assert decoded(state.newest_frames("plant"))[0]["magnitude"].shape == (1, len(lines))  # type: ignore[attr-defined]
        hub(made(1, lines, hole=0.0, unit=""))  # that nobody takes before the next run begins
    assert state.runs == 2


def test_a_span_reads_only_its_segments(tmp_path: Path) -> None:
    with Watched(tmp_path / "run") as watched:
        watched.go(12_000)
    run = watched.record()
    whole = run.responses()
    found = Responses.join(list(run.between(1.2, 1.4)))
    within = (whole.time_s >= 1.2) & (whole.time_s <= 1.4)
    assert found.sample.tolist() == whole.sample[within].tolist()
    assert list(run.between(50, 60)) == []
    first = next(s for s in run.segments if s.table == "responses")
    (run.path / first.name).write_bytes(b"damaged")
    assert Responses.join(list(run.between(first.last_s + 0.01, 9))).sample[-1] == whole.sample[-1]
