"""States of alarms, compared with definitions over everything that happened so far; a record gives the same states."""

from __future__ import annotations

import json
from dataclasses import asdict

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Event, LivebodeError
from livebode.dashboard import NAME_MAX, TEXT_MAX, AlarmShelf, alarm_request
from livebode.dashboard.alarm import CHATTER_S, CHATTER_TIMES, ROWS_MAX
from livebode.dashboard.alarm_requests import acknowledgement, shelving, unshelving
from livebode.dashboard.notices import CAUSES_MAX, EventCauses, event_id
from livebode.monitoring import ALARMS, RETURNS, SOURCE
from livebode.records.segments.json_lines import from_line, to_line
from livebode.runtime import ENDED, SUPPRESSED

CAUSES = {"change": "change: stiffness", "gap": "gap", "roles-doubtful": "roles-doubtful"}
SHELF_S = 40.0
Step = tuple[str, str]  # what happens, to which alarm

steps = st.lists(
    st.tuples(
        st.sampled_from(
            ["raise", "return", "acknowledge", "acknowledge first", "shelve", "unshelve", SUPPRESSED, ENDED]
        ),
        st.sampled_from(sorted(CAUSES)),
    ),
    max_size=40,
)


def expected(done: list[Step], kind: str, now_s: float) -> str | None:
    """State of an alarm by its definition, from all steps so far; step i happens at 10 s · i."""
    own = [(i, what) for i, (what, of) in enumerate(done) if of == kind]
    raises = [i for i, what in own if what == "raise"]
    if not raises:
        return None
    last = raises[-1]
    # An acknowledgement counts if it is of the last raise.
    seen = any(
        i > last and (what == "acknowledge" or (what == "acknowledge first" and len(raises) == 1)) for i, what in own
    )
    returned = any(i > last and what == "return" for i, what in own)
    active = {"change": not returned, "gap": False, "roles-doubtful": not seen}[kind]
    state = ("acknowledged" if seen else "unacknowledged") if active else ("normal" if seen else "returned")
    shelves = [(i, what) for i, what in own if what in ("shelve", "unshelve") and i > raises[0]]
    if shelves and shelves[-1][1] == "shelve" and now_s < 10.0 * shelves[-1][0] + SHELF_S:
        return "shelved"
    machine = [what for what, _ in done if what in (SUPPRESSED, ENDED)]
    return "suppressed" if active and machine and machine[-1] == SUPPRESSED else state


def event_of(step: Step, at: int, notices: EventCauses, first: dict[str, str]) -> Event | None:
    """The event of a step; None if there is nothing to act on."""
    what, kind = step
    if what in (SUPPRESSED, ENDED):
        return Event(what, at, 10.0 * at, f"{what} {at}", {"channel": "enabled"})
    time_s, details = 10.0 * at, {"what": "stiffness"} if kind == "change" else {}
    if what == "raise":
        event = Event(kind, at, time_s, f"{kind} {at}", details)
        first.setdefault(kind, event_id(event))
        return event
    if what == "return":
        return Event("change-cleared", at, time_s, f"as before {at}", details) if kind == "change" else None
    notice = notices.named(CAUSES[kind])
    if notice is None or kind not in first:
        return None
    if what.startswith("acknowledge"):
        key = first[kind] if what.endswith("first") else notice.id
        found = notices.of(key)
        assert found is not None
        return acknowledgement(*found[:1], key, found[1], at, time_s, "Ann")
    if what == "shelve":
        return shelving(notice.cause, AlarmShelf("Ann", time_s + SHELF_S, "test"), at, time_s, notice)
    return unshelving(notice.cause, at, time_s, notice, "Ann")


@settings(max_examples=150, deadline=None)
@given(steps)
def test_states_are_those_of_the_definition_and_of_a_record_that_is_read_again(chosen: list[Step]) -> None:
    now = [0.0]
    notices, record, done, first = EventCauses(lambda: now[0]), [], [], {}
    for i, step in enumerate(chosen):
        now[0] = 10.0 * i
        event = event_of(step, i, notices, first)
        done.append(step)
        if event is not None:
            notices.add(event)
            record.append(Event(**from_line(to_line(asdict(event)))))
        for kind, cause in CAUSES.items():
            notice = notices.named(cause)
            assert (None if notice is None else notices.state(notice)) == expected(done, kind, now[0]), (kind, done)
    again = EventCauses(lambda: now[0])
    for event in [*record, *(one for one in record if one.kind in CAUSES)]:  # what was read is not counted twice
        again.add(event)
    assert [n | {"changed": 0} for n in again.since(0)] == [n | {"changed": 0} for n in notices.since(0)]


def test_an_alarm_of_a_machine_that_is_not_ready_is_suppressed_and_one_of_its_source_is_not() -> None:
    notices = EventCauses()
    notices.add(Event("change", 1, 1.0, "softer", {"what": "stiffness"}))
    notices.add(Event("disconnected", 2, 2.0, "no connection"))
    notices.add(Event(SUPPRESSED, 3, 3.0, "not ready", {"since_s": 2.5}))
    notices.add(Event("baseline-unknown", 4, 4.0, "of a sample before", {"reason": "fast"}))
    states = {notice.cause: state for notice, _, state in notices.alarms()}
    assert states == {CAUSES["change"]: "suppressed", SOURCE: "unacknowledged", "baseline-unknown: fast": "suppressed"}
    assert notices.suppressed_s == 2.5
    notices.add(Event(ENDED, 5, 5.0, "ready"))
    for i in range(6, 26, 2):  # a drive that is switched off in each cycle
        notices.add(Event(SUPPRESSED, i, float(i), "not ready"))
        notices.add(Event(ENDED, i + 1, i + 1.0, "ready"))
    assert {state for _, _, state in notices.alarms()} == {"unacknowledged"}
    rows = [(row["what"], row["state"]) for row in notices.history.since(0) if row["cause"] == CAUSES["change"]]
    assert rows == [("raised", "unacknowledged"), ("suppressed", "suppressed"), ("unsuppressed", "unacknowledged")]


