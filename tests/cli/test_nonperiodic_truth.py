"""Recordings of chirps and noise from the command line, and refusals that name the estimator for them."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import chirp, lfilter

from livebode.core import Channel
from livebode.records import RESPONSES
from livebode.sources.live import Batch, encode_line
from tests.support.command import RATE_HZ, livebode, write_parquet
from tests.support.live_runs import started, table
from tests.support.peers.peer import PATIENCE_S

SAMPLES = 6000
ROLES = ("--excitation", "w", "--input", "u", "--output", "y")
GAIN, POLE = 0.2, 0.9  # y(n) = 0.9·y(n − 1) + 0.2·u(n − 1), under u = w − 0.5·y


@cache
def columns(kind: str) -> dict[str, np.ndarray]:
    rng, t = np.random.default_rng(1), np.arange(SAMPLES) / RATE_HZ
    w = rng.standard_normal(SAMPLES) if kind == "noise" else np.pad(chirp(t[:-1200], 10.0, t[-1201], 200.0), 600)
    v = 0.01 * rng.standard_normal(SAMPLES)
    closed = [1.0, 0.5 * GAIN - POLE]
    y = lfilter([0.0, GAIN], closed, w) + lfilter([1.0, -POLE], closed, v)
    return {"time [s]": t, "w": w, "u": w - 0.5 * y, "y": y}


def plant(frequency_hz: np.ndarray) -> np.ndarray:
    z = np.exp(2j * np.pi * frequency_hz / RATE_HZ)
    return np.asarray(GAIN / (z - POLE))


def log(folder: Path, kind: str) -> Path:
    return write_parquet(folder / f"{kind}.parquet", columns(kind))


def tracked(folder: Path, kind: str, *options: object) -> tuple[dict, dict[str, np.ndarray]]:
    done = livebode("run", log(folder, kind), *ROLES, *options, "--json", "--out", folder / "run")
    assert done.code == 0, done.err
    return json.loads(done.out), table(folder / "run")


@pytest.mark.parametrize("estimator", ["lpm", "welch"])
def test_a_chirp_gives_one_response_at_the_excited_bins(tmp_path: Path, estimator: str) -> None:
    summary, rows = tracked(tmp_path, "chirp", "--estimator", estimator)
    f, valid = rows["frequency_hz"], rows["valid"]
    assert summary["counts"]["responses"] == 1
    assert summary["found"]["span"] == 6000
    assert np.mean(valid) > 0.95
    assert 5 < f[0] < 14
    assert 190 < f[-1] < 210
    error = np.abs(rows["re"] + 1j * rows["im"] - plant(f))[valid]
    if estimator == "lpm":  # the bounds of welch do not contain its bias
        assert np.mean(error < 2 * rows["sigma"][valid]) > 0.9
    assert np.median(error / np.abs(plant(f))[valid]) < 0.05


def noise_on_lines(folder: Path) -> dict[str, np.ndarray]:
    options = "--estimator", "lpm", "--lines", "20:100:7.03", "--window", 512, "--hop", 512
    return tracked(folder, "noise", *options)[1]


def test_lines_are_rounded_to_bins_and_no_baseline_is_learned(tmp_path: Path) -> None:
    rows = noise_on_lines(tmp_path)
    found = np.unique(rows["frequency_hz"])
    np.testing.assert_allclose(found, np.arange(20, 100.01, 7.03), atol=RATE_HZ / 512 / 2)
    np.testing.assert_allclose(found % (RATE_HZ / 512), 0)
    done = livebode("learn", tmp_path / "run", "--out", tmp_path / "baseline.json")
    assert done.code == 2
    assert "a baseline needs an excitation that repeats" in done.err


def test_the_longest_stretch_without_gap_is_taken(tmp_path: Path) -> None:
    damaged = {name: x.copy() for name, x in columns("noise").items()}
    damaged["y"][1500] = np.nan
    path = write_parquet(tmp_path / "log.parquet", damaged)
    done = livebode("run", path, *ROLES, "--estimator", "lpm", "--json", "--out", tmp_path / "run")
    summary, rows = json.loads(done.out), table(tmp_path / "run")
    assert summary["found"]["window"] == 4499
    assert rows["first_sample" if "first_sample" in rows else "first"][rows["valid"]].min() == 1501


def test_a_window_longer_than_every_stretch_is_one_sentence(tmp_path: Path) -> None:
    damaged = {name: x.copy() for name, x in columns("noise").items()}
    damaged["y"][1000::1000] = np.nan
    path = write_parquet(tmp_path / "log.parquet", damaged)
    done = livebode("run", path, *ROLES, "--estimator", "lpm", "--window", 2000, "--out", tmp_path / "run")
    assert done.code == 2
    assert "the longest stretch without gaps and samples that are not finite has 1000 samples" in done.err
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("chirp", ()),
        ("noise", ()),
        ("noise", ("--lines", "20:140:20", "--window", 500)),
        ("chirp", ("--lines", "20:140:20", "--window", 100, "--estimator", "direct")),
        ("noise", ("--lines", "20:140:20", "--window", 100, "--accept-roles")),
    ],
    ids=["auto-chirp", "auto-noise", "window", "direct", "accepted"],
)
def test_estimators_for_a_periodic_excitation_name_the_one_that_works(
    tmp_path: Path, kind: str, options: tuple[object, ...]
) -> None:
    done = livebode("run", log(tmp_path, kind), *ROLES, *options, "--out", tmp_path / "run")
    assert done.code == 2
    assert "--estimator lpm" in done.err


def test_a_direct_run_on_a_chirp_whose_roles_are_accepted_is_hardly_valid_and_names_the_one_that_works(
    tmp_path: Path,
) -> None:
    options = "--lines", "20:140:20", "--window", 100, "--hop", 100, "--estimator", "direct", "--accept-roles"
    done = livebode("run", log(tmp_path, "chirp"), *ROLES, *options, "--out", tmp_path / "run")
    assert "--estimator lpm" in done.err
    assert done.code == 0
    assert table(tmp_path / "run")["valid"].mean() < 0.15


@pytest.mark.parametrize(("kind", "estimator"), [("chirp", "lpm"), ("noise", "lpm"), ("periodic", "joint")])
def test_inspect_names_the_estimator(tmp_path: Path, kind: str, estimator: str) -> None:
    path = log(tmp_path, kind) if kind != "periodic" else None
    if path is None:
        w = np.resize(columns("noise")["w"][:500], SAMPLES)
        path = write_parquet(tmp_path / "log.parquet", {"time [s]": columns("noise")["time [s]"], "w": w, "y": w})
    done = livebode("inspect", path, "--excitation", "w")
    assert done.code == 0
    assert f"--estimator {estimator}" in done.out
    assert json.loads(livebode("inspect", path, "--excitation", "w", "--json").out)["estimator"] == estimator


AXIS = """
[signals]
output = "y"
input = "u"
excitation = "w"
[lines]
frequencies = "20:140:20"
window = 400
[tracking]
estimator = "lpm"
hop = 100
"""


def test_a_live_source_gives_what_its_recording_gives(tmp_path: Path) -> None:
    channels = tuple(map(Channel, "wuy"))
    data = np.array([columns("noise")[name] for name in "wuy"])
    live, recorded = tmp_path / "live.toml", tmp_path / "recorded.toml"
    live.write_text('[source]\nurl = "stdin:"' + AXIS)
    recorded.write_text(f'[source]\nlog = "{log(tmp_path, "noise")}"' + AXIS)
    sent = [Batch(at, data[:, at : at + 60].copy(), channels, float(RATE_HZ), 9) for at in range(0, SAMPLES, 60)]
    with started(live, tmp_path / "live") as process:
        _, err = process.communicate(b"".join(map(encode_line, sent)), PATIENCE_S)
    assert (process.returncode, err) == (0, b"")
    assert livebode("run", recorded, "--out", tmp_path / "recorded").code == 0
    ours, theirs = table(tmp_path / "live"), table(tmp_path / "recorded")
    for name in theirs:
        values = ours[name].astype(np.float32) if name in RESPONSES.rounded else ours[name]
        np.testing.assert_array_equal(values, theirs[name], err_msg=name)


def test_motion_correction_of_an_excitation_that_does_not_repeat_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "axis.toml"
    path.write_text(f'[source]\nlog = "{log(tmp_path, "noise")}"' + AXIS + "[motion]\nradius_m = 0.1\n")
    done = livebode("run", path, "--out", tmp_path / "run")
    assert done.code == 2
    assert "[motion] needs an excitation that repeats" in done.err


def test_a_machine_that_changes_under_noise_is_reported(tmp_path: Path) -> None:
    """The gain grows by 10 %, which its average contains; the error of one window is some 2 %."""
    recorded = columns("noise")
    changing = recorded | {"y": recorded["y"] * (1 + 0.1 * np.arange(SAMPLES) / SAMPLES)}
    file = write_parquet(tmp_path / "changing.parquet", changing)
    options = "--estimator", "lpm", "--lines", "20:100:7", "--window", 256, "--average", "--forgetting", 1
    open_loop = "--input", "u", "--output", "y"
    done = livebode("run", file, *open_loop, *options, "--json", "--out", tmp_path / "run")
    assert done.code == 0, done.err
    drift = json.loads(done.out)["drift"]
    assert drift["found"]
    assert drift["components"][0]["kind"] == "trend"
    assert "the response drifts during the recording" in done.err
