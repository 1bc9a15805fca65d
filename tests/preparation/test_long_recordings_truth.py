"""The run of a long recording is small, says so, and has the same mean; the full rate is there on request."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import livebode
from livebode.preparation.plan import RECORDED_VALUES_MAX
from tests.support.command import livebode as command

RATE_HZ, WINDOW, PERIODS = 4000, 400, 4000
LINES = np.arange(2, 15, 2)


def recorded(folder: Path) -> Path:
    """A gain of 2 − 1j with noise, at seven lines."""
    n, rng = np.arange(WINDOW), np.random.default_rng(1)
    phases = 2 * np.pi * rng.uniform(size=LINES.size)
    w = sum(np.cos(2 * np.pi * k * n / WINDOW + p) for k, p in zip(LINES, phases))
    y = sum(np.abs(2 - 1j) * np.cos(2 * np.pi * k * n / WINDOW + p + np.angle(2 - 1j)) for k, p in zip(LINES, phases))
    noise = 0.1 * rng.standard_normal(WINDOW * PERIODS)
    table = {"w": np.tile(w, PERIODS), "y": np.tile(y, PERIODS) + noise, "x": np.linspace(0, 1, WINDOW * PERIODS)}
    pq.write_table(pa.table(table), folder / "log.parquet")
    return folder / "log.parquet"


def test_a_long_recording_has_fewer_responses_by_default_and_the_same_mean(tmp_path: Path) -> None:
    log = recorded(tmp_path)
    roles = ("--input", "w", "--output", "y", "--estimator", "direct", "--rate", RATE_HZ, "--window", WINDOW)
    lines = ("--lines", "20:140:20")
    short, full = tmp_path / "short", tmp_path / "full"
    done = command("run", log, *roles, *lines, "--out", short)
    assert done.code == 0, done.err
    assert "a response every 25 samples, so that the run is small; --hop 20 gives the usual number" in " ".join(
        done.err.split()
    )
    asked = command("run", log, *roles, *lines, "--hop", 20, "--out", full)
    assert "the recording is long" not in asked.err
    few, all_ = livebode.Run(short), livebode.Run(full)
    assert (few.summary["found"]["hop"], all_.summary["found"]["hop"]) == (25, 20)
    assert len(few.responses) * LINES.size <= RECORDED_VALUES_MAX < len(all_.responses) * LINES.size
    (event,) = (event for event in few.events if event.kind == "long-recording")
    assert (event.details["hop"], event.details["usual"]) == (25, 20)
    assert np.all(np.abs(few.average.value - all_.average.value) < 0.2 * all_.average.sigma)
    assert np.allclose(few.average.sigma, all_.average.sigma, rtol=0.1)


def test_the_time_resolution_of_a_machine_that_moves_is_not_reduced(tmp_path: Path) -> None:
    roles = ("--input", "w", "--output", "y", "--estimator", "direct", "--rate", RATE_HZ, "--window", WINDOW)
    options = ("--lines", "20:140:20", "--schedule", "x", "--out", tmp_path / "run")
    assert command("run", recorded(tmp_path), *roles, *options).code == 0
    assert livebode.Run(tmp_path / "run").summary["found"]["hop"] == 20
