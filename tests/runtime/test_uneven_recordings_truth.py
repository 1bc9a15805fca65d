"""Recordings whose channels have clocks of their own, or a clock that jitters, run without options but the names."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from livebode.configuration import Axis
from livebode.core import ConfigError, LivebodeError, RecordingError
from livebode.records import RunRecord
from livebode.runtime import Destination, RunControl, StoppedError, TrackerResults, run
from livebode.simulation import TwoMassPlant
from tests.support.command import livebode
from tests.support.errors import refused
from tests.support.responses import as_recorded
from tests.support.uneven import LINES, stamped, write_csv, write_mdf, write_ulog

NAMES = {"excitation": "w", "input": "u", "output": "y"}


def ran(log: Path, **sections: dict[str, object]) -> RunRecord:
    axis = Axis.of({"source": {"log": log}, "signals": NAMES} | sections, "the test")
    out = log.parent / f"run{len(list(log.parent.iterdir()))}"
    run(axis, Destination(out, lambda *_: None))
    return RunRecord.open(out)


def events(record: RunRecord, kind: str) -> list[dict]:
    found = [json.loads(line) for line in (record.path / "events.jsonl").read_text("utf-8").splitlines()]
    return [event for event in found if event["kind"] == kind]


def check_truth(record: RunRecord) -> None:
    """63 % and 98 % of the errors are within their bounds, less 4 standard deviations of 70 independent errors."""
    found = record.responses()
    truth = TwoMassPlant().response(found.lines.frequency_hz)
    judged = found.valid & (found.dof[:, np.newaxis] > 5)
    error = np.abs(found.value - truth)
    assert judged.sum() > 150
    assert np.mean((error < found.bound(1.0))[judged]) > 0.40
    assert np.mean((error < found.bound(2.0))[judged]) > 0.91


@pytest.mark.parametrize(("write", "name", "same"), [
    (write_csv, "log.csv", True), (write_ulog, "log.ulg", False), (write_mdf, "log.mf4", False),
])  # fmt: skip
def test_a_recording_with_jittering_clocks_runs_with_the_names_alone(tmp_path, write, name, same):
    log = write(tmp_path / name, stamped(same=same))
    roles = [part for role, channel in NAMES.items() for part in (f"--{role}", channel)]
    done = livebode("run", log, *roles, "--out", tmp_path / "run")
    assert done.code == 0, done.err
    record = RunRecord.open(tmp_path / "run")
    np.testing.assert_allclose(record.lines.frequency_hz, LINES.frequency_hz, rtol=1e-6)
    check_truth(record)
    (event,) = events(record, "uneven-clock")
    assert event["message"] in " ".join(done.err.split())
    assert len(event["details"]["clocks"]) == (1 if same else 3)
    seen = livebode("inspect", log, "--excitation", "w", "--output", "y")
    assert seen.code == 0, seen.err
    assert "at times of their own" in seen.out


def test_the_report_of_a_run_states_the_clocks(tmp_path):
    record = ran(
        write_ulog(tmp_path / "log.ulg", stamped()), signals={role: f"topic_{n}.{n}" for role, n in NAMES.items()}
    )
    done = livebode("report", record.path)
    assert done.code == 0, done.err
    assert "sampled at times of their own" in (record.path / "report.html").read_text("utf-8")


def test_lines_and_window_may_be_specified_in_samples_of_the_reference(tmp_path):
    log = write_mdf(tmp_path / "log.mf4", stamped())
    record = ran(log, lines={"frequencies": "20:110:10", "window": 300}, tracking={"average": True, "hop": 150})
    assert (record.found["rate_hz"], record.found["window"], record.found["hop"]) == (1000, 300, 150)
    newest = record.responses()[-1]
    assert np.all(np.abs(newest.value - TwoMassPlant().response(LINES.frequency_hz)) < newest.bound(2.5))


def test_a_part_counts_periods_and_seconds_of_the_reference(tmp_path):
    log = write_mdf(tmp_path / "log.mf4", stamped())
    lines = {"frequencies": "20:110:10", "window": 300}
    record = ran(log, source={"log": log, "from": 1.0, "to": 3.0}, lines=lines)
    found = record.responses()
    assert found.time_s.min() > 1.1
    assert found.time_s.max() < 2.9
    second = ran(log, source={"log": log, "skip_periods": 2}, lines=lines).responses()
    assert second.first.min() >= 600


def test_a_run_that_was_recorded_in_segments_is_the_same(tmp_path):
    log = write_csv(tmp_path / "log.csv", stamped(same=True))
    one, two = ran(log), ran(log, record={})
    np.testing.assert_array_equal(one.responses().value, two.responses().value)


def test_a_run_that_was_stopped_continues_with_the_same_responses(tmp_path):
    log = write_csv(tmp_path / "log.csv", stamped(same=True))
    control, seen = RunControl(), []

    def stop(document: object) -> None:
        seen.append(isinstance(document, TrackerResults))
        if sum(seen) == 2:
            control.end()

    axis = Axis.of({"source": {"log": log}, "signals": NAMES, "record": {"segment_s": 0.5}}, "the test")
    with pytest.raises(StoppedError):
        run(axis, Destination(tmp_path / "stopped", lambda *_: None, subscribers=(stop,)), control)
    begun = RunRecord.open(tmp_path / "stopped").responses()
    assert 0 < len(begun) < 300
    run(axis, Destination(tmp_path / "stopped", lambda *_: None))
    found, whole = RunRecord.open(tmp_path / "stopped").responses(), ran(log).responses()
    np.testing.assert_array_equal(found.sample, whole.sample)
    np.testing.assert_array_equal(as_recorded(found).sigma, whole.sigma)


def test_regular_clocks_of_different_rates_are_read_together(tmp_path):
    """1000, 400 and 250 Hz without jitter; one stays as it is."""
    record = ran(write_mdf(tmp_path / "log.mf4", stamped(jitter=0.0)))
    assert len(events(record, "uneven-clock")) == 1
    check_truth(record)


def test_a_channel_that_pauses_makes_its_windows_invalid_with_the_reason(tmp_path):
    channels = stamped()
    time, values = channels["y"]
    kept = (time < 2) | (time > 3)
    record = ran(write_mdf(tmp_path / "log.mf4", channels | {"y": (time[kept], values[kept])}))
    (first, *_) = events(record, "not-whole")
    assert "too few samples of a channel" in first["message"]
    found = record.responses()
    assert not found.valid[(found.time_s > 2.2) & (found.time_s < 2.8)].any()
    assert found.valid[found.time_s > 3.4].all()


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (lambda t: np.where(np.arange(t.size) == 700, t[699], t), "time-not-increasing"),
        (lambda t: np.where(np.arange(t.size) == 700, t[690], t), "time-not-increasing"),
        (lambda t: np.where(np.arange(t.size) == 700, np.nan, t), "time-not-finite"),
        (lambda t: t + 100, "clocks-apart"),
    ],
    ids=["repeated", "backward", "not finite", "without common time"],
)
def test_times_that_are_no_clock_are_refused(tmp_path, spoil, code):
    channels = stamped()
    time, values = channels["y"]
    log = write_mdf(tmp_path / "log.mf4", channels | {"y": (spoil(time), values)})
    with refused(RecordingError, code, path=str(log)):
        ran(log)


@pytest.mark.parametrize(
    ("sections", "key"),
    [
        ({"tracking": {"hann": True}}, "tracking.hann"),
        ({"tracking": {"estimator": "lpm"}}, "tracking.estimator"),
        ({"tracking": {"spikes": ["y"]}}, "tracking.spikes"),
        ({"tracking": {"dtype": "float32"}}, "tracking.dtype"),
        ({"record": {"samples": True}}, "record.samples"),
    ],
)
def test_settings_that_need_regular_samples_are_refused(tmp_path, sections, key):
    log = write_csv(tmp_path / "log.csv", stamped(same=True))
    with refused(ConfigError, "needs-even-samples", key=key):
        ran(log, **sections)


def test_differences_of_uneven_samples_are_refused(tmp_path):
    log = write_csv(tmp_path / "log.csv", stamped(same=True))
    with pytest.raises(LivebodeError, match="regular times"):
        ran(log, signals=NAMES | {"output": "diff(y)"})


def test_an_expression_of_one_clock_is_computed(tmp_path):
    log = write_csv(tmp_path / "log.csv", stamped(same=True))
    plain, turned = (
        ran(log, signals=NAMES | {"output": name}, tracking={"accept_roles": True}) for name in ("y", "-2*y")
    )
    np.testing.assert_allclose(turned.responses().value, -2 * plain.responses().value, rtol=1e-9)


def burst_times(rng: np.random.Generator, mean_s: float, seconds: float) -> np.ndarray:
    """Clusters of samples and pauses: the standard deviation of the steps is about twice their median."""
    count = int(2 * seconds / mean_s)
    steps = np.where(rng.uniform(size=count) < 0.8, rng.uniform(0.3, 1.2, count), rng.exponential(3.0, count))
    time = np.cumsum(0.7 * mean_s * steps)
    return time[time < seconds]


@pytest.mark.parametrize("period_s", [0.5001234, 0.25])
def test_lines_and_period_are_found_at_clocks_of_bursts_and_pauses(tmp_path, period_s):
    """A first-order lag behind a multisine whose period is on the grid of no clock; 63 %, less 4σ of 100 errors."""
    rng = np.random.default_rng(7)
    bins = np.array([1, 2, 3, 5, 8])
    phases, lag = rng.uniform(0, 2 * np.pi, bins.size), 1 / (1 + 1j * bins / period_s / 20)
    tones = {"u": np.exp(1j * phases), "y": lag * np.exp(1j * phases)}
    times = {"u": burst_times(rng, 0.004, 30.0), "y": burst_times(rng, 0.006, 30.0)}
    channels = {
        name: (
            t,
            (np.exp(2j * np.pi * np.outer(t, bins) / period_s) @ tones[name]).real + 0.02 * rng.normal(size=t.size),
        )
        for name, t in times.items()
    }
    record = ran(
        write_mdf(tmp_path / "log.mf4", channels),
        signals={"input": "u", "output": "y"},
        tracking={"estimator": "direct"},
    )
    np.testing.assert_allclose(record.lines.frequency_hz * period_s, bins, rtol=1e-4)
    found = record.responses()
    judged = found.valid & (found.dof[:, np.newaxis] > 3)
    error = np.abs(found.value - lag)
    assert found.valid.mean() > 0.8
    assert np.mean((error < found.bound(1.0))[judged]) > 0.44
    assert np.mean((error < found.bound(2.0))[judged]) > 0.92
