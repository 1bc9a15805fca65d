"""The run of a recording is small, more so of a long one, and has the same mean; the full rate is there on request."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import livebode
from livebode.preparation.plan import RECORDED_VALUES_MAX
from tests.support.command import livebode as command

RATE_HZ, WINDOW, PERIODS = 4000, 400, 4000
LINES = np.arange(2, 37)


def recorded(folder: Path, periods: int = PERIODS) -> Path:
    """A gain of 2 − 1j with noise, at 35 lines."""
    n, rng = np.arange(WINDOW), np.random.default_rng(1)
    phases = 2 * np.pi * rng.uniform(size=LINES.size)
    w = sum(np.cos(2 * np.pi * k * n / WINDOW + p) for k, p in zip(LINES, phases))
    y = sum(np.abs(2 - 1j) * np.cos(2 * np.pi * k * n / WINDOW + p + np.angle(2 - 1j)) for k, p in zip(LINES, phases))
    noise = 0.1 * rng.standard_normal(WINDOW * periods)
    table = {"w": np.tile(w, periods), "y": np.tile(y, periods) + noise, "x": np.linspace(0, 1, WINDOW * periods)}
    pq.write_table(pa.table(table), folder / "log.parquet")
    return folder / "log.parquet"


def test_a_long_recording_has_fewer_responses_by_default_and_the_same_mean(tmp_path: Path) -> None:
    log = recorded(tmp_path)
    roles = ("--input", "w", "--output", "y", "--estimator", "direct", "--rate", RATE_HZ, "--window", WINDOW)
    lines = ("--lines", "20:360:10")
    short, full = tmp_path / "short", tmp_path / "full"
    done = command("run", log, *roles, *lines, "--out", short)
    assert done.code == 0, done.err
    assert "a response every 200 samples, so that the run is small; --hop 100 gives the usual number" in " ".join(
        done.err.split()
    )
    asked = command("run", log, *roles, *lines, "--hop", 20, "--out", full)
    assert "the recording is long" not in asked.err
    few, all_ = livebode.Run(short), livebode.Run(full)
    assert (few.summary["found"]["hop"], all_.summary["found"]["hop"]) == (200, 20)
    assert len(few.responses) * LINES.size <= RECORDED_VALUES_MAX < len(all_.responses) * LINES.size
    (event,) = (event for event in few.events if event.kind == "long-recording")
    assert (event.details["hop"], event.details["usual"]) == (200, 100)
    assert np.all(np.abs(few.average.value - all_.average.value) < 0.2 * all_.average.sigma)
    assert np.allclose(few.average.sigma, all_.average.sigma, rtol=0.1)


def test_a_recording_has_four_responses_in_a_window_by_default(tmp_path: Path) -> None:
    roles = ("--input", "w", "--output", "y", "--estimator", "direct", "--rate", RATE_HZ, "--window", WINDOW)
    done = command("run", recorded(tmp_path, 20), *roles, "--lines", "20:360:10", "--out", tmp_path / "run")
    assert "the recording is long" not in done.err
    assert livebode.Run(tmp_path / "run").summary["found"]["hop"] == WINDOW // 4


def test_the_time_resolution_of_a_machine_that_moves_is_not_reduced(tmp_path: Path) -> None:
    roles = ("--input", "w", "--output", "y", "--estimator", "direct", "--rate", RATE_HZ, "--window", WINDOW)
    options = ("--lines", "20:360:10", "--schedule", "x", "--out", tmp_path / "run")
    assert command("run", recorded(tmp_path), *roles, *options).code == 0
    assert livebode.Run(tmp_path / "run").summary["found"]["hop"] == 20
