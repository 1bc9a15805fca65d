"""A position that creeps, and an angle that wraps: right by the defaults, and by the configuration that is written."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import livebode as lb
from livebode.core import Lines
from livebode.excitation import multisine
from tests.support.command import livebode

RATE_HZ, WINDOW, PERIODS = 1000.0, 200, 16
LINES = Lines.of_bins((2, 3, 4, 5, 7, 9, 12, 16, 20, 26), WINDOW, RATE_HZ)
ROLES = ("--input", "torque", "--output", "angle", "--estimator", "direct")
PLANT = 0.05 / (LINES.z - 0.95)
T = np.arange(WINDOW * PERIODS) / WINDOW


@pytest.fixture
def recorded(tmp_path: Path) -> tuple[Path, Path]:
    """An angle in degrees that creeps by 3 degrees in a period, and one that wraps while it turns."""
    period = multisine(LINES, 1.0)
    spectrum = np.fft.rfft(period)
    spectrum[list(LINES.bins)] *= PLANT
    y = np.tile(np.fft.irfft(spectrum, WINDOW), PERIODS)
    y += 1e-3 * np.random.default_rng(3).standard_normal(y.size)
    for name, angle in (("creep", y + 0.05 * T), ("wrap", (y + 2.0 * T) % (2 * np.pi))):
        table = np.column_stack([np.arange(y.size) / RATE_HZ, np.tile(period, PERIODS), np.degrees(angle)])
        np.savetxt(tmp_path / f"{name}.csv", table, delimiter=",", header="t [s],torque [N m],angle [deg]", comments="")
    return tmp_path / "creep.csv", tmp_path / "wrap.csv"


def kinds(run: Path) -> list[str]:
    return [json.loads(line)["kind"] for line in (run / "events.jsonl").read_text().splitlines()]


def largest_error(run: Path) -> float:
    mean = lb.open(run).average
    return float(np.max(np.abs(mean.value - PLANT) / mean.sigma))


def configured(log: Path) -> tuple[Path, dict[str, Any]]:
    """What `inspect --out` writes."""
    toml = log.with_suffix(".toml")
    livebode("inspect", log, "--out", toml, "--yes", "--fit", "none", "--excitation", "-", "--input", "torque")
    return toml, tomllib.loads(toml.read_text())


def test_a_creep_is_subtracted_with_the_defaults_and_by_the_configuration_that_is_written(
    recorded: tuple[Path, Path], tmp_path: Path
) -> None:
    creep, _ = recorded
    result = livebode("run", creep, *ROLES, "--out", tmp_path / "a")
    assert "'angle' drifts by 0.05 rad from window to window" in " ".join(result.err.split())
    assert kinds(tmp_path / "a").count("trend-subtracted") == 1
    toml, tables = configured(creep)
    assert tables["tracking"]["trend"] == "subtract"
    assert "# 'angle' drifts by 0.05 rad" in toml.read_text()
    livebode("run", toml, "--out", tmp_path / "b")
    assert "trend-subtracted" not in kinds(tmp_path / "b")  # as configured
    for run in ("a", "b"):
        assert largest_error(tmp_path / run) < 3.2  # 10 lines: once in 2,800 runs
    livebode("run", toml, "--trend", "keep", "--out", tmp_path / "kept")
    kept = lb.open(tmp_path / "kept").average
    assert np.median(np.abs(kept.value / PLANT - 1)) > 0.008  # with a noise of 0.03 %


def test_an_angle_that_wraps_is_unwrapped_with_the_defaults_and_by_the_configuration_that_is_written(
    recorded: tuple[Path, Path], tmp_path: Path
) -> None:
    _, wrap = recorded
    result = livebode("run", wrap, *ROLES, "--out", tmp_path / "a")
    assert "'angle' wraps at 6.28318531 rad, " in " ".join(result.err.split())
    assert lb.open(tmp_path / "a").summary["found"]["unwrapped"] == {"angle": pytest.approx(2 * np.pi)}
    toml, tables = configured(wrap)
    assert tables["signals"]["output"] == "unwrap(angle, 6.283185307179586)"
    livebode("run", toml, "--out", tmp_path / "b")
    assert "unwrapped" not in kinds(tmp_path / "b")
    for run in ("a", "b"):
        assert largest_error(tmp_path / run) < 3.2
    livebode("run", wrap, *ROLES, "--no-unwrap", "--accept-roles",
             "--out", tmp_path / "kept")  # fmt: skip
    assert "unwrapped" not in kinds(tmp_path / "kept")


def test_inspect_shows_what_wraps_and_what_drifts(recorded: tuple[Path, Path]) -> None:
    creep, wrap = recorded
    shown = livebode("inspect", creep, "--excitation", "torque", "--output", "angle").out
    assert "'angle' drifts by 0.05 rad from window to window" in shown
    assert "wraps at" not in shown
    assert "'angle' wraps at 6.28318531 rad" in livebode("inspect", wrap).out
