"""Events of one cause are one group: in the record at once, none altered, and a flood of them is counted."""

from __future__ import annotations

import json
import shutil
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.configuration import RecordSection
from livebode.core import Block, Channel, Event, Lines
from livebode.dashboard.notices import EventCauses, event_id
from livebode.estimation import Settings, Tracker
from livebode.records import RunRecord, each_event, event_counts, query
from livebode.records.grouped_events import event_rows
from livebode.runtime import Document
from livebode.runtime.run_counts import AT_ONCE, CAUSES, EXACT_MAX, QUIET_S, REPORT_S, EventGroups
from livebode_reports.events import EventSummary
from tests.support.runs import record

RATE_HZ, WINDOW = 1000.0, 50
NAMES = ("w", "u", "y")
happened = st.lists(
    st.tuples(st.sampled_from(["gap", "loss", "fit-failed", "change", "acknowledged"]), st.integers(0, 90)), max_size=60
)


def events_of(steps: list[tuple[str, int]]) -> list[Event]:
    found, time_s = [], 0.0
    for kind, later_s in steps:
        time_s += later_s
        found.append(Event(kind, round(1000 * time_s), time_s, f"{kind} at {time_s:g}", {"missing_samples": later_s}))
    return found


def reported(groups: EventGroups, events: list[Event]) -> list[Event]:
    return [one for event in events for one in groups.take(event)] + groups.finish()


def counted(events: Sequence[Event]) -> Counter[str]:
    return sum(map(event_counts, events), Counter())


@settings(max_examples=100, deadline=None)
@given(happened)
def test_every_event_is_reported_exactly_once_and_in_the_order_of_its_cause(steps: list[tuple[str, int]]) -> None:
    events = events_of(steps)
    found = [each for one in reported(EventGroups(), events) for each in each_event(one)]
    for cause in {CAUSES.get(event.kind, event.kind) for event in events}:
        of_cause = [[e for e in those if CAUSES.get(e.kind, e.kind) == cause] for those in (found, events)]
        assert of_cause[0] == of_cause[1]
    assert len(found) == len(events)


@settings(max_examples=50, deadline=None)
@given(happened, st.integers(0, 60))
def test_a_run_that_is_continued_reports_the_same(steps: list[tuple[str, int]], at: int) -> None:
    events = events_of(steps)
    first, second = EventGroups(), EventGroups()
    found = [one for event in events[:at] for one in first.take(event)]
    second.restore(first.snapshot())
    assert found + reported(second, events[at:]) == reported(EventGroups(), events)


@settings(max_examples=15, deadline=None)
@given(happened)
def test_reported_and_waiting_events_are_together_all_events_at_any_moment(steps: list[tuple[str, int]]) -> None:
    groups, lines, events = EventGroups(), list[Event](), events_of(steps)
    for number, event in enumerate(events, start=1):
        lines += groups.take(event)
        assert counted([*lines, *groups.waiting()]) == Counter(e.kind for e in events[:number])


def test_a_thousand_events_of_one_cause_are_one_group_and_each_is_exact() -> None:
    events = [Event("loss", n, 0.25 * n, "a sample did not come") for n in range(1065)]
    found = reported(EventGroups(), events)
    assert {event.details["group"] for event in found} == {"loss@0"}
    assert len(found) <= AT_ONCE + 266 / REPORT_S + 1
    assert [one for event in found for one in each_event(event)] == events
    last = found[-1].details
    assert (last["count"], last["first_s"], last["last_s"]) == (1065, 0.0, 266.0)


def test_the_count_of_a_single_event_is_not_changed_by_grouping() -> None:
    event = Event("phase-slips", 5, 0.1, "two leaps", {"count": 2, "slips": [[5, 1], [9, 1]]})
    assert [one for line in reported(EventGroups(), [event]) for one in each_event(line)] == [event]


def test_a_flood_is_counted_and_its_lines_do_not_grow_with_it() -> None:
    lengths = []
    for rate_hz in (100, 1000):
        events = [Event("spike", n, n / rate_hz, "a spike", {"channel": "u"}) for n in range(20 * rate_hz)]
        found = reported(EventGroups(), events)
        assert counted(found) == {"spike": len(events)}
        exact = [one for event in found for one in each_event(event)]
        assert exact[:1000] == events[:1000]
        assert exact[-1] == events[-1]
        assert len(exact) <= EXACT_MAX + 20 + len(found)
        lengths.append(len(json.dumps([vars(event) for event in found])))
    assert lengths[1] < 1.1 * lengths[0]


def test_a_row_is_of_its_own_kind_where_its_newest_events_were_only_counted() -> None:
    steps = ["loss", "gap", *["loss"] * 1200, *["gap", "loss"] * 50]
    events = [Event(kind, n, n / 1e3, kind) for n, kind in enumerate(steps)]
    for lines in (reported(EventGroups(), events), reported(EventGroups(), events)[-1:]):
        rows = event_rows(lines)
        assert sorted(row.newest.kind for row in rows) == ["gap", "loss"]
        assert {row.newest.kind: row.count for row in rows} == counted(lines)
        assert all(row.newest.message in (row.newest.kind, "counted") for row in rows if row.newest.kind == "gap")