def test_every_alarm_has_an_end_and_every_end_an_alarm() -> None:
    reported = {kind.cause for name, kind in ALARMS.items() if kind.end == "reported" and kind.cause}
    assert reported == {cause for cause in RETURNS.values() if cause}


def test_what_is_lost_in_a_silence_belongs_to_the_silence() -> None:
    notices = EventCauses()
    group = {"group": "connection@400", "first_s": 0.4, "last_s": 0.4}
    notices.add(Event("disconnected", 400, 0.4, "the connection broke", group | {"count": 1}))
    notices.add(Event("connected", 400, 0.4, "connected", group | {"count": 2}))
    for kind, count in (("loss", 1), ("gap", 2)):
        details = {"missing_samples": 600, "group": "loss@1000", "count": count}
        notices.add(Event(kind, 1000, 1.0, "600 samples were lost", details))
    assert [(n["cause"], n["count"], n["alarm"]["state"]) for n in notices.since(0)] == [(SOURCE, 4, "returned")]
    notices.add(Event("loss", 3000, 3.0, "7 lost", {"missing_samples": 7, "group": "loss@1000", "count": 3}))
    assert [n["cause"] for n in notices.since(0)] == [SOURCE, "loss"]


def test_an_unknown_difference_ends_when_it_is_identified() -> None:
    notices = EventCauses()
    notices.add(Event("change", 1, 1.0, "far", {"what": "machine"}))
    notices.add(Event("change", 2, 2.0, "stiffness", {"what": "stiffness", "amount_percent": -9.0}))
    assert notices.changed == {"stiffness"}
    notices.add(Event("change", 3, 3.0, "at a place", {"what": "stiffness", "place_m": 0.35}))
    notices.add(Event("change-cleared", 4, 4.0, "as before", {"what": "stiffness"}))
    assert notices.changed == {"stiffness"}, "the one at a place is still there"


def test_an_alarm_that_comes_and_goes_is_one_row_of_the_history_that_counts() -> None:
    notices = EventCauses()
    for i in range(30):
        notices.add(Event("backlog", i, float(i), "behind"))
        notices.add(Event("backlog-cleared", i, i + 0.5, "caught up"))
    (notice,) = notices.since(0)
    assert notice["alarm"]["chatters_until_s"] == 29.0 - (CHATTER_TIMES - 1) + CHATTER_S
    rows = notices.history.since(0)
    assert [row["what"] for row in rows] == ["raised", "returned", "raised", "returned", "chattering"]
    assert rows[-1]["count"] == 28
    notices.add(Event("backlog", 99, 200.0, "behind"))
    assert notices.history.since(0)[-1]["what"] == "raised"
    assert notices.since(0)[0]["alarm"]["chatters_until_s"] is None


def test_a_flood_of_causes_forgets_first_what_needs_nothing() -> None:
    notices = EventCauses()
    notices.add(Event("change", 0, 0.0, "stiffness", {"what": "stiffness"}))
    for i in range(3 * CAUSES_MAX):
        notices.add(Event("steps", i, float(i), "steps", {"channel": f"channel {i}"}))
    found = notices.since(0)
    assert len(found) == CAUSES_MAX
    assert "change: stiffness" in [n["cause"] for n in found]
    for i in range(CAUSES_MAX):
        notices.add(Event("roles-doubtful", i, float(i), "doubtful", {"reason": f"cause {i}"}))
    assert "change: stiffness" in [n["cause"] for n in notices.since(0)], "it has the highest priority"
    assert len(notices.forgotten(notices.version - 1)) == 1
    for i in range(3 * CAUSES_MAX):
        notices.add(Event("change", i, float(i), "changed", {"what": f"part {i}"}))
    assert len(notices.since(0)) == CAUSES_MAX
    assert len(notices.history.since(0)) == ROWS_MAX


HOSTILE = [
    {"by": "x" * (NAME_MAX + 1)}, {"by": 7}, {"by": ""}, {"by": "\ud800"}, {"by": "a\0b"}, {"by": "a\u202eb"},
    {"reason": ""}, {"reason": "x" * (TEXT_MAX + 1)}, {"minutes": 0}, {"minutes": 1e9}, {"minutes": 10**400},
    {"minutes": "30"}, {"minutes": True}, {"minutes": float("nan")}, {"axis": 1}, {"axis": True}, {"event": None},
]  # fmt: skip


@pytest.mark.parametrize("wrong", HOSTILE, ids=str)
def test_a_hostile_request_is_refused_in_one_sentence(wrong: dict[str, object]) -> None:
    right = {"axis": 0, "event": "3f", "by": "<b>Ann</b>", "reason": "noise test", "minutes": 30}
    assert alarm_request(json.dumps(right).encode(), 1, "shelve").by == "<b>Ann</b>"
    with pytest.raises(LivebodeError) as refused:
        alarm_request(json.dumps(right | wrong).encode(), 1, "shelve")
    assert "\n" not in str(refused.value)
