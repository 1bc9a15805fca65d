"""The board of a fleet against what was sent: states, alarms, partitions that die or move, strangers' messages."""

from __future__ import annotations

import json
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import ServerError
from livebode.dashboard import AlarmRequest
from livebode.dashboard.alarm import AlarmStatus
from livebode.monitoring import ALARMS
from livebode_plant.fleet.status_message import (
    ACTIVE,
    AXIS_STATUS,
    AxisName,
    PartitionNames,
    encode_names,
    encode_status,
)
from livebode_plant.page.fleet_board import CONDITIONS, LOOKS, LOST_S, FleetAct, FleetAlarms, FleetBoard
from livebode_plant.page.fleet_feed import DemoFeed, DemoFleet
from livebode_plant.page.fleet_pages import tiles_frame
from tests.support.fleet_pages import expected_looks

NOW = 1_800_000_000.0


def sent(board: FleetBoard, status: np.ndarray, now_s: float, partition: int = 0, worker: str = "w") -> None:
    """One partition with an axis for each row reports."""
    axes = tuple(AxisName(f"hall/m{i}/x", "stiffness", "N/m") for i in range(len(status)))
    names, table = encode_names(PartitionNames(partition, worker, axes, ("", "change", "gap")), now_s)
    board.process([names, encode_status(partition, table, status, now_s)], now_s)
    board.refresh(now_s)


def one_alarm(raised: int = 1, active: bool = True, raised_s: int = 100) -> np.ndarray:
    status = np.zeros(3, AXIS_STATUS)
    status["axis"] = range(3)
    status["state"] = 1
    status[1]["raised"], status[1]["flags"], status[1]["priority"], status[1]["kind"] = raised, ACTIVE * active, 3, 1
    status[1]["raised_s"] = raised_s
    return status


def look(board: FleetBoard, axis: int = 1) -> str:
    return LOOKS[board.looks[axis]]


def ask(board: FleetBoard, act: str, raised: int = 1, now_s: float = NOW, **words: object) -> None:
    asked = AlarmRequest(1, f"{board.layout}:{raised}", **words)  # type: ignore[arg-type]
    board.process_act(board.act(act, asked, now_s).to_bytes())  # type: ignore[arg-type]
    board.refresh(now_s)


def test_a_simulated_fleet_looks_as_it_is() -> None:
    fleet = DemoFleet(3000)
    began_s = NOW
    feed, board = DemoFeed(fleet, began_s=began_s), FleetBoard()
    tables = {names.partition: encode_names(names, NOW) for names in fleet.names()}
    messages = [message for message, _ in tables.values()]
    random.Random(1).shuffle(messages)
    board.process(messages, began_s)
    found = feed.messages({number: table for number, (_, table) in tables.items()}, began_s + 125)
    board.process(found[::-1], began_s + 125)
    board.refresh(began_s + 125)
    status = fleet.status(125, began_s + 125)
    truth = dict(zip(fleet.paths, expected_looks(status)))
    assert dict(zip(board.paths, board.looks.tolist())) == truth
    assert {LOOKS[n] for n in truth.values()} >= {"ok", "check", "alarm", "returned", "silent", "behind", "not ready"}
    assert board.counts == np.bincount(list(truth.values()), minlength=len(LOOKS)).tolist()
    assert len(board.worst()) == 50
    urgent = [p for p, n in truth.items() if LOOKS[n] == "alarm"]
    first = {board.paths[row["axis"]] for row in board.worst()[: len(urgent)]}
    assert first == set(urgent)
    gaps = board.gaps()
    assert (gaps["lost"], gaps["gaps"]) == (status["lost"].sum(), status["gaps"].sum())
    assert [row["lost"] for row in gaps["rows"]] == sorted(status["lost"], reverse=True)[: len(gaps["rows"])]
    workers = board.workers(began_s + 125)
    assert sum(one["axes"] for one in workers["rows"]) == 3000
    assert (workers["silent_count"], workers["partitions"]) == (0, fleet.partitions)