def test_a_cause_that_was_silent_begins_another_group() -> None:
    groups = EventGroups()
    names = [groups.take(Event("gap", n, s, ""))[0].details["group"] for n, s in ((1, 0.0), (2, QUIET_S + 1))]
    assert names == ["loss@1", "loss@2"]


def test_the_first_event_of_each_kind_is_reported_at_once_in_a_flood() -> None:
    groups = EventGroups()
    kinds = ["loss"] * 40 + ["gap", "loss", "overflow"]
    found = [(n, one.kind) for n, kind in enumerate(kinds) for one in groups.take(Event(kind, n, 0.0, ""))]
    assert found[AT_ONCE:] == [(40, "gap"), (42, "overflow")]


def test_a_change_of_state_is_reported_within_a_second_of_the_flood_around_it() -> None:
    groups, found = EventGroups(), []
    for tenth in range(400):
        kind = {200: "restart", 300: "disconnected"}.get(tenth, "connected")
        for one in groups.take(Event(kind, tenth, tenth / 10, kind)):
            found += [(tenth, each.kind) for each in each_event(one) if each.kind != "connected"]
    assert [kind for _, kind in found] == ["restart", "disconnected"]
    assert all(0 <= tenth - at <= 11 for (tenth, _), at in zip(found, (200, 300)))


def test_a_change_of_state_of_a_silent_machine_is_reported_within_a_second_and_no_faster() -> None:
    groups, found = EventGroups(), []
    for kind in ["connected", "disconnected"] * AT_ONCE:
        groups.take(Event(kind, 100, 0.1, kind))
    for tenth in range(200):  # of a second, while the machine's time does not pass
        if tenth in (0, 51, 52, 110):
            groups.take(Event("disconnected" if tenth < 110 else "connected", 100, 0.1, str(tenth)))
        found += [(tenth, each.message) for one in groups.due_while_silent(tenth / 10) for each in each_event(one)]
        assert groups.due(0.1) == []
    assert [message for _, message in found[-4:]] == ["0", "51", "52", "110"]
    assert [tenth for tenth, _ in found[-4:]] == [10, 51, 61, 161]


def test_a_link_that_flaps_adds_a_line_a_second_at_most() -> None:
    groups, found = EventGroups(), []
    for n in range(2400):
        found += groups.take(Event("disconnected" if n % 2 else "connected", n, n / 8, ""))
    assert AT_ONCE < len(found) <= AT_ONCE + 300


class Page:
    """Keeps what a dashboard would show."""

    def __init__(self) -> None:
        self.notices = EventCauses()

    def __call__(self, document: Document) -> None:
        if isinstance(document, Event):
            self.notices.add(document)


class Gaps:
    """Sends a gap every 50 samples for 12 s, and copies the run at 10 s as a kill would leave it."""

    channels = tuple(Channel(name, "") for name in NAMES)
    samples = 12_000

    def __init__(self, run: Path) -> None:
        self.run, self.killed = run, run.with_name("killed")

    def blocks(self, _: Sequence[str]) -> Iterator[Block]:
        data = np.random.default_rng(0).standard_normal((3, 40))
        for start in range(0, self.samples, 50):
            if start == 10_000:
                shutil.copytree(self.run, self.killed, ignore=shutil.ignore_patterns(".*.partial"))  # being moved
            yield Block(data, NAMES, RATE_HZ, start=start, gap=start > 0)


def test_the_record_of_a_killed_run_contains_every_event_until_a_second_before(tmp_path: Path) -> None:
    machine, page = Gaps(tmp_path / "run"), Page()
    lines = Lines((4, 7), WINDOW, RATE_HZ)
    record(
        machine, Tracker(Settings(lines=lines, output="y", input="u", excitation="w", hop=25)), machine.run,
        segments=RecordSection(segment_s=5.0), again=False, subscribers=[page],
    )  # fmt: skip
    killed, whole = RunRecord.open(machine.killed), RunRecord.open(machine.run)
    every = [one.sample for event in whole.events() for one in each_event(event) if one.kind == "gap"]
    reported_event = [one.sample for event in killed.events() for one in each_event(event) if one.kind == "gap"]
    assert len(every) > 3 * AT_ONCE
    assert reported_event == every[: len(reported_event)]
    assert len(reported_event) >= sum(sample < 9_000 for sample in every)
    (row,) = [row for row in event_rows(killed.events()) if row.newest.kind == "gap"]
    assert (row.count, row.first_s) == (len(reported_event), every[0] / RATE_HZ)
    assert row.last_s >= 9.0 - 2 * WINDOW / RATE_HZ
    assert EventSummary.of(killed.events()).count("gap") == len(reported_event)
    found = query(killed, "SELECT count, last_s FROM events WHERE kind = 'gap'", 10)
    assert found.rows == [(len(reported_event), row.last_s)]
    assert query(killed, "SELECT count(*) FROM single_events WHERE kind = 'gap'", 1).rows == [(len(reported_event),)]
    assert len((machine.run / "events.jsonl").read_text().splitlines()) < len(every) / 3
    (shown,) = [notice for notice in page.notices.since(0) if notice["cause"] == "loss"]
    ids = [event_id(event) for event in whole.events() if event.kind == "gap"]
    assert (shown["id"], shown["count"]) == (ids[-1], len(every))
    assert all(page.notices.of(key) for key in ids)
