"""Recordings whose channels have clocks of their own, or a clock that jitters, run without options but the names."""

from __future__ import annotations

import json
from pathlib import Path

import asammdf
import numpy as np
import pytest

from livebode.configuration import Axis
from livebode.core import ConfigError, LivebodeError, RecordingError
from livebode.records import RunRecord
from livebode.runtime import Destination, run
from livebode.simulation.two_mass_loop import RATE_HZ, TwoMassLoop, TwoMassPlant
from studies.uneven import LINES, NOISE, multisine, ticks
from tests.support.command import livebode
from tests.support.errors import refused
from tests.support.ulog_file import ulog_file

PERIODS = 40
RATES_HZ = {"w": 1000.0, "u": 400.0, "y": 250.0}
UNITS = {"w": "N m", "u": "N m", "y": "rad/s"}
NAMES = {"excitation": "w", "input": "u", "output": "y"}
Stamped = dict[str, tuple[np.ndarray, np.ndarray]]


def stamped(same: bool = False, jitter: float = 0.45, seed: int = 1) -> Stamped:
    """Times and samples of w, u and y of the two masses in closed loop, at clocks of their own or at one."""
    rng = np.random.default_rng(seed)
    period = multisine(LINES)
    period *= 0.5 / np.std(period)
    u, y = TwoMassLoop().run(period, PERIODS, NOISE, seed=seed)
    signals = {"w": np.tile(period, PERIODS), "u": u[0], "y": y[0]}
    one = ticks(RATES_HZ["w"], jitter, 0.0, u.size, rng)
    clocks = {name: one if same else ticks(rate, jitter, 0.0, u.size, rng) for name, rate in RATES_HZ.items()}
    return {name: (at / RATE_HZ, signals[name][at]) for name, at in clocks.items()}


def write_csv(path: Path, channels: Stamped) -> Path:
    rows = np.column_stack([channels["w"][0], *(values for _, values in channels.values())])
    np.savetxt(path, rows, "%.17g", ",", header="time [s],w [N m],u [N m],y [rad/s]", comments="")
    return path


def write_ulog(path: Path, channels: Stamped) -> Path:
    topics = {
        f"topic_{name}": {"timestamp": np.rint(1e6 * (time + 20)).astype(np.uint64), name: values}
        for name, (time, values) in channels.items()
    }
    path.write_bytes(ulog_file(topics))
    return path


def write_mdf(path: Path, channels: Stamped) -> Path:
    with asammdf.MDF(version="4.10") as file:
        for name, (time, values) in channels.items():
            file.append([asammdf.Signal(values, time, name=name, unit=UNITS[name])])
        file.save(path, overwrite=True)
    return path


def ran(log: Path, **sections: dict[str, object]) -> RunRecord:
    axis = Axis.of({"source": {"log": log}, "signals": NAMES} | sections, "the test")
    out = log.parent / f"run{len(list(log.parent.iterdir()))}"
    run(axis, Destination(out, lambda *_: None))
    return RunRecord.open(out)


def events(record: RunRecord, kind: str) -> list[dict]:
    found = [json.loads(line) for line in (record.path / "events.jsonl").read_text("utf-8").splitlines()]
    return [event for event in found if event["kind"] == kind]


def check_truth(record: RunRecord) -> None:
    """63 % and 98 % of the errors are within their bounds, less 4 standard deviations of 7 separate windows × 10 lines."""
    found = record.responses()
    truth = TwoMassPlant().response(found.lines.frequency_hz)
    judged = found.valid & (found.dof[:, np.newaxis] > 5)
    error = np.abs(found.value - truth)
    assert judged.sum() > 500
    assert np.mean((error < found.bound(1.0))[judged]) > 0.40
    assert np.mean((error < found.bound(2.0))[judged]) > 0.91


@pytest.mark.parametrize(("write", "name", "same"), [
    (write_csv, "log.csv", True), (write_ulog, "log.ulg", False), (write_mdf, "log.mf4", False),
])  # fmt: skip
def test_a_recording_with_jittering_clocks_runs_with_the_names_alone(tmp_path, write, name, same):
    log = write(tmp_path / name, stamped(same))
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
    report = livebode("report", tmp_path / "run")
    assert report.code == 0, report.err


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
