"""The response of a closed loop in LinuxCNC's HAL is the one that its components compute."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from livebode.analysis import mean_of
from livebode.records import RunRecord
from livebode.sources.live import (
    ClockReading,
    LiveBlock,
    LiveSource,
    Position,
    SourceSettings,
    make_source,
    open_source,
)
from tests.support.live_runs import started
from tests.support.peers.hal import RATE_HZ, SETTINGS, Hal, only_hal, plant
from tests.support.peers.peer import PATIENCE_S, until

WINDOW = 400
BINS = np.arange(2, 16, 2)
AXIS = """
[source]
url = "hal:sampler.0"
sample_signal = "n"
channels = ["w [N m]", "u [N m]", "velocity [rad/s]"]
[signals]
excitation = "w"
input = "u"
output = "velocity"
[lines]
frequencies = "20:140:20"
window = 400
"""


@pytest.fixture
def hal() -> Iterator[Hal]:
    with only_hal(), Hal(depth=2000) as found:
        yield found


def multisine(periods: int) -> NDArray[np.float64]:
    n = np.arange(periods * WINDOW)
    return 0.2 * np.sum([np.cos(2 * np.pi * k * n / WINDOW + k * k) for k in BINS], axis=0)


def taken(source: LiveSource, samples: int) -> list[LiveBlock]:
    blocks: list[LiveBlock] = []
    for block in source.blocks():
        blocks.append(block)
        if sum(map(len, blocks)) >= samples:
            break
    return blocks


def test_the_response_of_a_foreign_closed_loop_is_within_its_bounds(hal: Hal, tmp_path: Path) -> None:
    (tmp_path / "axis.toml").write_text(AXIS)
    hal.play(np.random.default_rng(1).normal(0, 0.02, 30 * RATE_HZ), 1)
    hal.play(multisine(300))
    with started(tmp_path / "axis.toml", tmp_path / "run") as run:
        until((tmp_path / "run").exists, "the run directory")
        began = hal.periods()
        until(lambda: hal.periods() > began + 5 * RATE_HZ, "five seconds")
        run.send_signal(signal.SIGINT)
        assert run.wait(PATIENCE_S) == 0
    record = RunRecord.open(tmp_path / "run")
    assert record.summary["source"]["lost"] == 0
    mean = mean_of(record)[0]
    truth = plant(mean.lines.frequency_hz)
    np.testing.assert_allclose(mean.lines.frequency_hz, 10.0 * BINS)
    assert np.all(np.abs(mean.value - truth) < 4 * mean.sigma)
    assert np.all(mean.sigma < 0.04 * np.abs(truth))
    each = record.responses()
    bound = each.bound(np.sqrt(np.log(20)))
    known = np.isfinite(bound)
    assert known.mean() > 0.9  # the first windows have nothing to be compared with
    assert np.mean((np.abs(each.value - truth) <= bound)[known]) > 0.88  # 95 %, of some 150 windows times lines


def test_a_full_fifo_is_a_gap_of_its_exact_length(hal: Hal) -> None:
    ramp = np.arange(1.0, 4 * RATE_HZ)
    with open_source(SourceSettings(**SETTINGS)) as source:
        hal.play(ramp)
        blocks = taken(source, RATE_HZ // 2)
        stopped = _readers()
        os.kill(stopped, signal.SIGSTOP)
        until(lambda: int(hal.halcmd("getp", "sampler.0.overruns")) > 1000, "an overrun")
        os.kill(stopped, signal.SIGCONT)
        blocks += taken(source, RATE_HZ)
        lost = source.health.lost
        events = [event for event in source.take_events() if event.kind == "loss"]
    assert lost > 1000
    assert sum(event.details["missing_samples"] for event in events) == lost
    assert lost == blocks[-1].stop - sum(map(len, blocks))
    for block in blocks:
        played = block["w"] > 0
        # While the ramp plays, w is its number: at each sample, also after the gap.
        offset = (block["w"] - np.arange(block.start, block.stop))[played]
        assert offset.size == 0 or np.ptp(offset) == 0
    offsets = {float(b["w"][0] - b.start) for b in blocks if b["w"][0] > 0 and b["w"][-1] > 0}
    assert len(offsets) == 1


@pytest.mark.usefixtures("hal")
def test_what_waits_in_the_fifo_continues_a_record() -> None:
    with open_source(SourceSettings(**SETTINGS)) as source:
        last = taken(source, 500)[-1]
    assert last.origin is not None
    number = last.stop + last.origin.offset
    position = Position(last.stop, last.origin.epoch, number, RATE_HZ, ClockReading.at(time.monotonic()))
    again = make_source(SourceSettings(**SETTINGS))
    again.resume(position)
    with again.open() as source:
        first = taken(source, 1)[0]
        lost = source.health.lost
    # halsampler had printed up to a buffer more than the first source gave, when it was ended.
    assert (first.start, lost) == (last.stop + lost, lost)
    assert lost < RATE_HZ // 2


def _readers() -> int:
    found = subprocess.run(["pgrep", "-P", str(os.getpid()), "halsampler"], capture_output=True, text=True, check=True)
    return int(found.stdout)
