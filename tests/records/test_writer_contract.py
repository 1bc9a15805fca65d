"""The work of records beside their axes: in order, beside each other, and never more than a second behind."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import pytest

from livebode.records import Writer, last_commit
from livebode.records.segments import disk, writer
from livebode.records.segments.phase import Phase
from tests.support.peers.peer import PATIENCE_S
from tests.support.recorded import RATE_HZ, check_whole, machine, record_machine


def test_jobs_of_a_record_are_done_in_order_while_another_record_waits_for_its_disk() -> None:
    slow, fast, disk_answers, done = Writer(), Writer(), threading.Event(), list[int]()
    slow.add(lambda: done.append(-1 if disk_answers.wait(PATIENCE_S) else -2))
    for number in range(100):
        fast.add(lambda number=number: done.append(number))
    fast.wait()
    assert done == list(range(100))
    assert not slow.idle
    disk_answers.set()
    slow.wait()
    assert done[100:] == [-1]


class AtOnce:
    """Jobs that are to be done at once, and the threads that did them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(writer, "_at_once", writer._AtOnce())
        self.by: list[threading.Thread] = []

    def add(self, to: Writer) -> threading.Thread:
        """Add one, and return the thread that did it."""
        to.add(lambda: self.by.append(threading.current_thread()), at_once=True)
        to.wait()
        return self.by[-1]


def test_a_job_is_done_at_once_after_the_ones_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    jobs, record, go_on, done = AtOnce(monkeypatch), Writer(), threading.Event(), list[int]()
    assert jobs.add(record) is threading.current_thread()
    record.add(lambda: done.append(1 if go_on.wait(PATIENCE_S) else -1))
    record.add(lambda: done.append(2), at_once=True)
    assert done == []
    go_on.set()
    record.wait()
    assert done == [1, 2]


def test_jobs_are_done_beside_the_axes_after_one_that_took_long(monkeypatch: pytest.MonkeyPatch) -> None:
    jobs = AtOnce(monkeypatch)
    Writer().add(lambda: time.sleep(2 * writer._SLOW_S), at_once=True)
    assert jobs.add(Writer()) is not threading.current_thread()


def test_jobs_are_done_beside_the_axes_while_one_does_not_return(monkeypatch: pytest.MonkeyPatch) -> None:
    jobs, begun, disk_answers = AtOnce(monkeypatch), threading.Event(), threading.Event()

    def hang() -> None:
        begun.set()
        disk_answers.wait(PATIENCE_S)

    hanging = threading.Thread(target=lambda: Writer().add(hang, at_once=True))
    hanging.start()
    assert begun.wait(PATIENCE_S)
    assert jobs.add(Writer()) is not threading.current_thread()
    disk_answers.set()
    hanging.join()


def test_nothing_is_written_after_a_job_that_failed() -> None:
    writer, done, begun = Writer(), list[int](), threading.Event()

    def fail() -> None:
        begun.wait(PATIENCE_S)
        raise MemoryError

    writer.add(fail)
    writer.add(lambda: done.append(1))
    begun.set()
    writer.wait()
    with pytest.raises(MemoryError):
        writer.check()
    with pytest.raises(MemoryError):
        writer.add(lambda: done.append(2))
    assert done == []


def test_records_of_a_process_have_phases_of_their_own() -> None:
    first = [Phase() for _ in range(16)]
    assert sorted(phase.part for phase in first) == [n / 16 for n in range(16)]
    first[3].release()
    again = Phase()
    assert again.part == first[3].part
    for phase in (*first, again):
        phase.release()
    alone = Phase()
    assert alone.part == 0.0
    alone.release()


def test_tracking_waits_for_a_disk_that_hangs_before_a_kill_would_cost_more_than_a_second(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, tracked, behind = tmp_path / "run", 0, list[int]()
    waits, write_all, wait = threading.Event(), disk.write_all, Writer.wait

    def hang(file: int, data: bytes) -> None:
        """The disk answers when tracking waits for it."""
        if threading.current_thread().name.startswith("livebode record"):
            assert waits.wait(PATIENCE_S)
            committed = last_commit(run)
            assert committed is not None
            behind.append(tracked - committed.sample)
        write_all(file, data)

    def observed(writer: Writer) -> None:
        waits.set()
        wait(writer)
        waits.clear()

    def progress(samples: int, _: int | None) -> None:
        nonlocal tracked
        tracked = samples

    monkeypatch.setattr(disk, "write_all", hang)
    monkeypatch.setattr(Writer, "wait", observed)
    record_machine(machine(5000), run, progress=progress)
    check_whole(run, 5000)
    assert RATE_HZ / 2 < max(behind) <= RATE_HZ
