"""Samples that a logger drops or repeats without a gap are found, counted and realigned, and cost no line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Lines
from livebode.excitation import Slip, find_slips, multisine, recognise
from livebode.excitation.slips import realigned
from livebode.preparation import AlignedLog
from livebode.records import RunRecord, each_event
from livebode.sources import open_log
from tests.support.command import livebode, write_parquet

RATE_HZ, WINDOW = 4000.0, 400
LINES = Lines.parse("20:140:10", RATE_HZ, WINDOW)
PLAYED = multisine(LINES)


def recorded(samples: int, noise: float = 0.01, seed: int = 0) -> dict[str, np.ndarray]:
    """A plant of gain 2 behind a sample of delay."""
    rng = np.random.default_rng(seed)
    w = np.resize(PLAYED, samples)
    u = w + noise * rng.standard_normal(samples)
    return {"w": w, "u": u, "y": 2 * np.roll(u, 1) + noise * rng.standard_normal(samples)}


def dropped_each_second(seconds: int, missing: int, seed: int = 3) -> tuple[dict[str, np.ndarray], list[int]]:
    """One leap a second at a random place, and where they are in what is left."""
    rng = np.random.default_rng(seed)
    at = np.array([4000 * s + int(rng.integers(500, 3500)) for s in range(1, seconds - 1)])
    columns = recorded(4000 * seconds)
    if missing > 0:
        gone = (at[:, np.newaxis] + np.arange(missing)).ravel()
        return {name: np.delete(x, gone) for name, x in columns.items()}, (at - missing * np.arange(at.size)).tolist()
    again = -missing
    taken = np.insert(
        np.arange(4000 * seconds), np.repeat(at, again), (at[:, np.newaxis] - np.arange(again, 0, -1)).ravel()
    )
    return {name: x[taken] for name, x in columns.items()}, (at + again * np.arange(at.size)).tolist()


@pytest.mark.parametrize("missing", [1, 2, 7, -1, -3])
def test_every_leap_is_found_at_its_place_and_with_its_size(missing: int) -> None:
    columns, places = dropped_each_second(30, missing)
    found = find_slips(columns["w"], WINDOW)
    assert [slip.missing for slip in found] == [missing] * len(places)
    assert np.max(np.abs(np.array([slip.sample for slip in found]) - places)) <= abs(missing)
    back = realigned(columns["w"], found)
    whole = np.resize(PLAYED, back.size)
    away = np.flatnonzero(np.abs(back - whole) > 1e-9)
    assert away.size <= 8 * len(places)


def test_a_window_of_two_periods_sent_in_single_precision_has_no_leap() -> None:
    played = multisine(Lines.parse("20:140:20", RATE_HZ, WINDOW))
    for scale in (1.0, 1.1, 3.0):
        assert find_slips(np.resize((scale * played).astype(np.float32).astype(float), 12_800), WINDOW) == ()


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.integers(50, 1000), st.floats(-20, 60), st.floats(0, 100), st.integers(3, 40), st.integers(0, 2**31),
    st.sampled_from(["nothing", "spikes", "a transient", "a pause", "a step of the amplitude"]),
)  # fmt: skip
def test_noise_drift_spikes_transients_and_pauses_are_no_leaps(
    window: int, snr_db: float, drift_ppm: float, lines: int, seed: int, what: str
) -> None:
    rng = np.random.default_rng(seed)
    bins = np.sort(rng.choice(np.arange(1, (window - 1) // 2 + 1), min(lines, (window - 1) // 2), replace=False))
    size = 80 * window
    at = np.arange(size) * (1 + drift_ppm * 1e-6)
    phase = rng.uniform(0, 2 * np.pi, bins.size)
    x = np.sum(np.sin(2 * np.pi * np.outer(bins, at) / window + phase[:, np.newaxis]), axis=0)
    x += np.std(x) * 10 ** (-snr_db / 20) * rng.standard_normal(size)
    if what == "spikes":
        x[rng.integers(0, size, 5)] += 10 * np.std(x)
    if what == "a transient":
        x += 3 * np.std(x) * np.exp(-np.arange(size) / window)
    if what == "a pause":
        x[20 * window + 7 : 31 * window] = 0.0
    if what == "a step of the amplitude":
        x[33 * window + 11 :] *= 0.5
    # A clock so fast that the top line turns by a radian within the 16 periods that are remembered leaps indeed.
    if 2 * np.pi * bins[-1] * 16 * drift_ppm * 1e-6 < 0.3:
        assert find_slips(x, window) == ()


def test_auto_finds_all_lines_through_a_dropped_sample_a_second() -> None:
    columns, places = dropped_each_second(30, 1)
    found = recognise(columns["w"], RATE_HZ, columns["y"])
    assert (found.period, found.lines.bins) == (WINDOW, LINES.bins)
    assert len(found.slips) == len(places)


def test_a_run_realigns_what_was_dropped_and_reports_it(tmp_path: Path) -> None:
    columns, places = dropped_each_second(20, 1)
    log = write_parquet(tmp_path / "log.parquet", columns)
    signals = ("--rate", 4000, "--excitation", "w", "--input", "u", "--output", "y")
    done = livebode("run", log, *signals, "--average", "--forgetting", 1, "--out", tmp_path / "run")
    assert done.code == 0, done.err
    assert "the phase of 'w' jumps 18 times" in " ".join(done.err.split())
    run = RunRecord.open(tmp_path / "run")
    assert run.found["phase_slips"] == len(places)
    last = run.responses()[-1]
    assert last.lines.bins == LINES.bins
    truth = 2 * np.exp(-2j * np.pi * LINES.frequency_hz / RATE_HZ)
    # 160 windows of 400 samples, noise of √5·0.01 on lines of amplitude 1: 2 · 0.022/√(2 · 160 · 400/4), five sigma.
    assert np.max(np.abs(last.value - truth)) <= 5 * 0.00028
    events = [event for recorded in run.events() for event in each_event(recorded)]
    (slips,) = [event for event in events if event.kind == "phase-slips"]
    assert [sample for sample, _ in slips.details["slips"]] == pytest.approx(places, abs=1)
    assert sum(event.kind == "gap" for event in events) == len(places)
    inspected = json.loads(livebode("inspect", log, "--rate", 4000, "--excitation", "w", "--json").out)
    assert len(inspected["excitation"]["phase_slips"]) == len(places)


@pytest.mark.parametrize("missing", [5, -1, -3])
@pytest.mark.parametrize("at", [4000, 4096, 4097])
def test_samples_behind_a_leap_do_not_follow_those_before_it(missing: int, at: int, tmp_path: Path) -> None:
    log = open_log(write_parquet(tmp_path / "log.parquet", recorded(8000)), rate_hz=RATE_HZ)
    blocks = list(AlignedLog(log, (Slip(at, missing),)).blocks(["w"]))
    assert [block.start for block in blocks if block.gap and block.start] == [at + max(missing, 0)]
    assert sum(map(len, blocks)) == 8000 - max(-missing, 0)


def test_two_leaps_are_undone_on_the_grid_of_the_first_period() -> None:
    x = np.arange(20.0)
    back = realigned(np.delete(x, [5, 6]), [Slip(5, 2), Slip(12, -1)])
    assert np.array_equal(
        back, [0, 1, 2, 3, 4, np.nan, np.nan, 7, 8, 9, 10, 11, 12, 13, 15, 16, 17, 18, 19], equal_nan=True
    )


@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 1e-9, 0.01, 0.3]),
    st.integers(0, 4),
    st.sampled_from(["20:140:10", "20:140:20", "40:160:40"]),
)
@settings(max_examples=30)
def test_periods_examined_together_give_the_slips_of_periods_one_by_one(
    seed: int, noise: float, leaps: int, lines: str
) -> None:
    """Also for a window of two or four periods of the excitation, where noise decides between equal shifts."""
    rng = np.random.default_rng(seed)
    x = np.resize(multisine(Lines.parse(lines, RATE_HZ, WINDOW)), 400 * int(rng.integers(20, 200)))
    x = x + noise * rng.standard_normal(x.size)
    for at in rng.integers(1, x.size - 500, leaps):
        x = np.delete(x, np.arange(at, at + rng.integers(1, 9)))
    together = find_slips(x, WINDOW)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("livebode.excitation.slips._TOGETHER", 1)
        patch.setattr("livebode.excitation.slips._Search._calm", lambda *given: given[2][:0])
        assert find_slips(x, WINDOW) == together