def test_paths_are_in_the_order_of_their_numbers() -> None:
    board = FleetBoard()
    sent(board, np.zeros(12, AXIS_STATUS), NOW)
    assert board.paths == [f"hall/m{i}/x" for i in range(12)]


def test_an_alarm_goes_through_the_states_of_isa_18_2() -> None:
    board = FleetBoard()
    sent(board, one_alarm(), NOW)
    assert (look(board), board.open_count) == ("alarm", 1)
    ask(board, "acknowledge", by="Ann", words="seen")
    (row,) = board.open_alarms(NOW)["rows"]
    assert (look(board), row["state"], row["by"], row["comment"]) == ("acknowledged", "acknowledged", "Ann", "seen")
    sent(board, one_alarm(raised=2), NOW + 1)
    assert look(board) == "alarm", "raised again"
    sent(board, one_alarm(raised=2, active=False), NOW + 2)
    assert look(board) == "returned"
    ask(board, "acknowledge", 2, NOW + 2, by="Ann")
    assert (look(board), board.open_alarms(NOW)["count"]) == ("ok", 0)
    sent(board, one_alarm(raised=3), NOW + 3)
    ask(board, "shelve", 3, NOW + 3, by="Bo", words="spare part ordered", minutes=10.0)
    assert (look(board), board.open_alarms(NOW + 3)["rows"][0]["shelf"]["by"]) == ("shelved", "Bo")
    board.refresh(NOW + 3 + 601)
    assert board.open_alarms(NOW + 604)["rows"][0]["state"] == "unacknowledged", "the shelf ends at its time"
    ask(board, "acknowledge", 3, NOW + 605, by="Ann")
    sent(board, one_alarm(raised=1, raised_s=101), NOW + 606)
    assert look(board) == "alarm", "an axis that began to count again, seen by a page that opened later"


def test_an_act_that_the_page_did_not_show_is_refused() -> None:
    board = FleetBoard()
    sent(board, one_alarm(), NOW)
    for axis, event in ((1, "7:1"), (1, f"{board.layout}:x"), (0, f"{board.layout}:1"), (1, "")):
        with pytest.raises(ServerError):
            board.act("acknowledge", AlarmRequest(axis, event), NOW)
    act = board.act("acknowledge", AlarmRequest(1, f"{board.layout}:9"), NOW)
    assert act.raised == 1, "only what has happened"


def test_acts_from_before_the_names_are_applied() -> None:
    board = FleetBoard()
    board.process_act(FleetAct("acknowledge", "hall/m1/x", 1, 100, "Ann", "", 0.0, NOW).to_bytes())
    sent(board, one_alarm(), NOW)
    assert look(board) == "acknowledged"


@pytest.mark.parametrize(
    "change",
    [{"act": "delete"}, {"by": "a\n"}, {"by": "x" * 61}, {"raised": -1}, {"raised": True}, {"until_s": 1e300},
     {"at_s": float("nan")}, {"more": 1}, {"path": 7}, {"words": "x" * 201}],
)  # fmt: skip
def test_acts_of_strangers_are_counted_and_change_nothing(change: dict[str, object]) -> None:
    board = FleetBoard()
    sent(board, one_alarm(), NOW)
    good = json.loads(FleetAct("shelve", "hall/m1/x", 1, 100, "Ann", "why", NOW + 60, NOW).to_bytes())
    board.process_act(json.dumps(good | change).encode())
    board.process_act(b"[" * 3000)
    board.refresh(NOW)
    assert (board.axes.dropped, look(board)) == (2, "alarm")
    board.process_act(json.dumps(good).encode())
    board.refresh(NOW)
    assert look(board) == "shelved"


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 4), st.booleans(), st.integers(0, 4)), min_size=1, max_size=8))
def test_conditions_are_those_of_the_alarms_of_one_axis(rows: list[tuple[int, bool, int]]) -> None:
    status, alarms, reference = np.zeros(len(rows), AXIS_STATUS), FleetAlarms(), []
    for row, (raised, active, seen) in enumerate(rows):
        status[row]["raised"], status[row]["flags"] = raised, ACTIVE * active
        alarms.apply(FleetAct("acknowledge", "a", seen, 0), row)
        one = AlarmStatus(ALARMS["change"], active=active, raised=raised)
        reference.append(one.condition(min(seen, raised)))
    found = alarms.conditions(status, ["", "change"], NOW)
    assert [CONDITIONS[n] for n in found] == reference


