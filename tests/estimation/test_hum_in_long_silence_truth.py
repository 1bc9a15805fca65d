"""Hum that `inspect` names in a silence of two seconds or more makes its line invalid in a run, early or late."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from livebode.core import Block, Event, Lines, Responses
from livebode.estimation import Settings, SilenceSearch, SilentStretch, Tracker, disturbed_lines, find_hum, hum_spans
from tests.support.command import livebode, write_parquet

RATE_HZ = 1000.0
CHANNELS = ("w", "u", "y")
GRIDS = {100: [2, 3, 5, 6, 9, 10, 12], 130: [3, 5, 7, 9, 13], 200: [7, 10, 11, 19, 23]}  # 50 Hz on a bin, or beside one


def machine(
    parts_s: tuple[float, ...], hum: np.ndarray | float, into: str, window: int, seed: int
) -> dict[str, np.ndarray]:
    """A first-order plant with noise at both ends; silence and excitation follow each other, silence first."""
    rng = np.random.default_rng(seed)
    n, w = np.arange(window), list[np.ndarray]()
    phases = rng.uniform(0, 2 * np.pi, len(GRIDS[window]))
    period = sum(0.3 * np.cos(2 * np.pi * k * n / window + p) for k, p in zip(GRIDS[window], phases))
    for i, seconds in enumerate(parts_s):
        w.append(
            np.zeros(round(seconds * RATE_HZ)) if i % 2 == 0 else np.tile(period, round(seconds * RATE_HZ / window))
        )
    excitation = np.concatenate(w)
    added = np.resize(hum, excitation.size)
    u = excitation + 0.02 * rng.standard_normal(excitation.size) + added * (into != "output")
    y = lfilter([0.0, 0.3], [1, -0.8], u) + 0.02 * rng.standard_normal(excitation.size) + added * (into == "output")
    return {"w": excitation, "u": u, "y": y}


def mains(level: float, hz: float, seconds: float = 60.0) -> np.ndarray:
    return level * np.cos(2 * np.pi * hz * np.arange(round(seconds * RATE_HZ)) / RATE_HZ + 0.4)


def lines_of(window: int) -> Lines:
    return Lines.of_bins(GRIDS[window], window, RATE_HZ)


def valid_in_run(
    signals: dict[str, np.ndarray], window: int, path: Path, *options: str
) -> tuple[np.ndarray, list[dict]]:
    """Whether each line is ever valid, and the events."""
    log, lines = (
        write_parquet(path / "log.parquet", signals),
        ",".join(f"{f:.9g}" for f in lines_of(window).frequency_hz),
    )
    roles = ("--excitation", "w", "--input", "u", "--output", "y")
    shown = livebode(
        "run", log, "--rate", RATE_HZ, *roles, "--lines", lines, "--window", window, *options, "--out", path / "run"
    )  # fmt: skip
    assert shown.code == 0, shown.err
    table = pq.read_table(path / "run" / "responses.parquet")
    valid, f = (np.array(table[name].to_pylist()) for name in ("valid", "frequency_hz"))
    events = [json.loads(line) for line in (path / "run" / "events.jsonl").read_text().splitlines()]
    return np.array([valid[f == hz].any() for hz in np.unique(f)]), events


@pytest.mark.parametrize(
    ("parts_s", "hz", "into", "window", "options"),
    [
        ((3, 6), 50.0, "input", 100, ("--average",)),
        ((1.1, 5, 2.2), 49.9, "output", 100, ("--average",)),  # at the end of the recording
        ((0, 4, 3, 4), 120.0, "both", 100, ()),
        ((3, 6), 50.1, "output", 130, ("--average",)),  # beside a bin
        ((2.5, 6), 50.05, "output", 200, ("--all-periods",)),
    ],
)
def test_hum_that_inspect_names_in_the_silence_makes_its_lines_invalid_in_the_whole_run(
    parts_s: tuple[float, ...], hz: float, into: str, window: int, options: tuple[str, ...], tmp_path: Path
) -> None:
    signals = machine(parts_s, mains(0.05, hz), into, window, seed=1)
    silent = np.flatnonzero(signals["w"] == 0)
    longest = max(np.split(silent, np.flatnonzero(np.diff(silent) > 1) + 1), key=len)
    tones = find_hum({name: signals[name][longest] for name in "uy"}, RATE_HZ)
    named = disturbed_lines(tones, lines_of(window)).any(axis=0)
    assert np.count_nonzero(named) == 1
    valid, events = valid_in_run(signals, window, tmp_path, *options)
    np.testing.assert_array_equal(valid, ~named)
    assert [event["details"]["line_hz"] for event in events if event["kind"] == "hum"] == pytest.approx(
        lines_of(window).frequency_hz[named]
    )


def test_silence_without_hum_costs_no_line(tmp_path: Path) -> None:
    """40 machines, of which each is taken for one with hum by chance less than once in a million."""
    for seed in range(39):
        signals = machine((3, 4, 3), 0.0, "input", 100, seed)
        assert hum_spans(list(silent_stretches(signals)), lines_of(100), average=False) == []
    valid, _ = valid_in_run(machine((3, 4, 3), 0.0, "input", 100, seed=39), 100, tmp_path)
    assert valid.all()


def silent_stretches(signals: dict[str, np.ndarray]) -> list[SilentStretch]:
    search = SilenceSearch(3, RATE_HZ, (1 << 20,))
    data = np.array(list(signals.values()))
    found = list(search.process(data, data[0], 0, np.zeros(0, dtype=np.intp)))
    return found + list(search.interrupt())


def tracked(
    signals: dict[str, np.ndarray], cuts: list[int], *, killed: bool = False
) -> tuple[Responses, list[Event], Tracker]:
    """Samples in pieces; `killed`: each piece goes to a new tracker that continues from the state of the one before."""
    tracker = Tracker(Settings(lines=lines_of(100), output="y", input="u", excitation="w"))
    data, events, found = np.array(list(signals.values())), list[Event](), list[Responses]()
    for start, stop in pairwise([0, *cuts, data.shape[1]]):
        if killed:
            state, tracker = tracker.snapshot(), Tracker(tracker.settings)
            tracker.restore(state)
        found.append(tracker.process(Block(data[:, start:stop], CHANNELS, RATE_HZ, start=start), events.append))
    tracker.finish(events.append)
    return Responses.join(found), events, tracker


@given(st.lists(st.integers(1, 9_999), max_size=6, unique=True), st.booleans())
@example(cuts=[1_000, 1_999], killed=True)
@settings(max_examples=10, deadline=None)
def test_a_live_run_finds_faint_hum_in_silence_however_its_samples_arrive_and_it_is_killed(
    cuts: list[int], killed: bool
) -> None:
    signals = machine((3, 3, 2.5, 1.5), mains(0.04, 50.0), "output", 100, seed=2)
    responses, events, tracker = tracked(signals, sorted(cuts), killed=killed)
    assert [(event.kind, event.sample, event.details["line_hz"]) for event in events] == [("hum", 1999, 50.0)]
    at_50 = lines_of(100).frequency_hz == 50
    assert not responses.valid[:, at_50].any()
    assert responses.valid[-1, ~at_50].all()
    assert tracker.found()["judged"]["invalid_lines_hz"] == {"hum": [50.0]}


@pytest.mark.parametrize(("later_s", "kinds"), [(9, ["hum", "hum-gone"]), (3, ["hum"])])
def test_a_silence_four_times_as_long_withdraws_hum_that_it_does_not_show(later_s: float, kinds: list[str]) -> None:
    hum = mains(0.05, 50.0)
    hum[6000:] = 0
    signals = machine((2.1, 4, later_s, 2), hum, "output", 100, seed=3)
    responses, events, _ = tracked(signals, [])
    assert [event.kind for event in events] == kinds
    assert responses.valid[-1, GRIDS[100].index(5)] == ("hum-gone" in kinds)
    spans = hum_spans(silent_stretches(signals), lines_of(100), average=False)
    assert [(span.first, span.stop) for span in spans] == [(0, 6101 if len(kinds) == 2 else None)]


@pytest.mark.parametrize(("stop", "continues"), [(15_999, True), (17_000, False)])
def test_a_state_contains_the_silence_up_to_its_last_look_and_not_for_days(stop: int, continues: bool) -> None:
    search, signals = SilenceSearch(2, RATE_HZ, (2_000, 16_000)), np.random.default_rng(6).standard_normal((2, stop))
    list(search.process(signals, np.zeros(stop), 0, np.zeros(0, dtype=np.intp)))
    assert (len(search.snapshot()) > signals.nbytes) == continues
    assert continues or len(search.snapshot()) < 500
    after = SilenceSearch(2, RATE_HZ, (2_000, 16_000))
    after.restore(search.snapshot())
    more = np.tile(signals, 2)[:, :4_000]
    looked = list(after.process(more, np.zeros(4_000), stop, np.zeros(0, dtype=np.intp)))
    expected = [(0, 16_000), (16_000, 18_000)] if continues else [(17_000, 19_000)]
    assert [(one.first, one.stop) for one in looked] == expected


def test_a_restored_tracker_knows_the_hum() -> None:
    signals = machine((3, 1), mains(0.05, 50.0), "output", 100, seed=4)
    _, _, before = tracked(signals, [])
    after = Tracker(before.settings)
    after.restore(before.snapshot())
    assert after.found()["judged"]["invalid_lines_hz"] == {"hum": [50.0]}


@pytest.mark.parametrize("multiple", [1, 3])
def test_hum_of_a_mains_that_drifts_is_found_in_a_long_silence(multiple: int) -> None:
    rng, t = np.random.default_rng(5), np.arange(60_000) / RATE_HZ
    hz = multiple * (50 + 0.1 * np.sin(2 * np.pi * t / 40))
    y = 2.0 * np.cos(2 * np.pi * np.cumsum(hz) / RATE_HZ) + rng.standard_normal(t.size)
    assert [round(hum.frequency_hz / 50) for hum in find_hum({"y": y}, RATE_HZ)] == [multiple]
