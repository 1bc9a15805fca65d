"""What is promised arrives though the receiver is down, slow, refuses, or the process ended; the rest is counted."""

from __future__ import annotations

import os
import signal
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from livebode.core import Event, PublishError
from livebode.publishing import outbox
from tests.support.errors import refused
from tests.support.forked import server
from tests.support.receivers import HttpReceiver, PublishedAxis, free_port, until, webhook


def test_events_wait_while_the_receiver_is_down_and_arrive_in_order(tmp_path: Path) -> None:
    port = free_port()
    with PublishedAxis(tmp_path, webhook(port)) as axis:
        for number in range(5):
            axis.change(2.0, number)
        down = until(lambda: axis.reported("sink-down"), "the report")
        assert "hook does not take messages: no connection" in down[0].message
        with HttpReceiver(port) as receiver:
            until(lambda: len(receiver.posted) == 5, "the events")
            up = until(lambda: axis.reported("sink-up"), "the report")
            assert "takes messages again" in up[0].message
            assert [content["sample"] for content in receiver.contents] == [0, 1, 2, 3, 4]
            counts = until(lambda: (of := axis.counts("hook"))["events_waiting"] == 0 and of, "an empty outbox")
            assert counts["events_delivered"] == 5
            axis.change(3.0, 5)
            until(lambda: len(receiver.posted) == 6, "the next event")
    assert not axis.outbox.exists()


def test_events_of_an_ended_process_are_sent_by_the_next_one(tmp_path: Path) -> None:
    port = free_port()
    with PublishedAxis(tmp_path, webhook(port)) as axis:
        axis.change(2.0, 7)
        axis.change(2.1, 8)
    assert axis.said == [f"hook: 2 events wait in {str(axis.outbox)!r}; the next run to the same directory sends them"]
    with HttpReceiver(port) as receiver, PublishedAxis(tmp_path, webhook(port)):
        until(lambda: len(receiver.posted) == 2, "the events of before")
    assert [content["sample"] for content in receiver.contents] == [7, 8]


def killed_with_events(folder: Path, port: int) -> None:
    """A process that ends by SIGKILL as soon as its events are on disk."""
    axis = PublishedAxis(folder, webhook(port))
    for number in range(3):
        axis.change(2.0, number)
    until(lambda: axis.counts("hook")["events_waiting"] == 3, "the events on disk")
    os.kill(os.getpid(), signal.SIGKILL)


def test_events_of_a_killed_process_are_sent_by_the_next_one(tmp_path: Path) -> None:
    port = free_port()
    process = server().Process(target=killed_with_events, args=(tmp_path, port))
    process.start()
    process.join()
    assert process.exitcode == -signal.SIGKILL
    with HttpReceiver(port) as receiver, PublishedAxis(tmp_path, webhook(port)) as axis:
        until(lambda: len(receiver.posted) == 3, "the events of before")
        until(lambda: axis.counts("hook")["events_delivered"] == 3, "the confirmation")
    assert [content["sample"] for content in receiver.contents] == [0, 1, 2]


def test_a_receiver_that_does_not_answer_holds_up_neither_the_axis_nor_other_receivers(tmp_path: Path) -> None:
    with HttpReceiver() as slow, HttpReceiver() as quick:
        slow.answers.clear()
        sections = webhook(slow.port, name="slow", timeout_s=0.5), webhook(quick.port, name="quick")
        with PublishedAxis(tmp_path, *sections) as axis:
            for number in range(200):
                axis.change(2.0, number)
            until(lambda: len(quick.posted) == 200, "the events at the quick one")
            assert not slow.posted
            until(lambda: axis.reported("sink-down"), "the report")
            slow.answers.set()
            until(lambda: axis.counts("slow")["events_delivered"] == 200, "the events at the slow one")
    samples = [content["sample"] for content in slow.contents]
    assert sorted(set(samples)) == list(range(200))  # at least once


def test_a_refusal_is_repeated_and_a_permanent_one_is_counted(tmp_path: Path) -> None:
    with HttpReceiver() as receiver, PublishedAxis(tmp_path, webhook(receiver.port)) as axis:
        receiver.code = 500
        axis.change(2.0, 1)
        down = until(lambda: axis.reported("sink-down"), "the report")
        assert "the answer is 500" in down[0].message
        receiver.code = 200
        until(lambda: receiver.posted, "the event")
        receiver.code = 422
        axis.change(2.0, 2)
        refused = until(lambda: axis.reported("sink-refused"), "the report")
        assert "refused 1 events permanently: the answer is 422" in refused[0].message
        receiver.code = 200
        axis.change(2.0, 3)
        until(lambda: len(receiver.posted) == 2, "the event after it")
        until(lambda: axis.counts("hook")["events_delivered"] == 2, "its answer")
        counts = axis.counts("hook")
    assert (counts["events_delivered"], counts["events_refused"]) == (2, 1)


