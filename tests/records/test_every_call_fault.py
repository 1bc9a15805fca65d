"""A call that the record makes on the file system fails once, or is the last one before the power goes.

A sixth of the calls, drawn at random with a seed; `make crash` takes every one (LIVEBODE_CRASH_CALLS: their share).
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from livebode.core import LivebodeError
from tests.support.failing_disk import PowerCut, cut, disk_that, full
from tests.support.recorded import RATE_HZ, check_beginning, check_whole, machine, record_machine, unfinished

SHARE = float(os.environ.get("LIVEBODE_CRASH_CALLS", "0.1667"))
SAMPLES = 2000
BESIDE = 20
"""Calls that may change places: segments are closed and journals synced in threads of their own."""
CLOSING = ("record-unclosed", "record-closed")


@pytest.fixture(autouse=True)
def _commit_often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("livebode.runtime.segmented._INTERVAL_S", 0.0)


@pytest.fixture
def folder() -> Iterator[Path]:
    """In memory, where the system has such a place: the calls are the same, and a sync waits for no disk."""
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else None) as path:
        yield Path(path)


def calls_of_a_run(directory: Path) -> tuple[int, int, int]:
    """Calls before the first block was asked for, before the last one came back, and in all."""
    counts: list[int] = []
    with disk_that(full, 0) as disk:
        record_machine(machine(SAMPLES, lambda _: counts.append(disk.count)), directory)
    check_whole(directory, SAMPLES)
    assert not list((directory / "open").iterdir())
    return counts[0], counts[-1], disk.count


def drawn(calls: int, seed: int) -> list[int]:
    """Numbers of the calls to go wrong, from 1 on; at random, as the kinds of calls repeat with a period."""
    chosen = np.random.default_rng(seed).random(calls) < SHARE
    return [int(at) for at in 1 + np.flatnonzero(chosen)]


def test_a_call_that_fails_once_costs_nothing(folder: Path) -> None:
    paused = unclosed = 0
    begun, ended, calls = calls_of_a_run(folder / "whole")
    for at in drawn(calls, seed=1):
        out, reported, counts = folder / str(at), [], []
        with disk_that(full, at) as disk:
            # Segments are closed beside the run, so the same call may come earlier or later in another run.
            source = machine(SAMPLES, lambda _, counts=counts, disk=disk: counts.append(disk.count))
            try:
                record_machine(source, out, report=reported.append)
            except LivebodeError:  # only at its very beginning or end
                assert not counts or not counts[0] < at <= counts[-1] - BESIDE, at
        kinds = [event.kind for event in reported if event.kind not in CLOSING]
        unclosed += len(kinds) < len(reported)
        assert kinds in ([], ["record-paused", "record-resumed"], ["record-paused"]), at
        paused += kinds == ["record-paused", "record-resumed"]
        if unfinished(out):
            record_machine(machine(SAMPLES), out)
        check_whole(out, SAMPLES)
        shutil.rmtree(out)
    # The others were closing or merging segments, which waits without a pause; less three deviations of the draw.
    expected = SHARE * (ended - begun) / 4
    assert paused > expected - 3 * np.sqrt(expected * (1 - SHARE))
    assert unclosed > 0


def test_power_may_go_at_any_call(folder: Path) -> None:
    calls = calls_of_a_run(folder / "whole")[2]
    for at in [*drawn(calls, seed=2), *range(calls + 1, calls + BESIDE)]:
        out, done = folder / str(at), 0

        def progress(samples: int, _: int | None) -> None:
            nonlocal done
            done = samples

        with disk_that(cut, at) as disk, suppress(PowerCut):
            record_machine(machine(SAMPLES), out, progress=progress)
        if (out / "run.json").exists() and unfinished(out):
            assert disk.dead
            check_beginning(out, SAMPLES, done - RATE_HZ)
            with disk_that(cut, 1 + at % 25), suppress(PowerCut):  # once more, while it goes on
                record_machine(machine(SAMPLES), out)
            check_beginning(out, SAMPLES, done - RATE_HZ)
        if unfinished(out):
            record_machine(machine(SAMPLES), out)
        check_whole(out, SAMPLES)
        shutil.rmtree(out)
        if not disk.dead:  # it was done before the call came
            break
    else:
        raise AssertionError("no run was short enough to be done")