def test_a_dead_worker_is_seen_and_a_takeover_ends_it() -> None:
    board = FleetBoard()
    sent(board, one_alarm(), NOW)
    board.refresh(NOW + LOST_S + 0.1)
    assert {look(board, i) for i in range(3)} == {"lost"}
    workers = board.workers(NOW + LOST_S + 0.1)
    assert (workers["silent_count"], workers["rows"]) == (1, [])
    layout = board.layout
    sent(board, one_alarm(), NOW + 20, worker="other")
    assert [one["worker"] for one in board.workers(NOW + 20)["rows"]] == ["other"]
    assert (look(board), look(board, 0), board.layout) == ("alarm", "ok", layout), "the axes keep their numbers"


def test_an_axis_that_its_partition_no_longer_has_is_lost_until_another_has_it() -> None:
    board = FleetBoard()
    sent(board, one_alarm(), NOW)
    sent(board, one_alarm()[:2], NOW + 1)
    assert [look(board, i) for i in range(3)] == ["ok", "alarm", "lost"]
    sent(board, one_alarm(), NOW + 2, partition=9)
    assert [look(board, i) for i in range(3)] == ["ok", "alarm", "ok"]


def test_a_stranger_harms_nobody_else() -> None:
    board, status = FleetBoard(), one_alarm()
    axes = tuple(AxisName(f"hall/m{i}/x") for i in range(3))
    good, table = encode_names(PartitionNames(0, "w", axes, ("", "change")), NOW)
    bad, bad_table = encode_names(PartitionNames(1, "w", (AxisName("bad/x"), AxisName("bad/y")), ()), NOW)
    wrong = status[:2].copy()
    wrong["state"] = 9
    twice = status[:2].copy()
    twice["axis"] = 1
    messages = [good, bad, encode_status(1, bad_table, wrong, NOW), encode_status(0, table, status, NOW)]
    board.process(messages, NOW)
    board.process([encode_status(1, bad_table, twice, NOW), encode_status(1, bad_table, status, NOW), b"x" * 99], NOW)
    board.process([encode_status(1, bad_table, twice, NOW)], NOW)
    board.refresh(NOW)
    truth = {"bad/x": "lost", "bad/y": "lost", "hall/m0/x": "ok", "hall/m1/x": "alarm", "hall/m2/x": "ok"}
    assert {path: LOOKS[n] for path, n in zip(board.paths, board.looks)} == truth
    assert board.axes.dropped == 4


@settings(max_examples=50, deadline=None)
@given(st.integers(1, 400), st.integers(0, 400), st.integers(0, 99))
def test_a_page_that_takes_frames_shows_what_the_board_has(axes: int, changes: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    before = rng.integers(0, len(LOOKS), axes).astype(np.uint8)
    after = before.copy()
    after[rng.integers(0, axes, changes)] = rng.integers(0, len(LOOKS))
    page = shown(np.zeros(axes, np.uint8), tiles_frame(1, before, None))
    assert (page == before).all()
    assert (shown(page, tiles_frame(1, after, before)) == after).all()


def shown(page: np.ndarray, frame: bytes) -> np.ndarray:
    """As fleet_feed.js reads a frame."""
    if not frame:
        return page
    assert frame[:5] == b"LBFT\1"
    count, found = int.from_bytes(frame[12:16], "little"), page.copy()
    if frame[5]:
        for word in np.frombuffer(frame, "<u4", count, 16):
            found[int(word) & 0x0FFFFFFF] = int(word) >> 28
    else:
        for i in range(count):
            found[i] = frame[16 + i // 2] >> 4 * (i % 2) & 15
    return found
