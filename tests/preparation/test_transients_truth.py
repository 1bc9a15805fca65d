"""A transient at the beginning is left out of averages and bounds, and early spikes are found as late ones are."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from livebode.core import Lines
from livebode.estimation import Settings
from livebode.excitation import multisine
from livebode.preparation import AlignedLog, early_spikes, steady
from livebode.records import RunRecord
from livebode.sources import open_log
from tests.support.command import livebode, write_parquet
from tests.support.real_recordings import recording

RATE_HZ, WINDOW = 4000, 400
LINES = Lines.parse("20:140:20", RATE_HZ, WINDOW)
NAMES = {"excitation": "w", "input": "u", "output": "y"}


def recorded(transient: float, periods: int = 20, spike: int | None = None) -> dict[str, np.ndarray]:
    """A plant of gain 2 with noise, and a transient that has decayed to nothing after two periods."""
    rng = np.random.default_rng(2)
    w = np.resize(multisine(LINES), periods * WINDOW)
    u = w + 0.05 * rng.standard_normal(w.size)
    if spike is not None:
        u[spike * WINDOW + 137] += 1.0
    decay = np.exp(-np.arange(w.size) / (WINDOW / 8))
    return {"w": w, "u": u, "y": 2 * u + transient * decay + 0.05 * rng.standard_normal(w.size)}


def ran(tmp_path: Path, columns: dict[str, np.ndarray], *arguments: object) -> RunRecord:
    log = write_parquet(tmp_path / "log.parquet", columns)
    names = [word for role, name in NAMES.items() for word in (f"--{role}", name)]
    grid = ("--rate", RATE_HZ, "--lines", "20:140:20", "--window", WINDOW, "--average", "--forgetting", 1)
    done = livebode("run", log, *names, *grid, *arguments, "--out", tmp_path / f"run{len(arguments)}")
    assert done.code == 0, done.err
    return RunRecord.open(tmp_path / f"run{len(arguments)}")


def test_a_transient_is_left_out_of_averages_and_bounds_and_reported(tmp_path: Path) -> None:
    columns = recorded(transient=5.0)
    without, everything = ran(tmp_path, columns), ran(tmp_path, columns, "--all-periods")
    assert (without.found["left_out_samples"], everything.found["left_out_samples"]) == (WINDOW, 0)
    careful, plain = without.responses()[-1], everything.responses()[-1]
    assert careful.first == WINDOW
    assert np.median(plain.sigma) > 3 * np.median(careful.sigma)
    assert np.max(np.abs(careful.value - 2)) < 5 * np.max(careful.sigma)
    events = [json.loads(line) for line in (tmp_path / "run0" / "events.jsonl").read_text().splitlines()]
    assert [event["kind"] for event in events] == ["transient"]
    assert "--all-periods includes them" in events[0]["message"]


@pytest.mark.parametrize("transient", [0.0, 5.0])
@pytest.mark.parametrize("period", [1, 2, 3, 4, 6, 9, 16])
def test_a_spike_is_found_in_every_period(tmp_path: Path, transient: float, period: int) -> None:
    log = open_log(write_parquet(tmp_path / "log.parquet", recorded(transient, spike=period)), rate_hz=RATE_HZ)
    asked = Settings(lines=LINES, spikes=("u",), **NAMES)
    source = AlignedLog(log, (), steady(AlignedLog(log, ()), asked).first)
    early, at = early_spikes(source, asked).tolist(), period * WINDOW + 137
    # The spike behind a transient is left out with it; after nine periods the gate finds it by itself.
    assert early == ([at] if source.first <= at < source.first + 9 * WINDOW else [])


def test_an_early_spike_makes_its_windows_invalid(tmp_path: Path) -> None:
    run = ran(tmp_path, recorded(5.0, spike=3), "--spikes", "u")
    assert run.summary["counts"]["spike"] == 1
    table = pq.read_table(tmp_path / "run2" / "responses.parquet", columns=["sample"])
    assert min(table["sample"].to_pylist()) >= WINDOW


def test_motion_short_recordings_and_steady_ones_lose_nothing(tmp_path: Path) -> None:
    asked = Settings(lines=LINES, schedule="x", **NAMES)

    def left_out(columns: dict[str, np.ndarray]) -> int:
        size = columns["w"].size
        path = write_parquet(tmp_path / "log.parquet", {"x": np.linspace(0.2, 0.8, size)} | columns)
        return steady(AlignedLog(open_log(path, rate_hz=RATE_HZ), ()), asked).first // WINDOW

    still = {"x": np.full(20 * WINDOW, 0.8)}
    assert left_out(still | recorded(transient=5.0)) == 1
    assert left_out(still | recorded(transient=0.0)) == 0
    assert left_out(recorded(transient=5.0)) == 0
    assert left_out({"x": np.full(7 * WINDOW, 0.8)} | recorded(transient=5.0, periods=7)) == 0


def test_the_first_period_of_a_real_bench_is_left_out() -> None:
    log = AlignedLog(open_log(recording("motorbench/MultisineTypeA.mat")), ())
    lines = Lines.parse("11:250:1", rate_hz=2500, window=2500)
    asked = Settings(lines=lines, excitation="iq_refx", input="iq_adx", output="theta_mx")
    assert steady(log, asked).first == 2500
