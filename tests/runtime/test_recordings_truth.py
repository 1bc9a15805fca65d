"""A run on several recordings: each is tracked as by itself, the run's mean is that of all, and each file is named."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import livebode as lb
from livebode.configuration import Axis
from livebode.core import ConfigError, Lines, RecordingError, SignalError
from livebode.excitation import multisine
from livebode.runtime import Destination, run
from livebode.sources import open_log
from tests.support.command import livebode, write_parquet

RATE_HZ, WINDOW = 1000.0, 100
LINES = Lines.of_bins((2, 3, 5, 7, 8, 11, 13, 17), WINDOW, RATE_HZ)
PLANT = 2 / LINES.z
ROLES = ("--excitation", "w", "--input", "u", "--output", "y")


def columns(seed: int, noise: float = 0.05, *, phases: int | None = None, cube: float = 0.0) -> dict[str, np.ndarray]:
    """Twelve periods of y = 2·u + cube·u³, a sample late, with noise in u and y."""
    w = multisine(LINES, 1.0, "schroeder" if phases is None else phases_of(phases))
    w, rng = np.tile(w, 12), np.random.default_rng(seed)
    u = w + noise * rng.standard_normal(w.size)
    late = np.roll(u, 1)
    y = 2 * late + cube * late**3 + noise * rng.standard_normal(w.size)
    return {"t": np.arange(w.size) / RATE_HZ, "w": w, "u": u, "y": y}


def phases_of(seed: int) -> Any:
    return np.random.default_rng(seed).uniform(0, 2 * np.pi, len(LINES))


def axis(logs: list[Path], **sections: dict[str, Any]) -> Axis:
    given: dict[str, dict[str, Any]] = {
        "source": {"log": logs},
        "signals": {"output": "y", "input": "u", "excitation": "w"},
        "tracking": {"hop": 20},
    }
    merged = given | {name: given.get(name, {}) | values for name, values in sections.items()}
    return Axis.of(merged, "test")


def tracked(logs: list[Path], out: Path, **sections: dict[str, Any]) -> lb.Run:
    return lb.Run(run(axis(logs, **sections), Destination(out, lambda *_: None)).directory)


@pytest.fixture
def logs(tmp_path: Path) -> list[Path]:
    return [write_parquet(tmp_path / f"{i}.parquet", columns(i, noise)) for i, noise in enumerate((0.02, 0.1, 0.02))]


def test_each_recording_is_tracked_as_in_a_run_of_its_own_and_named(logs: list[Path], tmp_path: Path) -> None:
    together = tracked(logs, tmp_path / "all")
    recordings = together.summary["found"]["recordings"]
    for log, recording in zip(logs, recordings, strict=True):
        assert recording["file"] == str(log)
        assert recording["sha256"] == hashlib.sha256(log.read_bytes()).hexdigest()
        assert recording["stop"] - recording["first"] == 1200
        rows = together.responses
        rows = rows[np.flatnonzero((rows.first >= recording["first"]) & (rows.sample < recording["stop"]))]
        alone = tracked([log], tmp_path / log.stem).responses
        alone = alone[np.flatnonzero(alone.first >= 0)]
        assert np.array_equal(rows.value, alone.value, equal_nan=True)
        assert np.array_equal(rows.sigma, alone.sigma, equal_nan=True)
        assert np.array_equal(rows.sample - rows.sample[0], alone.sample - alone.sample[0])
    assert together.summary["counts"]["gaps"] == 0
    assert together.summary["counts"]["samples"] == 3600


def test_the_mean_of_the_run_is_that_of_all_recordings(logs: list[Path], tmp_path: Path) -> None:
    together = tracked(logs, tmp_path / "all")
    mean, quiet = together.average, tracked(logs[:1], tmp_path / "one").average
    # By the noise alone 1/√2 with two quiet ones; the scatter of three recordings adds to it.
    assert 0.6 < np.median(mean.sigma / quiet.sigma) < 1.0
    assert np.all(np.abs(mean.value - PLANT) < mean.bound(2.5))
    between = together.summary["between"]
    assert (between["recordings"], between["realisations"], between["differs"]) == (3, False, False)
    assert [event.kind for event in together.events] == []
    done = livebode("export", tmp_path / "all", "--to", "csv", "--mean", "--out", tmp_path / "mean.csv")
    assert done.code == 0, done.err
    exported = open_log(tmp_path / "mean.csv", rate_hz=1, time="none")
    assert next(exported.blocks(["re"]))["re"] == pytest.approx(mean.value.real, rel=1e-9)


def test_a_machine_that_changed_between_recordings_is_reported(tmp_path: Path) -> None:
    parts = [columns(i) for i in range(3)]
    parts[2]["y"] = 1.1 * parts[2]["y"]
    logs = [write_parquet(tmp_path / f"{i}.parquet", part) for i, part in enumerate(parts)]
    found = tracked(logs, tmp_path / "run")
    (event,) = found.events
    assert event.kind == "recordings-differ"
    assert event.message.startswith("the 3 recordings differ by more than their noise: by -2")
    mean = found.average
    assert np.all(mean.sigma > 0.03 * np.abs(mean.value))


def test_realisations_give_the_best_linear_approximation(tmp_path: Path) -> None:
    logs = [write_parquet(tmp_path / f"{i}.parquet", columns(i, 0.005, phases=i, cube=0.002)) for i in range(5)]
    done = livebode(
        "run", *logs, *ROLES, "--lines", "20,30,50,70,80,110,130,170", "--window", 100, "--out", tmp_path / "run"
    )
    assert done.code == 0, done.err
    assert "best linear approximation of 5 realisations: stochastic distortion" in " ".join(done.err.split())
    summary = json.loads((tmp_path / "run" / "run.json").read_text())
    assert summary["found"]["realisations"] is True
    assert summary["between"]["differs"] is True
    mean = lb.Run(tmp_path / "run").average
    assert mean.dof == 4
    assert mean.sigma == pytest.approx(summary["between"]["total_sigma"])
    assert np.all(np.array(summary["between"]["noise_sigma"]) < mean.sigma)


def test_the_same_excitation_with_a_delay_is_no_other_realisation(tmp_path: Path) -> None:
    parts = [columns(i) for i in range(2)]
    later = {name: np.roll(x, 37) if name != "t" else x for name, x in parts[1].items()}
    logs = [write_parquet(tmp_path / f"{i}.parquet", part) for i, part in enumerate((parts[0], later))]
    assert tracked(logs, tmp_path / "run").summary["found"]["realisations"] is False


def test_limits_transients_and_outlying_periods_are_those_of_each_recording(tmp_path: Path) -> None:
    parts = [columns(i, 0.01) for i in range(2)]
    parts[0]["y"][:100] += 3 * np.exp(-np.arange(100) / 20)
    parts[1]["y"][750:780] += 2.0
    logs = [write_parquet(tmp_path / f"{i}.parquet", part) for i, part in enumerate(parts)]
    found = tracked(logs, tmp_path / "run")
    assert [recording["left_out_samples"] for recording in found.summary["found"]["recordings"]] == [100, 0]
    messages = {event.kind: event for event in found.events}
    assert messages["transient"].message.startswith("in 0.parquet: the first period differs")
    outlying = messages["outlying-periods"]
    start = found.summary["found"]["recordings"][1]["first"]
    assert (outlying.details["recording"], outlying.sample) == ("1.parquet", start + 700)
    assert np.all(np.abs(found.average.value - PLANT) < found.average.bound(2.5))
    cut = tracked(logs, tmp_path / "cut", source={"from": "200 samples", "to": "600 samples"})
    assert [r["part"] for r in cut.summary["found"]["recordings"]] == 2 * [{"first": 200, "stop": 600}]
    assert cut.summary["counts"]["samples"] == 800


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"t": lambda x: x * 2}, "differs from {first} in its rate: 500 Hz instead of 1000 Hz"),
        ({"y [V]": "y"}, "differs from {first} in its units: "),
    ],
)
def test_a_recording_that_does_not_fit_is_refused_by_name(tmp_path: Path, change: dict[str, Any], what: str) -> None:
    first, other = columns(0), columns(1)
    for name, by in change.items():
        if callable(by):
            other[name] = by(other[name])
        else:
            other[name] = other.pop(by)
    logs = [write_parquet(tmp_path / f"{i}.parquet", part) for i, part in enumerate((first, other))]
    with pytest.raises(RecordingError) as refused:
        tracked(logs, tmp_path / "run")
    assert str(refused.value).startswith(f"{logs[1]} {what.format(first=logs[0])}")
    assert refused.value.facts["path"] == str(logs[1])
    assert not (tmp_path / "run").exists()


def test_other_lines_and_another_window_are_refused_by_name(tmp_path: Path) -> None:
    first, other = columns(0), columns(1)
    other["w"] = other["w"] + np.cos(2 * np.pi * 19 * np.arange(1200) / WINDOW)
    logs = [write_parquet(tmp_path / f"{i}.parquet", part) for i, part in enumerate((first, other))]
    with pytest.raises(RecordingError, match=r"in its lines: 9 \(only there: 190 Hz\) instead of 8"):
        tracked(logs, tmp_path / "run")


def test_a_channel_that_is_constant_or_missing_in_one_recording_is_refused_by_name(
    logs: list[Path], tmp_path: Path
) -> None:
    write_parquet(tmp_path / "constant.parquet", columns(5) | {"y": np.ones(1200)})
    with pytest.raises(SignalError, match=r"constant.parquet: channel 'y' is constant at 1"):
        tracked([*logs, tmp_path / "constant.parquet"], tmp_path / "run")
    missing = columns(5)
    del missing["u"]
    write_parquet(tmp_path / "missing.parquet", missing)
    with pytest.raises(RecordingError, match=r"missing.parquet: there is no channel 'u'"):
        tracked([*logs, tmp_path / "missing.parquet"], tmp_path / "run")


def test_a_recording_that_is_given_twice_is_refused(logs: list[Path], tmp_path: Path) -> None:
    (tmp_path / "copy.parquet").write_bytes(logs[0].read_bytes())
    with pytest.raises(RecordingError, match=r"copy.parquet has the same content as .*0.parquet; give each recording"):
        tracked([*logs, tmp_path / "copy.parquet"], tmp_path / "run")


@pytest.mark.parametrize(
    ("sections", "key"),
    [
        ({"record": {}}, "record"),
        ({"motion": {"radius_m": 0.02}}, "motion"),
        ({"monitoring": {"baseline": "healthy.json"}}, "monitoring.baseline"),
        ({"source": {"follow": True}}, "source.follow"),
        ({"tracking": {"estimator": "lpm"}}, "tracking.estimator 'lpm'"),
    ],
)
def test_what_needs_one_recording_is_refused(sections: dict[str, Any], key: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=f"{key}.* does not apply to several recordings in one run"):
        axis([tmp_path / "a.csv", tmp_path / "b.csv"], **sections)


def test_a_configuration_lists_recordings_beside_it(logs: list[Path], tmp_path: Path) -> None:
    (tmp_path / "axis.toml").write_text(
        '[source]\nlog = ["0.parquet", "1.parquet"]\n[signals]\noutput = "y"\ninput = "u"\nexcitation = "w"\n'
    )
    done = livebode("run", tmp_path / "axis.toml", "--out", tmp_path / "run")
    assert done.code == 0, done.err
    assert "mean of 2 recordings, which differ by no more than their noise" in done.out
    recordings = lb.Run(tmp_path / "run").summary["found"]["recordings"]
    assert [recording["file"] for recording in recordings] == [str(log) for log in logs[:2]]
    both = livebode("run", tmp_path / "axis.toml", logs[0])
    assert (both.code, both.err.count("\n") > 0) == (2, True)
    assert "a configuration cannot be combined with other arguments" in " ".join(both.err.split())
    checked = livebode("doctor", tmp_path / "axis.toml")
    logs[1].unlink()
    missing = livebode("doctor", tmp_path / "axis.toml")
    assert str(logs[1]) not in checked.out
    assert "there is no recording" in missing.out
