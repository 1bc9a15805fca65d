"""Events of one cause are one group, reported in growing steps; none of them is lost or altered."""

from __future__ import annotations

import json
import math

from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.nouns import Event
from livebode.session.event_groups import CAUSES, QUIET_S, REPEATS_MAX, EventGroups, each_event

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
    second.load(json.loads(json.dumps(first.state())))
    assert found + reported(second, events[at:]) == reported(EventGroups(), events)


def test_a_thousand_events_of_one_cause_are_one_group_with_few_reports() -> None:
    events = [Event("loss", n, 0.25 * n, "a sample did not come") for n in range(1065)]
    found = reported(EventGroups(), events)
    assert {event.details["group"] for event in found} == {"loss@0"}
    assert len(found) <= math.ceil(math.log2(1065)) + 1065 / REPEATS_MAX + 1
    assert found[-1].details["count"] == 1065
    assert (found[-1].details["first_s"], found[-1].details["last_s"]) == (0.0, 266.0)


def test_a_cause_that_was_silent_begins_another_group() -> None:
    groups = EventGroups()
    names = [groups.take(Event("gap", n, s, ""))[0].details["group"] for n, s in ((1, 0.0), (2, QUIET_S + 1))]
    assert names == ["loss@1", "loss@2"]


def test_what_waits_is_reported_when_its_cause_ends() -> None:
    groups = EventGroups()
    for n in range(3):
        groups.take(Event("spike", n, n / 10, "a spike"))
    assert groups.due(30.0) == []
    (last,) = groups.due(QUIET_S + 1.0)
    assert (last.details["count"], last.sample) == (3, 2)


def test_the_first_event_of_each_kind_is_reported_at_once() -> None:
    groups = EventGroups()
    kinds = ["loss", "gap", "loss", "overflow"]
    found = [one.kind for n, kind in enumerate(kinds) for one in groups.take(Event(kind, n, 0.0, ""))]
    assert found == ["loss", "gap", "overflow"]


def test_a_change_of_state_is_reported_at_once_among_what_was_left_out() -> None:
    groups, found = EventGroups(), []
    for second in range(0, 240, 10):
        kind = {20: "backlog", 80: "backlog-cleared", 150: "backlog"}.get(second, "thinned")
        found += [(second, one.kind) for one in groups.take(Event(kind, second, float(second), kind))]
    assert [one for one in found if one[1] != "thinned"] == [(20, "backlog"), (80, "backlog-cleared"), (150, "backlog")]