def test_of_too_many_events_the_oldest_are_dropped_and_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outbox, "WAITING_MAX", 3)
    port = free_port()
    with PublishedAxis(tmp_path, webhook(port)) as axis:
        for number in range(10):
            axis.change(2.0, number)
        counts = until(lambda: (of := axis.counts("hook"))["events_dropped"] == 7 and of, "the count")
        assert counts["events_waiting"] == 3
        with HttpReceiver(port) as receiver:
            until(lambda: len(receiver.posted) == 3, "the newest events")
            assert [content["sample"] for content in receiver.contents] == [7, 8, 9]
            full = until(lambda: axis.reported("sink-full"), "the report")
    assert "7 events for hook were lost" in full[0].message


def test_of_results_only_the_newest_are_sent_and_missed_rounds_are_counted(tmp_path: Path) -> None:
    with HttpReceiver() as receiver:
        receiver.code = 503
        section = webhook(receiver.port, events=[], values=["parameters", "responses", "status"], interval_s=0.1)
        with PublishedAxis(tmp_path, section) as axis:
            axis.measure()
            until(lambda: receiver.requests >= 3, "attempts")
            until(lambda: axis.counts("hook")["rounds_missed"] >= 3, "missed rounds")
            receiver.code = 200
            until(lambda: receiver.posted, "results")
            counts = axis.counts("hook")
            assert counts["rounds_missed"] >= 3
            assert counts["rounds"] <= len(receiver.posted) + 1
        (found,) = receiver.contents[0]["axes"]
    assert not axis.outbox.exists()
    assert {one["name"] for one in found["measurements"]} >= {"Keff", "resonance"}
    assert len(found["response"]["frequency_hz"]) == len(found["response"]["real"]) == 13
    assert found["status"]["responses"] == 2


def test_an_event_about_a_receiver_is_sent_to_the_others_only(tmp_path: Path) -> None:
    with HttpReceiver() as one, HttpReceiver() as other:
        sections = [webhook(port, name=name, events=["all"]) for name, port in (("a", one.port), ("b", other.port))]
        with PublishedAxis(tmp_path, *sections) as axis:
            axis.feed(Event("sink-down", 0, 0.0, "a is down", {"sink": "a"}))
            axis.feed(Event("sink-up", 1, 1.0, "b is up", {"sink": "b"}))
            until(lambda: other.posted and one.posted, "both")
    assert one.texts == ["x: b is up"]
    assert other.texts == ["x: a is down"]


def test_a_subscriber_only_appends_while_the_disk_is_stuck(tmp_path: Path) -> None:
    with PublishedAxis(tmp_path, webhook(free_port())) as axis:
        box = axis.publisher._outbox
        assert box is not None
        with box._lock:  # stands for a disk that does not answer
            axis.change(1.0)
            until(box._queue.empty, "the writing thread at the disk")
            for number in range(outbox.INTAKE_MAX + 900):
                axis.change(1.0, number)
            dropped = sum(box.dropped.values())
        assert 0 < dropped <= 900
        counts = axis.counts("hook")
        assert counts["events_dropped"] == dropped
        taken = outbox.INTAKE_MAX + 900 - dropped  # the first one has the id of number 0
        until(lambda: axis.counts("hook")["events_waiting"] == taken, "the others on disk")


def test_the_database_of_another_program_is_refused_and_not_removed(tmp_path: Path) -> None:
    path = tmp_path / "run.outbox.sqlite"
    with closing(sqlite3.connect(path)) as mine:
        mine.execute("CREATE TABLE events (thesis TEXT)")
        mine.commit()
    before = path.read_bytes()
    (tmp_path / "text").write_text("years of work" * 100)
    (tmp_path / "link").symlink_to(path)
    for place in (path, tmp_path / "link", tmp_path / "text"):
        with refused(PublishError, "outbox-foreign", path=str(place)):
            outbox.Outbox(place, lambda _: None)
    assert path.read_bytes() == before
